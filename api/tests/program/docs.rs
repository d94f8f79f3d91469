//! Commands, fields, files and examples of the documentation work. Its figures: [`crate::figures`].

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use service::Settings;
use sim::scenario::{Files, Scenario};
use tests::client::{get, send};
use toml::{Table, map::Entry};

use crate::command::{ask, has, pilotfish, serving, stderr, written};
use crate::markdown::{blocks, spans, titles, without_blocks};

/// A page of the documentation.
pub(crate) struct Page {
    /// Path from the repository's root.
    pub(crate) name: String,
    pub(crate) text: String,
}

pub(crate) fn root() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.canonicalize().expect("the repository is there")
}

pub(crate) fn pages() -> Vec<Page> {
    let docs = ["docs", "docs/lessons", "docs/joss"].into_iter().flat_map(|folder| {
        let files = fs::read_dir(root().join(folder)).expect("there is a folder of pages");
        let files = files.map(|entry| entry.expect("can be listed").file_name());
        files.map(move |name| format!("{folder}/{}", name.into_string().expect("is text")))
    });
    let others =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md"].map(str::to_owned).into_iter();
    let guides = ["examples", "api/python", "api/ros2"].map(|folder| format!("{folder}/README.md"));
    let page = |name: String| Page {
        text: fs::read_to_string(root().join(&name)).expect("the page is there"),
        name,
    };
    let names = others.chain(guides).chain(docs);
    let is_page = |name: &String| Path::new(name).extension().is_some_and(|is| is == "md");
    names.filter(is_page).map(page).collect()
}

/// Fails with the faults of all pages.
#[track_caller]
pub(crate) fn none(mut faults: impl FnMut(&Page) -> Vec<String>) {
    let mut lines = vec![];
    for page in pages() {
        let faults = faults(&page).into_iter();
        lines.extend(faults.map(|what| format!("{}: {what}", page.name)));
    }
    assert!(lines.is_empty(), "{}", lines.join("\n"));
}

/// Files in `git`, as paths from the root.
fn tracked() -> BTreeSet<String> {
    let mut files = BTreeSet::new();
    let mut open = vec![root()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).expect("can be listed") {
            let path = entry.expect("can be listed").path();
            let name = path.strip_prefix(root()).expect("is below").display().to_string();
            if path.is_dir() && !matches!(name.rsplit('/').next(), Some(".git" | "target" | "node_modules")) {
                open.push(path);
                files.insert(format!("{name}/"));
            }
            files.insert(name);
        }
    }
    files
}

#[test]
fn links_and_their_anchors_exist() {
    none(|page| {
        let text = without_blocks(&page.text);
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let fault = |link: &str| {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let here = root().join(&page.name);
            let target = if file.is_empty() { here } else { here.with_file_name(file) };
            if link.contains("://") {
                None
            } else if !target.exists() {
                Some(format!("{link} is not there"))
            } else {
                let text = fs::read_to_string(target).unwrap_or_default();
                let has_it = anchor.is_empty() || titles(&text).contains(anchor);
                (!has_it).then(|| format!("{link} has no such title"))
            }
        };
        links.filter_map(fault).collect()
    });
}

#[tokio::test]
async fn files_and_routes_and_names_in_backticks_exist() {
    let files = tracked();
    let words = words_of_the_code(&files);
    let document = send(Settings::default(), get("/openapi.json")).await.json();
    let routes = document["paths"].as_object().expect("has paths");
    let routes: BTreeSet<String> = routes.keys().map(|route| without_names(route)).collect();
    none(|page| {
        let mut found = vec![];
        for span in spans(&page.text) {
            for word in span.split_whitespace() {
                let beginning = word.split('/').next().unwrap_or_default();
                let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
                let is_file = word.contains('/')
                    && files.contains(&format!("{beginning}/"))
                    && word.chars().all(is_plain);
                let folder = page.name.rsplit_once('/').map(|(folder, _)| folder);
                let beside = folder.map(|folder| format!("{folder}/{word}"));
                if is_file && !files.contains(word) && beside.is_none_or(|file| !files.contains(&file)) {
                    found.push(format!("the file {word}"));
                }
            }
            let last = span.rsplit(' ').next().unwrap_or_default();
            let route = last.split(['?', '…']).next().unwrap_or_default();
            if route.starts_with("/v1/") && !routes.contains(&without_names(route)) {
                found.push(format!("the route {route}"));
            }
            let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            for part in span.split('.') {
                // The exporter of metrics adds these.
                let exported = part.strip_suffix("_total").or(part.strip_suffix("_info"));
                let known = |name: &str| words.contains(name) || OF_OTHERS.contains(&name);
                let is_known = known(part) || exported.is_some_and(known);
                if part.contains('_') && part.chars().all(is_name) && !is_known {
                    found.push(format!("the name {part}"));
                }
            }
        }
        found
    });
}

