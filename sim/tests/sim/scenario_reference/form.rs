//! The form of a value in a schema.

use serde_json::Value;

/// Ranges of places, lengths and angles, which the page states once.
const USUAL: [&str; 3] = ["-100000 to 100000", "0.01 to 100000", "-6.283185307179586 to 6.283185307179586"];

/// Type, unit and range of a value.
#[derive(Default)]
pub(super) struct Form {
    pub(super) kind: String,
    pub(super) unit: String,
    pub(super) range: String,
}

impl Form {
    /// The form with another kind.
    pub(super) fn called(self, kind: impl Into<String>) -> Self {
        Self { kind: kind.into(), ..self }
    }

    /// Range of a number, whose name has the unit; else kind and range.
    pub(super) fn value(&self) -> String {
        let range = if USUAL.contains(&&*self.range) {
            String::new()
        } else {
            self.range.replace("3.141592653589793", "π")
        };
        match (&*self.kind, &*range) {
            ("number", range) => range.to_owned(),
            (kind, "") => kind.to_owned(),
            (kind, range) => format!("{kind}, {range}"),
        }
    }

    /// A description without the unit, which stands in the key.
    pub(super) fn without_unit(&self, meaning: &str) -> String {
        if self.unit.is_empty() {
            return meaning.to_owned();
        }
        [".", ",", ";", ":"]
            .iter()
            .fold(meaning.to_owned(), |text, end| text.replace(&format!(", {}{end}", self.unit), end))
    }
}

pub(super) fn kind(value: &Value) -> &str {
    match &value["type"] {
        Value::Array(kinds) => kinds[0].as_str().expect("is a type"),
        kind => kind.as_str().unwrap_or("nothing"),
    }
}

/// A number that may be a distribution.
pub(super) fn is_number(value: &Value) -> bool {
    value["oneOf"][0]["type"] == "number"
}

pub(super) fn is_point(value: &Value) -> bool {
    value["items"]["$ref"] == "#/$defs/Coordinate"
}

/// Range and unit of a number by its description: `0 to 5 m/s; drawn anew …`.
pub(super) fn number(value: &Value) -> Form {
    let described = value["description"].as_str().expect("is described");
    let (limits, _) = described.split_once(';').expect("has limits");
    let words: Vec<&str> = limits.split_whitespace().collect();
    Form { kind: "number".to_owned(), unit: words[3..].join(" "), range: words[..3].join(" ") }
}

/// The kind of a list's items, unless they are listed below it.
pub(super) fn list_of(kind: &str) -> String {
    match kind {
        "" | "one of these" => String::new(),
        kind => format!(" of {kind}"),
    }
}

pub(super) fn counts(value: &Value) -> String {
    match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
        (None, None) => String::new(),
        (None | Some(0), Some(most)) => format!(", {most} at most"),
        (Some(least), Some(most)) => format!(", {least} to {most}"),
        (Some(least), None) => format!(", {least} at least"),
    }
}

/// A description without its part `if left out`, and the default in that part.
pub(super) fn split_default(described: &str) -> (String, Option<String>) {
    let described = described.replace('\n', " ");
    let Some((before, after)) = described.split_once(" if left out") else {
        return (described, None);
    };
    let begin = ["; ", ". "].iter().filter_map(|end| before.rfind(end)).max();
    let begin = begin.unwrap_or_else(|| panic!("the default begins a clause: {described}"));
    let (meaning, default) = before.split_at(begin);
    let default = default[2..].trim_end_matches(',');
    // Text after a comma belongs to the default, text after a full stop to the meaning.
    let (default, rest) = match after.strip_prefix(',') {
        Some(more) => {
            let (more, rest) = more.split_once('.').unwrap_or((more, ""));
            (format!("{default},{more}"), rest)
        }
        None => (default.to_owned(), after.strip_prefix('.').unwrap_or(after)),
    };
    (format!("{meaning}.{rest}"), Some(default))
}
