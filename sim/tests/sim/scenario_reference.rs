//! The reference of keys in `docs/scenario-keys.md` matches the schema.

use std::{collections::BTreeMap, fs};

use pilotfish_sim::scenario::Scenario;
use serde_json::Value;

const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/scenario-keys.md");
const BEGIN: &str = "<!-- keys -->\n";
const END: &str = "<!-- /keys -->\n";
/// Documented as the planner's levers, and as its tuned numbers.
const ELSEWHERE: [&str; 3] = ["surface_craft.craft", "surface_craft.tuning", "surface_craft.parameters"];
/// Ranges of places, lengths and angles, which the page states once.
const USUAL: [&str; 3] = ["-100000 to 100000", "0.01 to 100000", "-6.283185307179586 to 6.283185307179586"];
/// Any value of this variable writes the reference anew.
const UPDATE: &str = "UPDATE_DOCS";

struct Reference {
    definitions: Value,
    /// The lines of each table.
    tables: BTreeMap<String, String>,
}

impl Reference {
    fn add(&mut self, key: &str, details: &[String], meaning: &str) {
        assert!(!meaning.is_empty(), "{key}: what does it mean?");
        let (table, name) = key.split_once('.').unwrap_or(("", key));
        let details: Vec<&str> =
            details.iter().map(String::as_str).filter(|detail| !detail.is_empty()).collect();
        let details = if details.is_empty() { String::new() } else { format!(" ({})", details.join("; ")) };
        let line = format!("- `{name}`{details}: {}\n", meaning.replace('\n', " "));
        *self.tables.entry(table.to_owned()).or_default() += &line;
    }

    /// The properties of an object with their contents. `prefix` is empty or ends in a dot.
    fn object(&mut self, prefix: &str, object: &Value) {
        for (name, value) in object["properties"].as_object().into_iter().flatten() {
            let key = format!("{prefix}{name}");
            let required =
                object["required"].as_array().is_some_and(|required| required.contains(&name[..].into()));
            let inside = self.resolved(value);
            let meaning = value["description"].as_str().or(inside["description"].as_str());
            let meaning = &meaning.unwrap_or_default().replace('\n', " ");
            let is_said = required || meaning.contains("left out");
            let default = value.get("default").filter(|_| !is_said).map(|value| format!("default: {value}"));
            assert!(is_said || default.is_some(), "{key}: what is it if left out?");
            let is_here = !ELSEWHERE.contains(&&*key);
            let form = if is_here { self.form(&inside) } else { String::new() };
            self.add(&key, &[form, default.unwrap_or_default()], meaning);
            if is_here {
                self.inside(&key, &inside);
            }
        }
    }

    /// The contents of an object, a choice of objects or a list of either.
    fn inside(&mut self, key: &str, value: &Value) {
        self.object(&format!("{key}."), value);
        if is_number(value) {
            return;
        }
        for variant in value["oneOf"].as_array().into_iter().flatten() {
            for (name, table) in variant["properties"].as_object().into_iter().flatten() {
                let key = format!("{key}.{name}");
                self.add(&key, &[], variant["description"].as_str().unwrap_or_default());
                self.inside(&key, &self.resolved(table));
            }
        }
        if let Some(items) = value.get("items").filter(|_| !is_point(value)) {
            self.inside(&format!("{key}[]"), &self.resolved(items));
        }
    }

    /// Type and range of a value, without those that the key's name states.
    fn form(&self, value: &Value) -> String {
        if is_number(value) {
            // `0 to 5 m/s; drawn anew …`.
            let words = value["description"].as_str().expect("is described").split_whitespace();
            let range = words.take(3).collect::<Vec<_>>().join(" ");
            let range = range.trim_end_matches(';');
            return if USUAL.contains(&range) { "" } else { range }.replace("3.141592653589793", "π");
        }
        if is_point(value) {
            return "[north, east]".to_owned();
        }
        if let Some(choices) = value["oneOf"].as_array() {
            let words = choices.iter().filter_map(|choice| choice["const"].as_str());
            let mut names: Vec<String> = words.map(|text| format!("`\"{text}\"`")).collect();
            if names.len() < choices.len() {
                names.push("one of these".to_owned());
            }
            return names.join(", ");
        }
        let each = |items: &Value| self.form(&self.resolved(items));
        let ends = |names: [&str; 2]| match names.map(|name| value[name].as_i64()) {
            [Some(least), Some(most)] => format!(", {least} to {most}"),
            [Some(least), None] => format!(", {least} at least"),
            [None, Some(most)] => format!(", {most} at most"),
            [None, None] => String::new(),
        };
        let kind = value["type"].as_array().map_or(&value["type"], |kinds| &kinds[0]);
        match kind.as_str().unwrap_or("nothing") {
            "object" if value["properties"].is_object() => String::new(),
            "object" => format!("by AUV, {}", each(&value["additionalProperties"])),
            "array" => match &*each(&value["items"]) {
                "" | "one of these" => format!("list{}", ends(["minItems", "maxItems"])),
                kind => format!("list of {kind}{}", ends(["minItems", "maxItems"])),
            },
            "integer" => format!("whole number{}", ends(["minimum", "maximum"])),
            "boolean" => String::new(),
            "string" => "text".to_owned(),
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

/// A number that may be a distribution.
fn is_number(value: &Value) -> bool {
    value["oneOf"][0]["type"] == "number"
}

fn is_point(value: &Value) -> bool {
    value["items"]["$ref"] == "#/$defs/Coordinate"
}

#[test]
fn the_reference_of_keys_matches_the_schema() {
    let schema = Scenario::schema();
    let mut reference = Reference { definitions: schema["$defs"].clone(), tables: BTreeMap::new() };
    reference.object("", &schema);
    let tables = reference.tables.into_iter().map(|(name, lines)| {
        let title = if name.is_empty() { String::new() } else { format!("\n## `{name}`\n\n") };
        title + &lines
    });
    let reference: String = tables.collect();
    let document = fs::read_to_string(DOCUMENT).expect("there");
    let (before, rest) = document.split_once(BEGIN).expect("has a reference");
    let (written, after) = rest.split_once(END).expect("has a reference");
    if std::env::var_os(UPDATE).is_some() {
        fs::write(DOCUMENT, format!("{before}{BEGIN}{reference}{END}{after}")).expect("written");
        return;
    }
    assert!(written == reference, "write it anew: just scenario-keys");
}
