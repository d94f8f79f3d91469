//! JSON Schemas of the messages: of Foxglove's, the members written here, under their public names.
//!
//! Source: the JSON schemas in the public repository foxglove/foxglove-sdk. Members have one plain type each,
//! because the viewers take no other schema. Every member is required, but for the cells of a row.

use serde_json::{Map, Value, json};

use crate::table::{COLUMNS, Kind};

pub(super) fn frame_transforms() -> Value {
    let transform = object(
        "foxglove.FrameTransform",
        [
            ("timestamp", time()),
            ("parent_frame_id", string()),
            ("child_frame_id", string()),
            ("translation", vector3()),
            ("rotation", quaternion()),
        ],
    );
    object("foxglove.FrameTransforms", [("transforms", list(transform))])
}

pub(super) fn pose_in_frame() -> Value {
    object(
        "foxglove.PoseInFrame",
        [("timestamp", time()), ("frame_id", string()), ("pose", pose())],
    )
}

pub(super) fn location_fix() -> Value {
    const COVARIANCE_ENTRIES: usize = 9;
    let mut covariance = list(number());
    covariance["minItems"] = json!(COVARIANCE_ENTRIES);
    covariance["maxItems"] = json!(COVARIANCE_ENTRIES);
    object(
        "foxglove.LocationFix",
        [
            ("timestamp", time()),
            ("frame_id", string()),
            ("latitude", number()),
            ("longitude", number()),
            ("altitude", number()),
            ("position_covariance", covariance),
            ("position_covariance_type", integer()),
        ],
    )
}

pub(super) fn scene_update() -> Value {
    let entity = object(
        "foxglove.SceneEntity",
        [
            ("timestamp", time()),
            ("frame_id", string()),
            ("id", string()),
            ("lifetime", duration()),
            ("frame_locked", json!({"type": "boolean"})),
            ("metadata", unused("foxglove.KeyValuePair")),
            ("arrows", unused("foxglove.ArrowPrimitive")),
            ("cubes", unused("foxglove.CubePrimitive")),
            ("spheres", unused("foxglove.SpherePrimitive")),
            ("cylinders", unused("foxglove.CylinderPrimitive")),
            ("lines", list(line())),
            ("triangles", unused("foxglove.TriangleListPrimitive")),
            ("texts", unused("foxglove.TextPrimitive")),
            ("models", unused("foxglove.ModelPrimitive")),
        ],
    );
    object(
        "foxglove.SceneUpdate",
        [
            ("deletions", unused("foxglove.SceneEntityDeletion")),
            ("entities", list(entity)),
        ],
    )
}

/// A row of the table.
pub(super) fn row() -> Value {
    let members: Map<String, Value> = COLUMNS
        .iter()
        .map(|column| {
            let kind = match column.kind {
                Kind::Count => integer(),
                Kind::Number => number(),
                Kind::Word => string(),
            };
            (column.name.to_owned(), kind)
        })
        .collect();
    json!({"title": "pilotfish.Row", "type": "object", "properties": members, "required": ["kind", "t_s"]})
}

/// Any event of a mission: its members are those of its kind.
pub(super) fn event() -> Value {
    json!({
        "title": "pilotfish.Event",
        "type": "object",
        "properties": {"sequence": integer(), "kind": string()},
        "required": ["sequence", "kind"],
    })
}

fn line() -> Value {
    object(
        "foxglove.LinePrimitive",
        [
            ("type", integer()),
            ("pose", pose()),
            ("thickness", number()),
            ("scale_invariant", json!({"type": "boolean"})),
            ("points", list(numbers("foxglove.Point3", &["x", "y", "z"]))),
            ("color", color()),
            ("colors", list(color())),
            ("indices", list(integer())),
        ],
    )
}

fn pose() -> Value {
    object(
        "foxglove.Pose",
        [("position", vector3()), ("orientation", quaternion())],
    )
}

fn vector3() -> Value {
    numbers("foxglove.Vector3", &["x", "y", "z"])
}

fn quaternion() -> Value {
    numbers("foxglove.Quaternion", &["x", "y", "z", "w"])
}

fn color() -> Value {
    numbers("foxglove.Color", &["r", "g", "b", "a"])
}

fn time() -> Value {
    object("time", [("sec", integer()), ("nsec", integer())])
}

fn duration() -> Value {
    object("duration", [("sec", integer()), ("nsec", integer())])
}

fn numbers(title: &str, names: &[&'static str]) -> Value {
    object(title, names.iter().map(|name| (*name, number())))
}

/// A list that is always empty.
fn unused(title: &str) -> Value {
    list(object(title, []))
}

fn list(items: Value) -> Value {
    let mut list = json!({"type": "array"});
    list["items"] = items;
    list
}

fn object(title: &str, members: impl IntoIterator<Item = (&'static str, Value)>) -> Value {
    let (names, properties): (Vec<&str>, Map<String, Value>) = members
        .into_iter()
        .map(|(name, schema)| (name, (name.to_owned(), schema)))
        .unzip();
    json!({"title": title, "type": "object", "properties": properties, "required": names})
}

fn string() -> Value {
    json!({"type": "string"})
}

fn number() -> Value {
    json!({"type": "number"})
}

fn integer() -> Value {
    json!({"type": "integer"})
}
