//! Directions in degrees of requests, in the `OpenAPI` document. The planner's shapes have radians.

use serde_json::{Value, json};
use wire::{DIRECTION_DEG, DIRECTIONS};

use super::rules::{add_rule, objects};

/// Shapes of requests with a direction.
const SHAPES: [&str; 4] = ["Asc", "AuvState", "Report", "Offset"];

/// Adds degrees to every shape with a direction in radians. A required direction has one of both.
pub(super) fn write(document: &mut Value) {
    for (shape, [degrees, radians]) in SHAPES
        .iter()
        .flat_map(|shape| DIRECTIONS.map(|names| (shape, names)))
    {
        for schema in objects(document, shape) {
            if schema["properties"].get(radians).is_none() {
                continue;
            }
            schema["properties"][degrees] = json!({
                "type": ["number", "null"], "format": "double",
                "minimum": DIRECTION_DEG.start(), "maximum": DIRECTION_DEG.end(),
                "description": format!("Instead of `{radians}`: the same in degrees. The service stores radians."),
            });
            let required = schema["required"].as_array_mut();
            let at = required.and_then(|names| Some((names.iter().position(|name| name == radians)?, names)));
            if let Some((at, names)) = at {
                names.remove(at);
                let given = |name: &str, other: &str| {
                    json!({ "required": [name],
                        "properties": { name: { "type": "number" }, other: { "type": "null" } } })
                };
                add_rule(
                    schema,
                    json!({ "oneOf": [given(radians, degrees), given(degrees, radians)] }),
                );
            }
        }
    }
}
