//! The README's commands, run as written.
//!
//! A block of `bash` that calls `curl` is run against a server, and its answer is compared with the
//! block of `json` that follows, which may omit members.

use std::{fs, process::Command};

use serde_json::Value;
use tests::server::Server;

use crate::command::{has, json, pilotfish, printed, serving};
use crate::docs::root;
use crate::markdown::{Block, blocks};

/// The README's address of the server.
const README_ADDRESS: &str = "127.0.0.1:8080";

/// Relative difference of a number from the one in the README: it may print fewer digits than the
/// answer has.
const TOLERANCE: f64 = 1e-6;

/// The one member that differs between two equal requests, and the one that is only a name.
const NOT_COMPARED: [&str; 2] = ["solve_time_ms", "plan_id"];

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("there is a README")
}

fn calls_the_server(block: &Block) -> bool {
    block.language == "bash" && block.text.contains(README_ADDRESS)
}

/// The output of `command` in a shell in the repository.
fn run(command: &str, server: &Server) -> String {
    let command = command.replace(README_ADDRESS, &server.address);
    let mut bash = Command::new("bash");
    bash.args(["-euo", "pipefail", "-c", &command]).current_dir(root());
    printed(&bash.output().expect("there is a bash"))
}

/// Differences of `shown` from `answer`, as JSON pointers.
fn differences(shown: &Value, answer: &Value, pointer: &str) -> Vec<String> {
    let one = |what: String| vec![format!("{pointer}: {what}")];
    let within = |value: &Value, answer: Option<&Value>, step: &str| {
        differences(value, answer.unwrap_or(&Value::Null), &format!("{pointer}/{step}"))
    };
    match (shown, answer) {
        (Value::Object(shown), Value::Object(answer)) => shown
            .iter()
            .filter(|(name, _)| !NOT_COMPARED.contains(&name.as_str()))
            .flat_map(|(name, value)| within(value, answer.get(name), name))
            .collect(),
        // A list may be truncated after its first entries, and is empty only with the answer's.
        (Value::Array(shown), Value::Array(answer)) if shown.is_empty() != answer.is_empty() => {
            one(format!("{} entries are shown of {}", shown.len(), answer.len()))
        }
        (Value::Array(shown), Value::Array(answer)) => shown
            .iter()
            .enumerate()
            .flat_map(|(i, value)| within(value, answer.get(i), &i.to_string()))
            .collect(),
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().expect("is finite"));
            if (a - b).abs() <= TOLERANCE * b.abs().max(1.0) {
                vec![]
            } else {
                one(format!("{a} is shown, {b} is answered"))
            }
        }
        (a, b) if a == b => vec![],
        (a, b) => one(format!("{a} is shown, {b} is answered")),
    }
}

#[test]
fn the_commands_that_reach_the_server_print_what_the_readme_shows() {
    if !has("bash") || !has("curl") {
        return;
    }
    let server = serving(&[]);
    let blocks = blocks(&readme());
    let mut compared = 0;
    for (i, block) in blocks.iter().enumerate() {
        if !calls_the_server(block) {
            continue;
        }
        let printed = run(&block.text, &server);
        if let Some(shown) = blocks.get(i + 1).filter(|next| next.language == "json") {
            let differences = differences(&json(&shown.text), &json(&printed), "");
            assert_eq!(differences, [""; 0], "{}", block.text);
            compared += 1;
        }
    }
    assert_ne!(compared, 0, "the README shows a command and its answer");
}

#[test]
fn the_two_commands_to_begin_with_stand_alone_on_a_line() {
    let blocks = blocks(&readme());
    for command in ["cargo run --release", "cargo test --workspace"] {
        let mut lines =
            blocks.iter().filter(|block| block.language == "bash").flat_map(|block| block.text.lines());
        assert!(lines.any(|line| line.split('#').next().map(str::trim) == Some(command)), "{command}");
    }
}

/// The arguments of every `cargo run --release --features full -- …` in the README.
fn invocations() -> Vec<Vec<String>> {
    let text = readme();
    let commands = text.split("cargo run --release --features full -- ").skip(1);
    let commands = commands.filter_map(|rest| rest.split(['`', '\n', '#']).next());
    let words = |command: &str| command.split_whitespace().map(str::to_owned).collect();
    commands.map(words).collect()
}

mod slow {
    use super::*;

    #[test]
    fn the_missions_of_the_readme_run_as_written() {
        let directory = tempfile::tempdir().expect("there is room");
        let invocations = invocations();
        assert!(invocations.len() >= 2, "{invocations:?}");
        for arguments in invocations {
            let mut program = pilotfish();
            program.args(&arguments).current_dir(&directory);
            printed(&program.output().expect("the program starts"));
        }
    }
}
