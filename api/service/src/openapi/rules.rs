//! Rules between members and items in the `OpenAPI` document, which no single member states.
//!
//! They are written as `allOf`, which generators of clients skip if they do not know it. Null and
//! absent are equal for optional members.

use planner::craft::PRESETS;
use serde_json::{Map, Value, json};
use wire::{LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG, SCHEMA_VERSION};

/// Shapes with a position, in metres or on Earth.
const POSITIONS: [&str; 4] = ["Asc", "AuvState", "Report", "KeepOut"];

/// Shapes of several kinds, each closed, and the member that names the kind.
const KINDS: [(&str, &str); 4] = [
    ("Goal", "kind"),
    ("Offset", "frame"),
    ("VisitCost", "kind"),
    ("Segment", "kind"),
];

/// Gives each kind a closed schema of its own, to which the discriminator of its shape leads. Any goal
/// may have an offset.
pub(super) fn name_kinds(document: &mut Value) {
    let schemas = &mut document["components"]["schemas"];
    let visits = schemas
        .as_object_mut()
        .and_then(|schemas| schemas.remove("Visits"));
    let visits = visits.expect("is the shape of a kind of goal");
    let offset = json!({ "oneOf": [{ "$ref": reference("Offset") }, { "type": "null" }],
        "description": "Desired position relative to the followed point. Default: right above it." });
    for (shape, tag) in KINDS {
        let kinds = schemas[shape]["oneOf"].take();
        let mut mapping = Map::new();
        for mut kind in kinds.as_array().cloned().into_iter().flatten() {
            if let Some(parts) = kind.get("allOf").cloned() {
                kind = visits.clone();
                kind["properties"][tag] = parts[1]["properties"][tag].clone();
                let required = kind["required"].as_array_mut();
                required.expect("AUVs are").push(json!(tag));
            }
            kind["additionalProperties"] = json!(false);
            if shape == "Goal" {
                kind["properties"]["offset"] = offset.clone();
            }
            let value = kind["properties"][tag]["enum"][0].as_str().unwrap_or_default();
            let name: String = [shape]
                .into_iter()
                .chain(value.split('_'))
                .map(capitalised)
                .collect();
            mapping.insert(value.to_owned(), json!(reference(&name)));
            schemas[name] = kind;
        }
        let references: Vec<_> = mapping.values().map(|name| json!({ "$ref": name })).collect();
        schemas[shape]["oneOf"] = json!(references);
        schemas[shape]["discriminator"] = json!({ "propertyName": tag, "mapping": mapping });
    }
}

fn reference(name: &str) -> String {
    format!("#/components/schemas/{name}")
}

fn capitalised(word: &str) -> String {
    let (first, rest) = word.split_at(1);
    first.to_uppercase() + rest
}

/// The schemas at a place: `Shape`, or `Shape.member` with what follows, in each kind that has it.
pub(super) fn at<'a>(document: &'a mut Value, place: &str) -> Vec<&'a mut Value> {
    let (shape, member) = place.split_once('.').unwrap_or((place, ""));
    if member.is_empty() {
        return vec![&mut document["components"]["schemas"][shape]];
    }
    let pointer = format!("/properties/{member}");
    let objects = objects(document, shape);
    let found: Vec<_> = objects
        .filter_map(|object| object.pointer_mut(&pointer))
        .collect();
    assert!(!found.is_empty(), "{place} is in the document");
    found
}

/// The schema of a shape, or those of its kinds.
pub(super) fn objects<'a>(document: &'a mut Value, shape: &str) -> impl Iterator<Item = &'a mut Value> {
    let schemas = &mut document["components"]["schemas"];
    let kinds = schemas[shape].get("oneOf").cloned();
    let is_of = move |name: &str| match &kinds {
        Some(kinds) => kinds
            .as_array()
            .is_some_and(|kinds| kinds.contains(&json!({ "$ref": reference(name) }))),
        None => name == shape,
    };
    let schemas = schemas.as_object_mut().into_iter().flatten();
    schemas.filter_map(move |(name, schema)| is_of(name).then_some(schema))
}

/// Writes every rule into `document`, after limits and directions in degrees.
pub(super) fn write(document: &mut Value) {
    for (place, mut words) in words() {
        let words = words.as_object_mut().expect("are an object");
        for schema in at(document, place) {
            let schema = schema.as_object_mut().expect("is a schema");
            schema.append(&mut words.clone());
        }
    }
    for place in ["PlanRequest.area/items", "Setting.area/items", "Live.area/items"]
        .iter()
        .chain(&POINTS)
    {
        for point in at(document, place) {
            or_on_earth(point);
        }
    }
    let schemas = &mut document["components"]["schemas"];
    for (shape, variants) in one_of() {
        let schema = &mut schemas[shape];
        let rule: Vec<Value> = variants
            .iter()
            .map(|given| rule(given, variants, schema))
            .collect();
        add_rule(schema, json!({ "oneOf": rule }));
    }
    schemas["Reports"]["allOf"] = json!([{ "anyOf": [
        { "required": ["auvs"], "properties": { "auvs": { "minProperties": 1 } } },
        { "required": ["asc"], "properties": { "asc": { "minItems": 1 } } },
        { "required": ["notes"], "properties": { "notes": { "minItems": 1 } } },
        { "required": ["steering"], "properties": { "steering": { "minItems": 1 } } },
    ] }]);
    let corners = schemas["PlanRequest"]["properties"]["area"]["items"].clone();
    for shape in ["PlanRequest", "Live"] {
        let area = &mut schemas[shape]["properties"]["area"];
        area["items"] = corners.clone();
        // An empty list is no limit.
        area["allOf"] = json!([{ "anyOf": [{ "maxItems": 0 }, { "minItems": area["minItems"] }] }]);
        area["minItems"] = json!(0);
    }
    for shape in POSITIONS {
        write_position(&mut schemas[shape]);
    }
    for shape in POSITIONS.iter().chain(&["Origin"]) {
        for (name, most) in [("lat_deg", LATITUDE_MAX_DEG), ("lon_deg", LONGITUDE_MAX_DEG)] {
            let degrees = &mut schemas[shape]["properties"][name];
            degrees["minimum"] = json!(-most);
            degrees["maximum"] = json!(most);
        }
    }
    unsigned(document);
}

