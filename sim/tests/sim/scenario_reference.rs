//! The reference of every key in `docs/scenario-keys.md` is that of the schema.

use std::{fmt::Write as _, fs};

use pilotfish_sim::scenario::Scenario;
use serde_json::Value;

const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/scenario-keys.md");
const BEGIN: &str = "<!-- keys -->\n";
const END: &str = "<!-- /keys -->\n";
/// Set to anything, it writes the reference anew.
const UPDATE: &str = "UPDATE_DOCS";

/// A line of the reference.
#[derive(Debug)]
struct Row {
    key: String,
    /// Type, range and unit.
    value: String,
    default: String,
    meaning: String,
}

struct Reference {
    definitions: Value,
    rows: Vec<Row>,
}

/// Type, unit and range of a value.
#[derive(Default)]
struct Form {
    kind: String,
    unit: String,
    range: String,
}

impl Form {
    fn of(kind: impl Into<String>) -> Self {
        Self {
            kind: kind.into(),
            ..Self::default()
        }
    }

    /// A number is known by its range.
    fn value(&self) -> String {
        let range = format!("{} {}", self.range, self.unit).replace("6.283185307179586", "2π");
        match (&*self.kind, range.trim()) {
            (kind, "") => kind.to_owned(),
            ("number", range) => range.to_owned(),
            (kind, range) => format!("{kind}, {range}"),
        }
    }

    /// A description without the unit, which stands beside the range.
    fn without_unit(&self, meaning: &str) -> String {
        if self.unit.is_empty() {
            return meaning.to_owned();
        }
        [".", ",", ";", ":"].iter().fold(meaning.to_owned(), |text, end| {
            text.replace(&format!(", {}{end}", self.unit), end)
        })
    }
}

impl Reference {
    /// The properties of an object, each with what is inside it. `prefix` is empty or ends in a dot.
    fn object(&mut self, prefix: &str, object: &Value) {
        let required: Vec<&str> = match &object["required"] {
            Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
            _ => vec![],
        };
        for (name, value) in object["properties"].as_object().into_iter().flatten() {
            let needed = required.contains(&name.as_str());
            self.member(&format!("{prefix}{name}"), value, needed);
        }
    }

    fn member(&mut self, key: &str, value: &Value, required: bool) {
        let inside = self.resolved(value);
        let described = value["description"].as_str().or(inside["description"].as_str());
        let (meaning, stated) = split_default(described.unwrap_or_default());
        let default = match (required, stated, value.get("default")) {
            (true, _, _) => "required".to_owned(),
            (false, Some(stated), _) => stated,
            (false, None, Some(default)) => default.to_string(),
            (false, None, None) => String::new(),
        };
        let form = self.form(&inside);
        self.rows.push(Row {
            key: key.to_owned(),
            value: form.value(),
            default,
            meaning: form.without_unit(&meaning),
        });
        self.inside(key, &inside);
    }

    /// What an object, a choice of objects or a list of either holds.
    fn inside(&mut self, key: &str, value: &Value) {
        if value["properties"].is_object() {
            self.object(&format!("{key}."), value);
        }
        if is_number(value) {
            return;
        }
        for variant in value["oneOf"].as_array().into_iter().flatten() {
            for (name, table) in variant["properties"].as_object().into_iter().flatten() {
                let key = format!("{key}.{name}");
                let inside = self.resolved(table);
                let meaning = variant["description"]
                    .as_str()
                    .unwrap_or_default()
                    .replace('\n', " ");
                self.rows.push(Row {
                    key: key.clone(),
                    value: "table".to_owned(),
                    default: "one of these".to_owned(),
                    meaning,
                });
                self.inside(&key, &inside);
            }
        }
        if let Some(items) = value.get("items").filter(|_| !is_point(value)) {
            let items = self.resolved(items);
            self.inside(&format!("{key}[]"), &items);
        }
    }

    fn form(&self, value: &Value) -> Form {
        if is_number(value) {
            return number(value);
        }
        if is_point(value) {
            let each = number(&self.resolved(&value["items"]));
            return Form {
                kind: "[north, east]".to_owned(),
                ..each
            };
        }
        if let Some(choices) = value["oneOf"].as_array() {
            let name = |choice: &Value| match choice["const"].as_str() {
                Some(text) => format!("`\"{text}\"`"),
                None => format!("`{}`", choice["required"][0].as_str().expect("has one key")),
            };
            let names: Vec<String> = choices.iter().map(name).collect();
            return Form::of(names.join(", "));
        }
        match kind(value) {
            "object" if value["properties"].is_object() => Form::of("table"),
            "object" => {
                let each = self.form(&self.resolved(&value["additionalProperties"]));
                Form {
                    kind: format!("table of {}s by AUV", each.kind),
                    ..each
                }
            }
            "array" => {
                let each = self.form(&self.resolved(&value["items"]));
                Form {
                    kind: format!("list of {}{}", each.kind, counts(value)),
                    ..each
                }
            }
            "integer" => Form {
                kind: "whole number".to_owned(),
                unit: String::new(),
                range: match (value["minimum"].as_i64(), value["maximum"].as_i64()) {
                    (Some(least), Some(most)) => format!("{least} to {most}"),
                    _ => "0 and up".to_owned(),
                },
            },
            "boolean" => Form::of("`true`, `false`"),
            "string" => Form::of("text"),
            other => panic!("a form that the reference does not know: {other} in {value}"),
        }
    }

