//! The shape of a campaign file in the `OpenAPI` document: the laboratory's own JSON Schema, with its parts beside the other shapes.

use lab::campaign::CampaignFile;
use serde_json::{Map, Value, json};

use crate::campaigns::limits;

/// How names of its parts begin.
const PREFIX: &str = "Campaign";
/// The name of the whole.
const WHOLE: &str = "NewCampaign";
/// Where the parts of a schema stand.
const PARTS: &str = "#/$defs/";

/// Writes it into `document`.
pub(super) fn write(document: &mut Value) {
    let mut whole = CampaignFile::schema();
    refer(&mut whole);
    let members = whole.as_object_mut();
    let parts = members.and_then(|members| {
        members.remove("$schema");
        members.remove("title");
        members.remove("$defs")
    });
    let schemas = &mut document["components"]["schemas"];
    let parts: Map<String, Value> = parts
        .and_then(|parts| parts.as_object().cloned())
        .unwrap_or_default();
    for (name, part) in parts {
        schemas[named(&name)] = part;
    }
    schemas[WHOLE] = whole;
    for (place, words) in limits::words() {
        let schema = schemas.pointer_mut(place).and_then(Value::as_object_mut);
        let schema = schema.expect("is in the document");
        schema.extend(words.as_object().cloned().unwrap_or_default());
    }
    let body = &mut document["paths"]["/v1/campaigns"]["post"]["requestBody"];
    body["content"]["application/json"]["schema"] =
        json!({ "$ref": format!("#/components/schemas/{WHOLE}") });
}

/// The name of a part among the other shapes.
fn named(part: &str) -> String {
    format!(
        "{PREFIX}{}",
        part.trim_end_matches("File").trim_end_matches("Entry")
    )
}

/// Has references to parts lead to where they stand.
fn refer(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(refer),
        Value::Object(members) => {
            if let Some(Value::String(place)) = members.get_mut("$ref")
                && let Some(part) = place.strip_prefix(PARTS)
            {
                *place = format!("#/components/schemas/{}", named(part));
            }
            members.values_mut().for_each(refer);
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}
