//! The reference of keys in `docs/scenario-keys.md` matches the schema.

use std::fs;

use pilotfish_sim::scenario::Scenario;
use serde_json::Value;

use self::form::{Form, counts, is_number, is_point, kind, list_of, number, split_default};
use self::page::text;

mod form;
mod page;

const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/scenario-keys.md");
const BEGIN: &str = "<!-- keys -->\n";
const END: &str = "<!-- /keys -->\n";
/// Documented as the planner's levers.
const LEVERS: &str = "surface_craft.tuning";
/// Documented as the planner's tuned numbers.
const NUMBERS: &str = "surface_craft.parameters";
/// Any value of this variable writes the reference anew.
const UPDATE: &str = "UPDATE_DOCS";

/// A key of the reference.
#[derive(Debug)]
struct Row {
    key: String,
    /// Type and range, without those that the key's name states.
    value: String,
    presence: Presence,
    meaning: String,
}

#[derive(Debug, PartialEq)]
enum Presence {
    Required,
    /// One of several tables.
    Variant,
    /// With its default.
    Optional(String),
}

struct Reference {
    definitions: Value,
    rows: Vec<Row>,
}

impl Reference {
    /// The properties of an object with their contents. `prefix` is empty or ends in a dot.
    fn object(&mut self, prefix: &str, object: &Value) {
        let required = object["required"].as_array().map_or(&[][..], Vec::as_slice);
        for (name, value) in object["properties"].as_object().into_iter().flatten() {
            let needed = required.iter().any(|required| required == name);
            self.member(&format!("{prefix}{name}"), value, needed);
        }
    }

    fn member(&mut self, key: &str, value: &Value, required: bool) {
        let inside = self.resolved(value);
        let described = value["description"].as_str().or(inside["description"].as_str());
        let (meaning, stated) = split_default(described.unwrap_or_default());
        let default = stated.or_else(|| value.get("default").map(Value::to_string));
        let presence =
            if required { Presence::Required } else { Presence::Optional(default.unwrap_or_default()) };
        let form = if key == NUMBERS { Form::default() } else { self.form(&inside) };
        self.rows.push(Row {
            key: key.to_owned(),
            value: form.value(),
            presence,
            meaning: form.without_unit(&meaning),
        });
        if key != LEVERS {
            self.inside(key, &inside);
        }
    }

    /// The contents of an object, a choice of objects or a list of either.
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
                let meaning = variant["description"].as_str().unwrap_or_default();
                self.rows.push(Row {
                    key: key.clone(),
                    value: String::new(),
                    presence: Presence::Variant,
                    meaning: meaning.replace('\n', " "),
                });
                self.inside(&key, &self.resolved(table));
            }
        }
        if let Some(items) = value.get("items").filter(|_| !is_point(value)) {
            self.inside(&format!("{key}[]"), &self.resolved(items));
        }
    }

    fn form(&self, value: &Value) -> Form {
        if is_number(value) {
            return number(value);
        }
        if is_point(value) {
            return number(&self.resolved(&value["items"])).called("[north, east]");
        }
        if let Some(choices) = value["oneOf"].as_array() {
            let words = choices.iter().filter_map(|choice| choice["const"].as_str());
            let mut names: Vec<String> = words.map(|text| format!("`\"{text}\"`")).collect();
            if names.len() < choices.len() {
                names.push("one of these".to_owned());
            }
            return Form::default().called(names.join(", "));
        }
        let each = |items: &Value| self.form(&self.resolved(items));
        match kind(value) {
            "object" if value["properties"].is_object() => Form::default(),
            "object" => each(&value["additionalProperties"]).called("by AUV"),
            "array" => {
                let each = each(&value["items"]);
                let kind = format!("list{}{}", list_of(&each.kind), counts(value));
                each.called(kind)
            }
            "integer" => {
                let mut form = Form::default().called("whole number");
                if let [Some(least), Some(most)] = ["minimum", "maximum"].map(|end| value[end].as_i64()) {
                    form.range = format!("{least} to {most}");
                }
                form
            }
            "boolean" => Form::default(),
            "string" => Form::default().called("text"),
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

fn reference() -> (Vec<Row>, String) {
    let schema = Scenario::schema();
    let (definitions, rows) = (schema["$defs"].clone(), vec![]);
    let mut reference = Reference { definitions, rows };
    reference.object("", &schema);
    let text = text(&reference.rows);
    (reference.rows, text)
}

#[test]
fn the_reference_of_keys_matches_the_schema() {
    let (rows, reference) = reference();
    for row in &rows {
        let unsaid = Presence::Optional(String::new());
        assert_ne!(row.presence, unsaid, "{}: what is it if left out?", row.key);
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
    fn walk(key: &str, value: &toml::Value, found: &mut Vec<String>) {
        match value {
            toml::Value::Table(table) => {
                for (name, value) in table {
                    let dot = if key.is_empty() { "" } else { "." };
                    found.push(format!("{key}{dot}{name}"));
                    walk(&format!("{key}{dot}{name}"), value, found);
                }
            }
            toml::Value::Array(items) => {
                for item in items {
                    walk(&format!("{key}[]"), item, found);
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
            // Distributions and names of vehicles are not keys of the format.
            let (table, last) = key.rsplit_once('.').unwrap_or(("", &key));
            let is_by_auv = [".slots_s", ".weights", ".serve_by_s"].iter().any(|end| table.ends_with(end));
            let chosen = ["uniform", "normal", "choice"].contains(&last);
            let is_known = known.contains(&key.as_str()) || (is_by_auv && known.contains(&table));
            assert!(chosen || is_known, "{name}: {key}");
        }
    }
}