/// Names of other programs.
const OF_OTHERS: [&str; 5] =
    ["duration_reset", "rmw_fastrtps_cpp", "sim_vehicle", "tardy_helm_threshold", "transient_local"];

/// A route whose parameters are all called the same.
fn without_names(route: &str) -> String {
    let part = |part: &str| {
        if part.starts_with('{') { "{}".to_owned() } else { part.to_owned() }
    };
    route.split('/').map(part).collect::<Vec<_>>().join("/")
}

/// Every word of the program, its tests and its clients, as written and as serde writes it.
fn words_of_the_code(files: &BTreeSet<String>) -> BTreeSet<String> {
    let is_code = |file: &&String| {
        let kind = file.rsplit('.').next().unwrap_or_default();
        matches!(kind, "rs" | "py" | "toml" | "json" | "js" | "mjs" | "xml" | "service" | "bhv")
    };
    let mut words = BTreeSet::new();
    for file in files.iter().filter(is_code) {
        let text = fs::read_to_string(root().join(file)).unwrap_or_default();
        for word in text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_') {
            if word.starts_with(|c: char| c.is_ascii_uppercase()) {
                let snake = word.chars().flat_map(|c| {
                    let begins = c.is_ascii_uppercase().then_some('_');
                    begins.into_iter().chain([c.to_ascii_lowercase()])
                });
                words.insert(snake.skip(1).collect());
            }
            words.insert(word.to_owned());
        }
    }
    words
}

/// `pilotfish`, `cargo run --release --features full --` and `sudo` in a shell without programs:
/// `--help` completes each command line, and only reads the flags before it.
const SHELL: &str = r#"
PATH=
pilotfish() { error=$("$PROGRAM" "$@" --help 2>&1 >/dev/null </dev/null) || echo "pilotfish $*: ${error%%$'\n'*}" >> "$FOUND"; echo x; }
cargo() { if [[ "$*" == "run --release --features full -- "* ]]; then shift 5; pilotfish "$@"; fi; }
sudo() { "$@"; }
command_not_found_handle() { echo x; }
"#;

#[test]
fn command_lines_have_subcommands_and_flags_that_exist() {
    if !has("bash") {
        return;
    }
    let folder = tempfile::tempdir().expect("there is room");
    let starts = ["pilotfish ", "cargo run --release --features full -- "];
    none(|page| {
        let in_blocks = blocks(&page.text).into_iter();
        let in_blocks = in_blocks.filter(|block| matches!(&*block.language, "bash" | "sh"));
        let in_text = spans(&page.text).into_iter();
        let in_text = in_text.filter(|span| starts.iter().any(|start| span.starts_with(start)));
        let commands = in_blocks.map(|block| block.text).chain(in_text);
        let script = commands.fold(SHELL.to_owned(), |script, command| script + "\n" + &command);
        let errors = written(&folder, "errors", "");
        let mut bash = Command::new("bash");
        bash.args(["-c", &script]).current_dir(&folder);
        bash.env("PROGRAM", env!("CARGO_BIN_EXE_pilotfish")).env("FOUND", &errors);
        bash.output().expect("bash starts");
        let text = fs::read_to_string(&errors).expect("can be read");
        text.lines().filter(|line| !is_placeholder(line)).map(str::to_owned).collect()
    });
}

/// `true` if the program only objects to a placeholder of a value, such as `--days N`.
fn is_placeholder(error: &str) -> bool {
    let quoted = error.split('\'').nth(1).unwrap_or_default();
    let stands_for_one = quoted.chars().all(|c| c.is_ascii_uppercase() || "_…".contains(c));
    error.contains("a value is required for") || (error.contains("invalid value") && stands_for_one)
}

#[test]
fn json_examples_are_accepted() {
    let server = serving(&[]);
    let words = words_of_the_code(&tracked());
    let fault = |value: Value| {
        let route = if value.get("asc").or(value.get("surface_craft")).is_some() {
            "/v1/plan"
        } else if value.get("live").is_some() {
            "/v1/missions"
        } else if value.get("modem").is_some() {
            let settings = serde_json::from_value(value);
            let modem = settings.map(|settings| bridge::acoustics::Modem::new(&settings));
            let is_one = modem.is_ok_and(|modem| modem.is_ok());
            return (!is_one).then(|| "these are no settings of a modem".to_owned());
        } else {
            let is_unknown = |name: &String| name.contains('_') && !words.contains(name);
            let unknown = names(&value).into_iter().find(is_unknown);
            return unknown.map(|name| format!("the member {name}"));
        };
        let answer = ask(&server, "POST", route, &value.to_string());
        (!answer.status.is_success()).then_some(answer.text)
    };
    of_language("json", |text| {
        let mut values = serde_json::Deserializer::from_str(text).into_iter::<Value>();
        values.find_map(|value| match value {
            Ok(value) => fault(value),
            Err(error) => Some(error.to_string()),
        })
    });
}

