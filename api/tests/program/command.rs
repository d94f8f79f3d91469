//! The program as a command, and what it says.

use std::{
    env,
    io::{self, Read as _, Write as _},
    net::TcpStream,
    process::{Child, Command, Output},
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use tempfile::TempDir;
use tests::server::Server;

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

/// What a run that must succeed printed.
pub(crate) fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}", said(output));
    stdout(output).to_owned()
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

/// The path of a file in a folder.
pub(crate) fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// Sends a request, with a token if there is one, on a connection of its own.
pub(crate) fn sent(server: &Server, token: Option<&str>, method: &str, path: &str, body: &str) -> TcpStream {
    let mut socket = TcpStream::connect(&server.address).expect("listens");
    socket
        .set_read_timeout(Some(Duration::from_mins(1)))
        .expect("is a socket");
    let authorization = token.map_or_else(String::new, |token| format!("authorization: Bearer {token}\r\n"));
    let content = if body.is_empty() {
        String::new()
    } else {
        let length = body.len();
        format!("content-type: application/json\r\ncontent-length: {length}\r\n")
    };
    let request = format!(
        "{method} {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n{authorization}{content}\r\n{body}"
    );
    socket.write_all(request.as_bytes()).expect("takes a request");
    socket
}

/// The answer of a running program to one request, as it comes.
pub(crate) fn ask(server: &Server, method: &str, path: &str, body: &str) -> String {
    ask_as(server, None, method, path, body)
}

/// The same with a token, if there is one.
pub(crate) fn ask_as(server: &Server, token: Option<&str>, method: &str, path: &str, body: &str) -> String {
    let mut answer = String::new();
    let mut socket = sent(server, token, method, path, body);
    socket.read_to_string(&mut answer).expect("answers and closes");
    answer
}

/// The status of an answer.
pub(crate) fn status(answer: &str) -> u16 {
    let status = answer.split(' ').nth(1).expect("has a status");
    status.parse().expect("is a number")
}

/// What stands below an answer's head.
pub(crate) fn body(answer: &str) -> &str {
    answer.split_once("\r\n\r\n").expect("has a body").1
}

/// A number of `/metrics`.
pub(crate) fn metric(server: &Server, name: &str) -> f64 {
    let metrics = ask(server, "GET", "/metrics", "");
    let sample = metrics
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    sample.expect("is counted").parse().expect("is a number")
}

/// Sends a signal to a program that runs.
pub(crate) fn signal(process: &Child, signal: Signal) {
    kill_process(Pid::from_child(process), signal).expect("is ours");
}

/// Whether this machine has a program that a test needs; if not, the test is skipped, and says so.
pub(crate) fn has(program: &str) -> bool {
    let paths = env::var_os("PATH").unwrap_or_default();
    let found = env::split_paths(&paths).any(|folder| folder.join(program).is_file());
    if !found {
        // Not by `eprintln!`: what tests that pass print so is not shown.
        let _ = writeln!(
            io::stderr(),
            "SKIPPED: {program} is not installed (apt-get install {program})"
        );
    }
    found
}
