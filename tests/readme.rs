//! The README's commands, run as they stand there.
//!
//! A block of `bash` that calls `curl` is run against a server, and its answer is compared with the
//! block of `json` that follows. That block may leave members out, but what it shows must be true.

use std::{collections::BTreeMap, process::Command};

use serde_json::Value;
use tests::server::Server;

/// Where the README says that the server listens.
const README_ADDRESS: &str = "127.0.0.1:8080";

/// Relative difference of a number from the one in the README: it may print fewer digits than the
/// answer has.
const TOLERANCE: f64 = 1e-6;

/// The one member that differs between two equal requests, and the one that is only a name.
const NOT_COMPARED: [&str; 2] = ["solve_time_ms", "plan_id"];

/// A fenced block.
struct Block {
    language: String,
    text: String,
}

fn root() -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/..").to_owned()
}

fn readme() -> Vec<Block> {
    let text = std::fs::read_to_string(root() + "/README.md").expect("there is a README");
    blocks(&text)
}

fn blocks(markdown: &str) -> Vec<Block> {
    let mut blocks = vec![];
    let mut lines = markdown.lines();
    while let Some(opening) = lines.by_ref().find_map(|line| line.strip_prefix("```")) {
        let content: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        blocks.push(Block {
            language: opening.to_owned(),
            text: content.join("\n"),
        });
    }
    blocks
}

fn calls_the_server(block: &Block) -> bool {
    block.language == "bash" && block.text.contains(README_ADDRESS)
}

/// What `command` prints, run by a shell in the repository.
fn run(command: &str, server: &Server) -> String {
    let command = command.replace(README_ADDRESS, &server.address);
    if Command::new("curl").arg("--version").output().is_err() {
        return post_as_curl_would(&command);
    }
    let output = Command::new("bash")
        .args(["-euo", "pipefail", "-c", &command])
        .current_dir(root())
        .output()
        .expect("there is a bash");
    assert!(output.status.success(), "this failed:\n{command}");
    String::from_utf8(output.stdout).expect("prints text")
}

/// The answer to `curl URL -d @FILE` on a machine that has no curl.
fn post_as_curl_would(command: &str) -> String {
    let word = |start: &str| command.split_whitespace().find(|word| word.starts_with(start));
    let url = word("http://").expect("the command names a URL");
    let file = word("@")
        .expect("the command names a file")
        .trim_start_matches('@');
    let body = std::fs::read_to_string(format!("{}/{file}", root())).expect("the file is there");
    let request = ureq::post(url).content_type("application/json");
    let mut response = request.send(body).expect("the server answers");
    response.body_mut().read_to_string().expect("the answer ends")
}

/// Where `shown` says something else than `answer`, as JSON pointers.
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
        // A list may be cut short after its first entries, and is never empty where the answer's is not.
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
fn without_curl_the_same_answer_is_fetched_by_hand() {
    let server = Server::start(Command::new(env!("CARGO_BIN_EXE_pilotfish")));
    let command = format!(
        "curl -s {}/v1/plan -d @examples/snapshots/track.json",
        server.url()
    );
    let plan: Value = serde_json::from_str(&post_as_curl_would(&command)).expect("is JSON");
    assert_eq!(plan["targets"][0]["id"], "auv-1");
    assert_eq!(plan["outcome"], "ok");
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

/// The arguments of every `cargo run --release -- …` in the README, in blocks and in running text.
fn invocations() -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(root() + "/README.md").expect("there is a README");
    let commands = text.split("cargo run --release -- ").skip(1);
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
fn the_missions_that_the_readme_names_run_as_they_stand() {
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

/// What `compare` prints of each scenario, each run once.
#[derive(Default)]
struct Comparisons(BTreeMap<String, Value>);

impl Comparisons {
    fn metric(&mut self, scenario: &str, controller: &str, metric: &str) -> f64 {
        let run = || {
            let output = Command::new(env!("CARGO_BIN_EXE_pilotfish"))
                .args(["compare", scenario, "--format", "json"])
                .output()
                .expect("the program starts");
            serde_json::from_slice(&output.stdout).expect("prints JSON")
        };
        let comparison = self.0.entry(scenario.to_owned()).or_insert_with(run);
        comparison["controllers"][controller][metric]
            .as_f64()
            .expect("a number")
    }
}

/// Whether `cell` shows `printed`: to one unit of its last digit, as processors differ in the last bit of a sine.
fn shows(cell: &str, printed: f64) -> bool {
    let decimals = cell.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let shown: f64 = cell.parse().expect("a number");
    let digit = 0.1_f64.powi(i32::try_from(decimals).expect("a short number"));
    (shown - printed).abs() <= digit
}

#[test]
fn the_tables_of_readme_and_benchmark_show_what_compare_prints() {
    let read = |file: &str| std::fs::read_to_string(format!("{}/{file}", root())).expect("is there");
    let text = read("README.md") + &read("docs/benchmark.md");
    let cells = |line: &str| {
        line.split('|')
            .map(|cell| cell.trim().trim_matches('`').to_owned())
            .collect::<Vec<_>>()
    };
    let rows: Vec<_> = text
        .lines()
        .filter(|line| line.starts_with("| "))
        .map(cells)
        .collect();
    let mut comparisons = Comparisons::default();
    let mut compared = 0;
    let mut check = |cell: &str, scenario: &str, controller: &str, metric: &str| {
        let printed = comparisons.metric(scenario, controller, metric);
        assert!(
            shows(cell, printed),
            "{scenario}, {controller}, {metric}: {printed}, not {cell}"
        );
        compared += 1;
    };
    let is = |row: &Vec<String>, word: &str| row.get(2).is_some_and(|cell| cell == word);
    for pair in rows.windows(2).filter(|pair| is(&pair[0], "planner")) {
        for (row, controller) in pair.iter().zip(["mpc", "saturated_los"]) {
            let metrics = [
                "rms_m",
                "settled_rms_m",
                "max_m",
                "energy_j",
                "heading_travel_rad",
            ];
            for (cell, metric) in row[3..].iter().zip(metrics) {
                check(cell, &pair[0][1], controller, metric);
            }
        }
    }
    let heads = rows
        .iter()
        .position(|row| is(row, "mpc"))
        .expect("has the other table");
    let controllers = &rows[heads][2..rows[heads].len() - 1];
    for row in rows[heads + 1..].iter().take(6) {
        for (cell, controller) in row[2..].iter().zip(controllers) {
            check(cell, &row[1], controller, "rms_m");
        }
    }
    assert!(
        !controllers.contains(&"printed_los".to_owned()),
        "what runs away is in no table of winners"
    );
    assert_eq!(
        compared,
        4 * 2 * 5 + 6 * 5,
        "four scenarios, two controllers, five metrics; six scenarios, five controllers"
    );
}

#[test]
fn a_readme_that_shows_something_else_than_the_answer_is_found_out() {
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

#[test]
fn blocks_end_where_their_fence_ends() {
    let found = blocks("a\n```bash\none\ntwo\n```\nb\n```json\n{}\n```\n");
    let found: Vec<_> = found
        .iter()
        .map(|block| (block.language.as_str(), block.text.as_str()))
        .collect();
    assert_eq!(found, [("bash", "one\ntwo"), ("json", "{}")]);
}