/// Fails with the faults of the blocks in a language.
#[track_caller]
fn of_language(language: &str, fault: impl Fn(&str) -> Option<String>) {
    none(|page| {
        let blocks = blocks(&page.text).into_iter().filter(|block| block.language == language);
        let faults = blocks.filter_map(|block| Some(format!("{}\n{}", fault(&block.text)?, block.text)));
        faults.collect()
    });
}

/// The names of all members.
fn names(value: &Value) -> Vec<String> {
    match value {
        Value::Object(members) => {
            members.iter().flat_map(|(name, value)| [vec![name.clone()], names(value)].concat()).collect()
        }
        Value::Array(values) => values.iter().flat_map(names).collect(),
        _ => vec![],
    }
}

#[test]
fn python_examples_are_python() {
    if !has("python3") {
        return;
    }
    of_language("python", |text| {
        let parse = ["-c", "import ast, sys; ast.parse(sys.argv[1])", text];
        let parsed = Command::new("python3").args(parse).output().expect("starts");
        (!parsed.status.success()).then(|| stderr(&parsed).to_owned())
    });
}

#[test]
fn toml_examples_are_accepted() {
    of_language("toml", |text| {
        // Members that an example omits cannot be checked.
        if text.contains('…') {
            return None;
        }
        let accepted = match text.parse::<Table>() {
            Err(error) => Err(error.to_string()),
            Ok(table) if table.contains_key("replicates") => campaign(text),
            Ok(table) if table.contains_key("controllers") => campaign(&format!("{CAMPAIGN}{text}")),
            Ok(_) => scenario(text),
        };
        accepted.err()
    });
}

/// The part of a campaign before its controllers.
const CAMPAIGN: &str = "schema_version = \"1\"\nname = \"own\"\ntitle = \"own\"\nseed = 1\nscenarios = [\"calm\"]\nreplicates = 2\n\n";

/// The recorded track that an example names.
const TRACK: [&str; 2] = ["dive-12.csv", "t,north,east\n0,0,0\n1,0.2,0\n"];

/// A complete campaign.
fn campaign(text: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("there is room");
    let file = written(&folder, "campaign.toml", text);
    let mut program = pilotfish();
    program.args(["campaign", "run", "--dry-run", &file]);
    let output = program.output().expect("the program starts");
    output.status.success().then_some(()).ok_or_else(|| stderr(&output).to_owned())
}

/// A part of a scenario, as a whole or line by line if the lines are alternatives.
fn scenario(text: &str) -> Result<(), String> {
    let whole = with_the_rest(text);
    let mut header = String::new();
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if line.starts_with('[') {
            header = format!("{line}\n");
        } else if let (Err(_), Err(error)) = (&whole, with_the_rest(&format!("{header}{line}"))) {
            return Err(error);
        }
    }
    Ok(())
}

/// `true` if a built-in scenario is valid with this part in place of its own.
fn with_the_rest(text: &str) -> Result<(), String> {
    // An AUV that repeats a track is the only one of its scenario.
    let [file, track] = TRACK;
    let base = if text.contains(file) { "cross-current" } else { "paper-intermittent" };
    let base = Scenario::text(base).expect("is built in");
    let mut scenario: Table = base.parse().expect("is TOML");
    // An offset along a path needs it.
    let knowledge = scenario.entry("knowledge").or_insert(Table::new().into());
    let knowledge = knowledge.as_table_mut().expect("is a table");
    knowledge.insert("paths".to_owned(), true.into());
    let part: Table = text.parse().map_err(|error| format!("{error}"))?;
    for (name, value) in part {
        match (scenario.entry(name), value) {
            (Entry::Occupied(known), toml::Value::Table(part)) if known.get().is_table() => {
                known.into_mut().as_table_mut().expect("was just asked").extend(part);
            }
            (Entry::Occupied(mut known), value) => drop(known.insert(value)),
            (Entry::Vacant(none), value) => drop(none.insert(value)),
        }
    }
    let text = toml::to_string(&scenario).expect("a table is TOML");
    let files = Files::kept(BTreeMap::from([(file.to_owned(), track.to_owned())]));
    let read = Scenario::parse(&text, "docs", files).and_then(Scenario::checked);
    read.map_or_else(|error| Err(error.to_string()), |_| Ok(()))
}
