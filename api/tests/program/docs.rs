//! Commands, fields, files and examples of the documentation work. Its figures: [`crate::figures`].

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;
use service::Settings;
use sim::scenario::{Files, Scenario};
use tests::{
    client::{get, send},
    server::Server,
};
use toml::{Table, map::Entry};

use crate::{
    command::{ask, has},
    markdown::{blocks, spans, table_rows, titles, without_blocks},
};

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
    let docs = fs::read_dir(root().join("docs")).expect("there is a folder of pages");
    let mut names: Vec<String> = [
        "README.md",
        "ARCHITECTURE.md",
        "examples/README.md",
        "api/python/README.md",
        "api/ros2/README.md",
    ]
    .map(str::to_owned)
    .into();
    names.extend(docs.filter_map(|entry| {
        let name = entry
            .expect("can be listed")
            .file_name()
            .into_string()
            .expect("is text");
        name.strip_suffix(".md").map(|_| format!("docs/{name}"))
    }));
    let page = |name: String| Page {
        text: fs::read_to_string(root().join(&name)).expect("the page is there"),
        name,
    };
    names.into_iter().map(page).collect()
}

/// Fails with all findings, each with its page.
#[track_caller]
pub(crate) fn none(found: &[(&Page, String)]) {
    let lines: Vec<_> = found
        .iter()
        .map(|(page, what)| format!("{}: {what}", page.name))
        .collect();
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
    let pages = pages();
    let mut found = vec![];
    for page in &pages {
        let text = without_blocks(&page.text);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let path = root().join(&page.name).with_file_name(file);
            let target = if file.is_empty() {
                root().join(&page.name)
            } else {
                path
            };
            if !target.exists() {
                found.push((page, format!("{link} is not there")));
            } else if !anchor.is_empty()
                && !titles(&fs::read_to_string(target).unwrap_or_default()).contains(anchor)
            {
                found.push((page, format!("{link} has no such title")));
            }
        }
    }
    none(&found);
}

#[test]
fn rows_of_a_table_have_the_columns_of_its_head() {
    let pages = pages();
    let mut found = vec![];
    for page in &pages {
        for rows in table_rows(&page.text) {
            for row in &rows {
                if row.n_cells != rows[0].n_cells {
                    found.push((
                        page,
                        format!("line {}: {} cells of {}", row.line, row.n_cells, rows[0].n_cells),
                    ));
                }
            }
        }
    }
    none(&found);
}

#[tokio::test]
async fn files_and_routes_and_names_in_backticks_exist() {
    let pages = pages();
    let files = tracked();
    let words = words_of_the_code(&files);
    let document = send(Settings::default(), get("/openapi.json")).await.json();
    let routes = document["paths"].as_object().expect("has paths");
    let routes: BTreeSet<String> = routes.keys().map(|route| without_names(route)).collect();
    let mut found = vec![];
    for page in &pages {
        for span in spans(&page.text) {
            for word in span.split_whitespace() {
                let beginning = word.split('/').next().unwrap_or_default();
                let is_file = word.contains('/')
                    && files.contains(&format!("{beginning}/"))
                    && word
                        .chars()
                        .all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c));
                let beside = page
                    .name
                    .rsplit_once('/')
                    .map(|(folder, _)| format!("{folder}/{word}"));
                if is_file && !files.contains(word) && beside.is_none_or(|file| !files.contains(&file)) {
                    found.push((page, format!("the file {word}")));
                }
            }
            let last = span.rsplit(' ').next().unwrap_or_default();
            let route = last.split(['?', '…']).next().unwrap_or_default();
            if route.starts_with("/v1/") && !routes.contains(&without_names(route)) {
                found.push((page, format!("the route {route}")));
            }
            let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            for part in span.split('.') {
                // The exporter of metrics adds these.
                let exported = part.strip_suffix("_total").or(part.strip_suffix("_info"));
                let known = |name: &str| words.contains(name) || OF_OTHERS.contains(&name);
                let is_known = known(part) || exported.is_some_and(known);
                if part.contains('_') && part.chars().all(is_name) && !is_known {
                    found.push((page, format!("the name {part}")));
                }
            }
        }
    }
    none(&found);
}

/// Names of other programs.
const OF_OTHERS: [&str; 3] = ["rmw_fastrtps_cpp", "sim_vehicle", "transient_local"];

/// A route whose parameters are all called the same.
fn without_names(route: &str) -> String {
    let part = |part: &str| {
        if part.starts_with('{') {
            "{}".to_owned()
        } else {
            part.to_owned()
        }
    };
    route.split('/').map(part).collect::<Vec<_>>().join("/")
}

