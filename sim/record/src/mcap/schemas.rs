//! JSON Schemas of the messages; of Foxglove's, the members written here under their public names.
//!
//! Source: JSON schemas of the public repository foxglove/foxglove-sdk. Viewers accept only one
//! plain type a member. Every member is required, except for a row's cells.

use serde_json::{Map, Value, json};

use crate::table::{COLUMNS, Column, Kind};

/// Foxglove's types and their members, each a name and a type; `[]` marks a list. Types that are
/// not here have no members: their lists are always empty.
const TYPES: [(&str, &str); 14] = [
    ("time", "sec integer, nsec integer"),
    ("duration", "sec integer, nsec integer"),
    ("Point3", "x number, y number, z number"),
    ("Vector3", "x number, y number, z number"),
    ("Quaternion", "x number, y number, z number, w number"),
    ("Color", "r number, g number, b number, a number"),
    ("Pose", "position Vector3, orientation Quaternion"),
    ("PoseInFrame", "timestamp time, frame_id string, pose Pose"),
    ("FrameTransforms", "transforms FrameTransform[]"),
    (
        "FrameTransform",
        "timestamp time, parent_frame_id string, child_frame_id string, translation Vector3, rotation Quaternion",
    ),
    (
        "LocationFix",
        "timestamp time, frame_id string, latitude number, longitude number, altitude number, \
         position_covariance number[], position_covariance_type integer",
    ),
    (
        "LinePrimitive",
        "type integer, pose Pose, thickness number, scale_invariant boolean, points Point3[], color Color, \
         colors Color[], indices integer[]",
    ),
    (
        "SceneEntity",
        "timestamp time, frame_id string, id string, lifetime duration, frame_locked boolean, \
         metadata KeyValuePair[], arrows ArrowPrimitive[], cubes CubePrimitive[], spheres SpherePrimitive[], \
         cylinders CylinderPrimitive[], lines LinePrimitive[], triangles TriangleListPrimitive[], \
         texts TextPrimitive[], models ModelPrimitive[]",
    ),
    ("SceneUpdate", "deletions SceneEntityDeletion[], entities SceneEntity[]"),
];

pub(super) const ROW: &str = "pilotfish.Row";
/// The type of any event of a mission: its members are those of its kind.
pub(super) const EVENT: &str = "pilotfish.Event";

/// The schema of a type: a plain one, a list, one of Foxglove's, [`ROW`] or [`EVENT`].
pub(super) fn of(name: &str) -> Value {
    if name == ROW {
        let members: Map<String, Value> = COLUMNS.iter().map(cell).collect();
        return json!({"title": ROW, "type": "object", "properties": members, "required": ["kind", "t_s"]});
    }
    if name == EVENT {
        let members = json!({"sequence": of("integer"), "kind": of("string")});
        return json!({"title": EVENT, "type": "object", "properties": members, "required": ["sequence", "kind"]});
    }
    if let Some(items) = name.strip_suffix("[]") {
        return json!({"type": "array", "items": of(items)});
    }
    if ["integer", "number", "string", "boolean"].contains(&name) {
        return json!({"type": name});
    }
    let known = TYPES.iter().find(|(known, _)| *known == name);
    let members = known.into_iter().flat_map(|(_, members)| members.split(", "));
    let (names, mut properties): (Vec<&str>, Map<String, Value>) = members
        .filter_map(|member| member.split_once(' '))
        .map(|(name, kind)| (name, (name.to_owned(), of(kind))))
        .unzip();
    if let Some(covariance) = properties.get_mut("position_covariance") {
        (covariance["minItems"], covariance["maxItems"]) = (json!(9), json!(9));
    }
    let is_foxglove = name.starts_with(char::is_uppercase);
    let title = if is_foxglove { format!("foxglove.{name}") } else { name.to_owned() };
    json!({"title": title, "type": "object", "properties": properties, "required": names})
}

fn cell(column: &Column) -> (String, Value) {
    let kind = match column.kind {
        Kind::Count => "integer",
        Kind::Number => "number",
        Kind::Word => "string",
    };
    (column.name.to_owned(), of(kind))
}
