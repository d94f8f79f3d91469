//! Answers of a service, for tests.

use serde_json::{Value, json};

/// Answer of `…/reference` with the plan of event `sequence`: to the north at 20 m/s.
pub(crate) fn planned(sequence: u64) -> Value {
    let mut answer: Value = serde_json::from_str(include_str!("tests/reference.json")).expect("is JSON");
    answer["sequence"] = sequence.into();
    answer
}

/// A running mission.
pub(crate) fn mission(id: &str) -> Value {
    json!({ "id": id, "title": id, "kind": "live", "status": "running", "created_s": 0.0, "t_s": 0.0, "sequence": 1 })
}