/// Every word of the program, its tests and its clients, as written and as serde writes it.
fn words_of_the_code(files: &BTreeSet<String>) -> BTreeSet<String> {
    let is_code = |file: &&String| {
        let kind = file.rsplit('.').next().unwrap_or_default();
        matches!(
            kind,
            "rs" | "py" | "toml" | "json" | "js" | "mjs" | "xml" | "service"
        )
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
    let pages = pages();
    let folder = tempfile::tempdir().expect("there is room");
    let mut found = vec![];
    for page in &pages {
        let in_blocks = blocks(&page.text)
            .into_iter()
            .filter(|block| matches!(&*block.language, "bash" | "sh"));
        let in_text = spans(&page.text).into_iter().filter(|span| {
            ["pilotfish ", "cargo run --release --features full -- "]
                .iter()
                .any(|start| span.starts_with(start))
        });
        let mut script = SHELL.to_owned();
        for command in in_blocks.map(|block| block.text).chain(in_text) {
            script += "\n";
            script += &command;
        }
        let errors = folder.path().join("errors");
        fs::write(&errors, "").expect("can be written");
        let ran = Command::new("bash")
            .args(["-c", &script])
            .env("PROGRAM", env!("CARGO_BIN_EXE_pilotfish"))
            .env("FOUND", &errors)
            .current_dir(folder.path())
            .output();
        ran.expect("bash starts");
        let text = fs::read_to_string(&errors).expect("can be read");
        found.extend(
            text.lines()
                .filter(|line| !is_placeholder(line))
                .map(|line| (page, line.to_owned())),
        );
    }
    none(&found);
}

/// `true` if the program only objects to a placeholder of a value, such as `--days N`.
fn is_placeholder(error: &str) -> bool {
    let quoted = error.split('\'').nth(1).unwrap_or_default();
    let stands_for_one = quoted.chars().all(|c| c.is_ascii_uppercase() || "_…".contains(c));
    error.contains("a value is required for") || (error.contains("invalid value") && stands_for_one)
}

#[test]
fn json_examples_are_accepted() {
    let mut program = Command::new(env!("CARGO_BIN_EXE_pilotfish"));
    program.arg("serve");
    let server = Server::start(program);
    let words = words_of_the_code(&tracked());
    let pages = pages();
    let mut found = vec![];
    for page in &pages {
        for block in blocks(&page.text).iter().filter(|block| block.language == "json") {
            for value in serde_json::Deserializer::from_str(&block.text).into_iter::<Value>() {
                let value = match value {
                    Ok(value) => value,
                    Err(error) => {
                        found.push((page, format!("{error}: {}", block.text)));
                        continue;
                    }
                };
                let route = if value.get("asc").is_some() {
                    "/v1/plan"
                } else if value.get("live").is_some() {
                    "/v1/missions"
                } else if value.get("modem").is_some() {
                    let settings = serde_json::from_value(value);
                    let modem = settings.map(|settings| bridge::acoustics::Modem::new(&settings));
                    if !modem.is_ok_and(|modem| modem.is_ok()) {
                        found.push((page, format!("settings of a modem: {}", block.text)));
                    }
                    continue;
                } else {
                    let unknown = names(&value)
                        .into_iter()
                        .filter(|name| name.contains('_') && !words.contains(name));
                    found.extend(unknown.map(|name| (page, format!("the member {name}"))));
                    continue;
                };
                let answer = ask(&server, "POST", route, &value.to_string());
                if !answer.status.is_success() {
                    found.push((page, answer.text));
                }
            }
        }
    }
    none(&found);
}

/// The names of all members.
fn names(value: &Value) -> Vec<String> {
    match value {
        Value::Object(members) => members
            .iter()
            .flat_map(|(name, value)| [vec![name.clone()], names(value)].concat())
            .collect(),
        Value::Array(values) => values.iter().flat_map(names).collect(),
        _ => vec![],
    }
}

#[test]
fn python_examples_are_python() {
    if !has("python3") {
        return;
    }
    let pages = pages();
    let mut found = vec![];
    for page in &pages {
        for block in blocks(&page.text)
            .iter()
            .filter(|block| block.language == "python")
        {
            let parse = ["-c", "import ast, sys; ast.parse(sys.argv[1])", &block.text];
            let parsed = Command::new("python3").args(parse).output().expect("starts");
            if !parsed.status.success() {
                found.push((page, String::from_utf8_lossy(&parsed.stderr).into_owned()));
            }
        }
    }
    none(&found);
}

#[test]
fn toml_examples_are_accepted() {
    let pages = pages();
    let mut found = vec![];
    for page in &pages {
        for block in blocks(&page.text).iter().filter(|block| block.language == "toml") {
            // Members that an example omits cannot be checked.
            if block.text.contains('…') {
                continue;
            }
            let accepted = match block.text.parse::<Table>() {
                Err(error) => Err(error.to_string()),
                Ok(table) if table.contains_key("replicates") => campaign(&block.text),
                Ok(table) if table.contains_key("controllers") => {
                    campaign(&format!("{CAMPAIGN}{}", block.text))
                }
                Ok(_) => scenario(&block.text),
            };
            found.extend(
                accepted
                    .err()
                    .map(|error| (page, format!("{error}\n{}", block.text))),
            );
        }
    }
    none(&found);
}

/// The part of a campaign before its controllers.
const CAMPAIGN: &str = "schema_version = \"1\"\nname = \"own\"\ntitle = \"own\"\nseed = 1\nscenarios = [\"calm\"]\nreplicates = 2\n\n";

/// The recorded track that an example names.
const TRACK: [&str; 2] = ["dive-12.csv", "t,north,east\n0,0,0\n1,0.2,0\n"];

/// A complete campaign.
fn campaign(text: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("there is room");
    let file = folder.path().join("campaign.toml");
    fs::write(&file, text).expect("can be written");
    let program = Command::new(env!("CARGO_BIN_EXE_pilotfish"))
        .args(["campaign", "run", "--dry-run"])
        .arg(&file)
        .output()
        .expect("the program starts");
    if program.status.success() {
        return Ok(());
    }
    Err(String::from_utf8_lossy(&program.stderr).into_owned())
}

/// A part of a scenario, as a whole or line by line if the lines are alternatives.
fn scenario(text: &str) -> Result<(), String> {
    let whole = with_the_rest(text);
    let mut header = String::new();
    for line in text
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
    {
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
    let base = if text.contains(file) {
        "cross-current"
    } else {
        "paper-intermittent"
    };
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
                known
                    .into_mut()
                    .as_table_mut()
                    .expect("was just asked")
                    .extend(part);
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
