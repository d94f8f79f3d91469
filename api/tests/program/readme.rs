//! The README's commands, run as written.
//!
//! A block of `bash` that calls `curl` is run against a server, and its answer is compared with the
//! block of `json` that follows, which may omit members.

use std::process::Command;

use serde_json::Value;
use tests::server::Server;

use crate::{
    command::has,
    markdown::{Block, blocks},
};

/// The README's address of the server.
const README_ADDRESS: &str = "127.0.0.1:8080";

/// Relative difference of a number from the one in the README: it may print fewer digits than the
/// answer has.
const TOLERANCE: f64 = 1e-6;

/// The one member that differs between two equal requests, and the one that is only a name.
const NOT_COMPARED: [&str; 2] = ["solve_time_ms", "plan_id"];

fn root() -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/..").to_owned()
}

fn readme() -> Vec<Block> {
    let text = std::fs::read_to_string(root() + "/README.md").expect("there is a README");
    blocks(&text)
}

fn calls_the_server(block: &Block) -> bool {
    block.language == "bash" && block.text.contains(README_ADDRESS)
}

/// The output of `command` in a shell in the repository.
fn run(command: &str, server: &Server) -> String {
    let command = command.replace(README_ADDRESS, &server.address);
    let output = Command::new("bash")
        .args(["-euo", "pipefail", "-c", &command])
        .current_dir(root())
        .output()
        .expect("there is a bash");
    assert!(output.status.success(), "this failed:\n{command}");
    String::from_utf8(output.stdout).expect("prints text")
}

/// Differences of `shown` from `answer`, as JSON pointers.
fn differences(shown: &Value, answer: &Value, pointer: &str) -> Vec<String> {
    let one = |what: String| vec![format!("{pointer}: {what}")];
    match (shown, answer) {
        (Value::Object(shown), Value::Object(answer)) => shown
            .iter()
            .filter(|(name, _)| !NOT_COMPARED.contains(&name.as_str()))
            .flat_map(|(name, value)| {
                differences(
                    value,
                    answer.get(name).unwrap_or(&Value::Null),
                    &format!("{pointer}/{name}"),
                )
            })
            .collect(),
        // A list may be truncated after its first entries, and is empty only with the answer's.
        (Value::Array(shown), Value::Array(answer)) if shown.is_empty() != answer.is_empty() => {
            one(format!("{} entries are shown of {}", shown.len(), answer.len()))
        }
        (Value::Array(shown), Value::Array(answer)) => shown
            .iter()
            .enumerate()
            .flat_map(|(i, value)| {
                differences(
                    value,
                    answer.get(i).unwrap_or(&Value::Null),
                    &format!("{pointer}/{i}"),
                )
            })
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
    let server = Server::start(Command::new(env!("CARGO_BIN_EXE_pilotfish")));
    let blocks = readme();
    let mut compared = 0;
    for (i, block) in blocks
        .iter()
        .enumerate()
        .filter(|(_, block)| calls_the_server(block))
    {
        let printed = run(&block.text, &server);
        let Some(shown) = blocks.get(i + 1).filter(|next| next.language == "json") else {
            continue;
        };
        let answer = serde_json::from_str(&printed).expect("the command prints JSON");
        let shown = serde_json::from_str(&shown.text).expect("the README shows JSON");
        let differences = differences(&shown, &answer, "");
        assert!(
            differences.is_empty(),
            "{}\n{}",
            block.text,
            differences.join("\n")
        );
        compared += 1;
    }
    assert_ne!(compared, 0, "the README shows a command and its answer");
}

#[test]
fn the_two_commands_to_begin_with_stand_alone_on_a_line() {
    let blocks = readme();
    for command in ["cargo run --release", "cargo test --workspace"] {
        let mut lines = blocks
            .iter()
            .filter(|block| block.language == "bash")
            .flat_map(|block| block.text.lines());
        assert!(
            lines.any(|line| line.split('#').next().map(str::trim) == Some(command)),
            "{command}"
        );
    }
}

/// The arguments of every `cargo run --release --features full -- …` in the README.
fn invocations() -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(root() + "/README.md").expect("there is a README");
    let commands = text.split("cargo run --release --features full -- ").skip(1);
    let until_its_end = |rest: &str| rest.split(['`', '\n', '#']).next().unwrap_or_default().to_owned();
    commands
        .map(|rest| {
            until_its_end(rest)
                .split_whitespace()
                .map(str::to_owned)
                .collect()
        })
        .collect()
}

#[test]
fn differences_of_the_readme_from_the_answer_are_found() {
    let answer: Value = serde_json::from_str(
        r#"{"method":"mpc","plan_id":"a","reference":{"speed_mps":0.4123456789},"trajectory":[{"t_s":1.0},{"t_s":2.0}]}"#,
    )
    .expect("is JSON");
    let found = |shown: &str| differences(&serde_json::from_str(shown).expect("is JSON"), &answer, "").len();
    for true_to_it in [
        "{}",
        r#"{"reference":{"speed_mps":0.412346},"plan_id":"b"}"#,
        r#"{"trajectory":[{"t_s":1}]}"#,
    ] {
        assert_eq!(found(true_to_it), 0, "{true_to_it}");
    }
    for untrue in [
        r#"{"method":"hold"}"#,
        r#"{"reference":{"speed_mps":0.4123}}"#,
        r#"{"reference":{"speed":0.4}}"#,
        r#"{"trajectory":[]}"#,
        r#"{"trajectory":[{"t_s":1},{"t_s":2},{"t_s":3}]}"#,
        r#"{"trajectory":{}}"#,
    ] {
        assert_eq!(found(untrue), 1, "{untrue}");
    }
}

mod slow {
    use super::*;

    #[test]
    fn the_missions_of_the_readme_run_as_written() {
        let directory = std::env::temp_dir().join(format!("pilotfish-readme-{}", std::process::id()));
        std::fs::create_dir_all(&directory).expect("can be made");
        let invocations = invocations();
        assert!(invocations.len() >= 2, "{invocations:?}");
        for arguments in invocations {
            let output = Command::new(env!("CARGO_BIN_EXE_pilotfish"))
                .args(&arguments)
                .current_dir(&directory)
                .output()
                .expect("the program starts");
            assert!(
                output.status.success(),
                "{arguments:?}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
        std::fs::remove_dir_all(&directory).expect("was made above");
    }
}