/// Points of segments, which may be positions on Earth.
const POINTS: [&str; 4] = [
    "Segment.from",
    "Segment.to",
    "Segment.centre",
    "Segment.points/items",
];

/// Requires either pair of coordinates. Stored bodies may have both.
fn write_position(schema: &mut Value) {
    let pairs = [["north_m", "east_m"], ["lat_deg", "lon_deg"]];
    if let Some(required) = schema["required"].as_array_mut() {
        required.retain(|name| !pairs[0].iter().any(|metres| name == metres));
    }
    add_rule(
        schema,
        json!({ "anyOf": pairs.map(|pair| json!({ "required": pair })) }),
    );
}

/// Adds `rule` to those of a schema.
pub(super) fn add_rule(schema: &mut Value, rule: Value) {
    match schema["allOf"].as_array_mut() {
        Some(rules) => rules.push(rule),
        None => schema["allOf"] = json!([rule]),
    }
}

/// A point of that schema, or a position on Earth.
fn or_on_earth(point: &mut Value) {
    let metres = point.take();
    *point = json!({ "anyOf": [metres, { "$ref": reference("Origin") }] });
}

/// The rule that these members are given and those of other variants are not.
fn rule(given: &[&str], all: &[&[&str]], schema: &Value) -> Value {
    let is_given = |name: &&&str| given.contains(name);
    let kinds = given
        .iter()
        .map(|name| (*name, kind(&schema["properties"][name]["type"])));
    let others = all.iter().copied().flatten().filter(|name| !is_given(name));
    let properties: Map<_, _> = kinds
        .chain(others.map(|name| (*name, json!("null"))))
        .map(|(name, kind)| (name.to_owned(), json!({ "type": kind })))
        .collect();
    let mut rule = json!({ "properties": properties });
    if !given.is_empty() {
        rule["required"] = json!(given);
    }
    rule
}

/// The type of a schema that is not null.
pub(super) fn kind(kinds: &Value) -> Value {
    match kinds {
        Value::Array(kinds) => kinds
            .iter()
            .find(|kind| *kind != "null")
            .cloned()
            .unwrap_or_default(),
        // It is of a shape with a name.
        Value::Null => json!("object"),
        only => only.clone(),
    }
}

/// Shapes with groups of members, of which exactly one is given.
fn one_of() -> [(&'static str, &'static [&'static [&'static str]]); 6] {
    [
        ("Auv", &[&["state"], &["reports"]]),
        ("NewMission", &[&["live"], &["simulated"]]),
        ("Simulated", &[&["scenario"], &["scenario_file"]]),
        ("Asc", &[&["ground_north_mps", "ground_east_mps"], &[]]),
        (
            "Report",
            &[&["course_rad", "speed_mps"], &["course_deg", "speed_mps"], &[]],
        ),
        (
            "HeadingLoop",
            &[&["time_constant_s"], &["natural_frequency_radps", "damping"], &[]],
        ),
    ]
}

/// Lengths and patterns, by the place of their schema.
fn words() -> Vec<(&'static str, Value)> {
    let exactly = |n: usize| json!({ "minItems": n, "maxItems": n });
    // Names have no control characters, Unicode's general category Cc.
    let name = json!({ "pattern": "^[^\\u0000-\\u001f\\u007f-\\u009f]*$" });
    let presets: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
    let preset = format!("^({})$", presets.join("|"));
    let version = json!({ "const": SCHEMA_VERSION });
    vec![
        ("PlanRequest.schema_version", version.clone()),
        ("NewMission.schema_version", version),
        ("Auv.id", name.clone()),
        ("LiveAuv.id", name),
        ("LiveAuv.id", json!({ "not": { "const": "asc" } })),
        ("Goal.auvs", json!({ "uniqueItems": true })),
        ("Craft.preset", json!({ "pattern": preset })),
        ("PlanRequest.area/items", exactly(2)),
        (POINTS[0], exactly(2)),
        (POINTS[1], exactly(2)),
        (POINTS[2], exactly(2)),
        (POINTS[3], exactly(2)),
        ("Segment.points", json!({ "minItems": 2 })),
        ("AuvState.covariance", exactly(4)),
        ("AuvState.covariance/items", exactly(4)),
        ("Batch", json!({ "additionalProperties": false })),
        (
            "SurgeLoop",
            json!({ "allOf": [{ "anyOf": [
                { "properties": { "integrates": { "enum": [false, null] }, "integral_time_s": { "type": "null" } } },
                { "required": ["integral_time_s"], "properties": {
                    "integrates": { "enum": [true, null] }, "integral_time_s": { "type": "number" } } },
            ] }] }),
        ),
    ]
}

/// Removes the sign of unsigned numbers of 64 bits, which utoipa describes as signed.
fn unsigned(value: &mut Value) {
    if value.get("format").is_some_and(|format| format == "int64")
        && value.get("minimum").is_some_and(|least| *least == 0)
    {
        value["format"] = json!("uint64");
        value["maximum"] = json!(u64::MAX);
    }
    match value {
        Value::Array(items) => items.iter_mut().for_each(unsigned),
        Value::Object(members) => members.values_mut().for_each(unsigned),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}
