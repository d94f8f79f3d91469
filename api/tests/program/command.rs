//! The program as a command, and its output.

use std::io::{self, Write as _};
use std::process::{Child, Command, Output};
use std::time::Duration;
use std::{env, fs};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use tempfile::TempDir;
use tests::{client::Answer, server::Server};
use ureq::{Agent, http};

/// A longer wait for an answer fails the test.
const PATIENCE: Duration = Duration::from_mins(1);

/// Longest answer read, bytes: the record of an hour of kills.
const ANSWER_BYTES_MAX: u64 = 1 << 30;

pub(crate) const SMALL_CAMPAIGN: &str = r#"
schema_version = "1"
name = "small"
title = "a small campaign"
scenarios = ["paper-tracking", "noisy-fixes"]
duration_s = 90
replicates = 8
[tuning]
replicates = 1
[[controllers]]
name = "mpc auto"
planner = {}
[[controllers]]
name = "saturated_los"
law = { name = "saturated_los" }
"#;

/// The program with no setting of the machine's.
pub(crate) fn pilotfish() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_pilotfish"));
    for (variable, _) in env::vars_os() {
        if variable.to_string_lossy().starts_with("PILOTFISH_") {
            program.env_remove(variable);
        }
    }
    program.env_remove("RUST_LOG");
    program
}

pub(crate) fn run(arguments: &[&str]) -> Output {
    pilotfish().args(arguments).output().expect("the program starts")
}

/// A command with no space in its arguments.
pub(crate) fn line(command: &str) -> Output {
    run(&command.split(' ').collect::<Vec<_>>())
}

/// The output of a run that must succeed.
pub(crate) fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}", said(output));
    stdout(output).to_owned()
}

/// The reason of a run that must fail.
pub(crate) fn refusal(output: &Output) -> &str {
    assert!(!output.status.success(), "{}", said(output));
    stderr(output)
}

/// Fails unless `text` has every part.
#[track_caller]
pub(crate) fn has_all(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

/// A service with these arguments.
pub(crate) fn serving(arguments: &[&str]) -> Server {
    let mut program = pilotfish();
    program.args(arguments);
    Server::start(program)
}

pub(crate) fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("is JSON")
}

pub(crate) fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("is text")
}

pub(crate) fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("is text")
}

/// Both.
pub(crate) fn said(output: &Output) -> String {
    stdout(output).to_owned() + stderr(output)
}

/// The path of a new file in a folder.
pub(crate) fn written(folder: &TempDir, name: &str, text: &str) -> String {
    let path = path(folder, name);
    fs::write(&path, text).expect("there is room");
    path
}

/// The path of a file in a folder.
pub(crate) fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// A client that keeps its connections.
pub(crate) fn agent() -> Agent {
    let config = Agent::config_builder().http_status_as_error(false).proxy(None);
    config.timeout_global(Some(PATIENCE)).build().new_agent()
}

/// The answer to a request with these headers and a JSON body, unless empty. Fails if incomplete.
pub(crate) fn try_ask(
    agent: &Agent,
    method: &str,
    url: &str,
    headers: &[(&str, &str)],
    body: &str,
) -> Result<Answer, ureq::Error> {
    let mut request = http::Request::builder().method(method).uri(url);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    if !body.is_empty() {
        request = request.header("content-type", "application/json");
    }
    let answer = agent.run(request.body(body)?)?;
    let (head, mut body) = answer.into_parts();
    Ok(Answer {
        text: body.with_config().limit(ANSWER_BYTES_MAX).read_to_string()?,
        status: head.status,
        headers: head.headers,
    })
}

/// The answer of a running program to one request.
pub(crate) fn ask(server: &Server, method: &str, path: &str, body: &str) -> Answer {
    ask_as(server, None, method, path, body)
}

/// The same with a token, if there is one.
pub(crate) fn ask_as(server: &Server, token: Option<&str>, method: &str, path: &str, body: &str) -> Answer {
    let bearer = token.map(|token| format!("Bearer {token}"));
    let headers: Vec<_> = bearer.iter().map(|bearer| ("authorization", bearer.as_str())).collect();
    let url = server.url() + path;
    try_ask(&agent(), method, &url, &headers, body).expect("the service answers")
}

/// A number of `/metrics`.
pub(crate) fn metric(server: &Server, name: &str) -> f64 {
    let metrics = ask(server, "GET", "/metrics", "").text;
    let sample = metrics.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    sample.expect("is counted").parse().expect("is a number")
}

/// Sends a signal to a running program.
pub(crate) fn signal(process: &Child, signal: Signal) {
    kill_process(Pid::from_child(process), signal).expect("is ours");
}

/// `true` if this machine has a program that a test needs; otherwise says that the test is skipped.
pub(crate) fn has(program: &str) -> bool {
    let paths = env::var_os("PATH").unwrap_or_default();
    let found = env::split_paths(&paths).any(|folder| folder.join(program).is_file());
    if !found {
        // Not by `eprintln!`, whose output of passing tests is hidden.
        let _ = writeln!(io::stderr(), "SKIPPED: {program} is not installed (apt-get install {program})");
    }
    found
}