    /// A value without references and without the `null` of an optional one.
    fn resolved(&self, value: &Value) -> Value {
        if let Some(any) = value["anyOf"].as_array() {
            return self.resolved(&any[0]);
        }
        match value["$ref"].as_str() {
            Some(name) => {
                let name = name.strip_prefix("#/$defs/").expect("is a definition");
                self.resolved(&self.definitions[name])
            }
            None => value.clone(),
        }
    }
}

fn kind(value: &Value) -> &str {
    match &value["type"] {
        Value::Array(kinds) => kinds[0].as_str().expect("is a type"),
        kind => kind.as_str().unwrap_or("nothing"),
    }
}

/// A number that may be a distribution.
fn is_number(value: &Value) -> bool {
    value["oneOf"][0]["type"] == "number"
}

fn is_point(value: &Value) -> bool {
    value["items"]["$ref"] == "#/$defs/Coordinate"
}

/// Range and unit of a number, which its description names: `0 to 5 m/s; drawn anew …`.
fn number(value: &Value) -> Form {
    let described = value["description"].as_str().expect("is described");
    let (limits, _) = described.split_once(';').expect("has limits");
    let words: Vec<&str> = limits.split_whitespace().collect();
    Form {
        kind: "number".to_owned(),
        unit: words[3..].join(" "),
        range: words[..3].join(" "),
    }
}

fn counts(value: &Value) -> String {
    match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
        (None, None) => String::new(),
        (None | Some(0), Some(most)) => format!(", {most} at most"),
        (Some(least), Some(most)) => format!(", {least} to {most}"),
        (Some(least), None) => format!(", {least} at least"),
    }
}

/// A description without the part that says what a value is `if left out`, and that part.
fn split_default(described: &str) -> (String, Option<String>) {
    let described = described.replace('\n', " ");
    let Some((before, after)) = described.split_once(" if left out") else {
        return (described, None);
    };
    let begin = ["; ", ". "].iter().filter_map(|end| before.rfind(end)).max();
    let begin = begin.unwrap_or_else(|| panic!("the default begins a clause: {described}"));
    let (meaning, default) = before.split_at(begin);
    // What follows a comma is of the default, what follows a full stop of the meaning.
    let (more, rest) = match after.strip_prefix(',') {
        Some(more) => more
            .split_once('.')
            .map_or((more, ""), |(more, rest)| (more, rest)),
        None => ("", after.strip_prefix('.').unwrap_or(after)),
    };
    let default = default[2..].trim_end_matches(',').to_owned();
    let default = if more.is_empty() {
        default
    } else {
        format!("{default},{more}")
    };
    (format!("{meaning}.{rest}"), Some(default))
}

fn reference() -> (Vec<Row>, String) {
    let schema = Scenario::schema();
    let mut reference = Reference {
        definitions: schema["$defs"].clone(),
        rows: vec![],
    };
    reference.object("", &schema);
    let mut text = "| key | value | default | meaning |\n|---|---|---|---|\n".to_owned();
    for row in &reference.rows {
        let Row {
            key,
            value,
            default,
            meaning,
        } = row;
        writeln!(text, "| `{key}` | {value} | {default} | {meaning} |").expect("text");
    }
    (reference.rows, text)
}

#[test]
fn the_reference_of_keys_is_that_of_the_schema() {
    let (rows, reference) = reference();
    for row in &rows {
        assert!(!row.default.is_empty(), "{}: what is it if left out?", row.key);
        assert!(!row.meaning.is_empty(), "{}: what does it mean?", row.key);
    }
    let document = fs::read_to_string(DOCUMENT).expect("there");
    let (before, rest) = document.split_once(BEGIN).expect("has a reference");
    let (written, after) = rest.split_once(END).expect("has a reference");
    if std::env::var_os(UPDATE).is_some() {
        fs::write(DOCUMENT, format!("{before}{BEGIN}{reference}{END}{after}")).expect("written");
        return;
    }
    assert!(written == reference, "write it anew: just scenario-keys");
}

#[test]
fn every_key_of_the_built_in_scenarios_is_in_the_reference() {
    fn walk(prefix: &str, value: &toml::Value, found: &mut Vec<String>) {
        match value {
            toml::Value::Table(table) => {
                for (name, value) in table {
                    let key = if prefix.is_empty() {
                        name.clone()
                    } else {
                        format!("{prefix}.{name}")
                    };
                    found.push(key.clone());
                    walk(&key, value, found);
                }
            }
            toml::Value::Array(items) => {
                let inside = format!("{prefix}[]");
                for item in items {
                    walk(&inside, item, found);
                }
            }
            _ => {}
        }
    }
    let (rows, _) = reference();
    let known: Vec<&str> = rows.iter().map(|row| row.key.as_str()).collect();
    for name in Scenario::names() {
        let text = Scenario::text(name).expect("listed");
        let mut found = vec![];
        walk("", &toml::from_str(text).expect("is TOML"), &mut found);
        for key in found {
            // Distributions and names of vehicles are no keys of the format.
            let (table, last) = key.rsplit_once('.').unwrap_or(("", &key));
            let by_auv = |row: &&str| {
                table == *row
                    && [".slots_s", ".weights", ".serve_by_s"]
                        .iter()
                        .any(|end| row.ends_with(end))
            };
            let chosen = ["uniform", "normal", "choice"].contains(&last) || known.iter().any(by_auv);
            assert!(chosen || known.contains(&key.as_str()), "{name}: {key}");
        }
    }
}
