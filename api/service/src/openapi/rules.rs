//! Rules between members and items in the `OpenAPI` document, which no single member states.
//!
//! They are written as `allOf`, which generators of clients skip if they do not know it. Null and
//! absent are equal for optional members.

use serde_json::{Map, Value, json};
use wire::{DIRECTION_DEG, DIRECTIONS, LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG};

/// Shapes with a position, in metres or on Earth.
const POSITIONS: [&str; 5] = ["Asc", "AuvState", "Report", "KeepOut", "Vessel"];

/// Shapes of requests with a direction.
const DIRECTED: [&str; 5] = ["Asc", "AuvState", "Report", "Offset", "Vessel"];

/// Shapes of several kinds, each closed, and the member that names the kind.
const KINDS: [(&str, &str); 4] =
    [("Goal", "kind"), ("Offset", "frame"), ("VisitCost", "kind"), ("Segment", "kind")];

/// Gives each kind a closed schema of its own, to which the discriminator of its shape leads. Any
/// goal but one that localises may have an offset.
pub(super) fn name_kinds(document: &mut Value) {
    let schemas = &mut document["components"]["schemas"];
    let named = schemas.as_object_mut().expect("are by name");
    // Kinds of goals with a shape of their own.
    let shapes = ["Visits", "Localise"].map(|name| (reference(name), named.remove(name)));
    let offset = json!({ "oneOf": [{ "$ref": reference("Offset") }, { "type": "null" }],
        "description": "Desired position relative to the followed point. Default: right above it." });
    for (shape, tag) in KINDS {
        let kinds = schemas[shape]["oneOf"].take();
        let mut mapping = Map::new();
        for mut kind in kinds.as_array().cloned().into_iter().flatten() {
            if let Some(parts) = kind.get("allOf").cloned() {
                let of_it = shapes.iter().find(|(name, _)| parts[0]["$ref"] == **name);
                kind = of_it.and_then(|(_, shape)| shape.clone()).expect("is a shape of a kind of goal");
                kind["properties"][tag] = parts[1]["properties"][tag].clone();
                let required = kind["required"].as_array_mut();
                required.expect("AUVs are").push(json!(tag));
            }
            kind["additionalProperties"] = json!(false);
            let value = kind["properties"][tag]["enum"][0].as_str().unwrap_or_default().to_owned();
            // The planner chooses the craft's place on a figure.
            if shape == "Goal" && value != "localise" {
                kind["properties"]["offset"] = offset.clone();
            }
            let name: String = [shape].into_iter().chain(value.split('_')).map(capitalised).collect();
            mapping.insert(value, json!(reference(&name)));
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
    let found: Vec<_> = objects.filter_map(|object| object.pointer_mut(&pointer)).collect();
    assert!(!found.is_empty(), "{place} is in the document");
    found
}

/// The schema of a shape, or those of its kinds.
pub(super) fn objects<'a>(document: &'a mut Value, shape: &str) -> impl Iterator<Item = &'a mut Value> {
    let schemas = &mut document["components"]["schemas"];
    let kinds = schemas[shape].get("oneOf").cloned();
    let is_of = move |name: &str| match &kinds {
        Some(Value::Array(kinds)) => kinds.contains(&json!({ "$ref": reference(name) })),
        _ => name == shape,
    };
    let schemas = schemas.as_object_mut().into_iter().flatten();
    schemas.filter_map(move |(name, schema)| is_of(name).then_some(schema))
}

/// Writes every rule into `document`, after its limits.
pub(super) fn write(document: &mut Value) {
    write_degrees(document);
    for place in POINTS {
        for point in at(document, place) {
            *point = json!({ "anyOf": [point.take(), { "$ref": reference("Origin") }] });
        }
    }
    let schemas = &mut document["components"]["schemas"];
    let steady = json!({ "integrates": { "enum": [false, null] }, "integral_time_s": { "type": "null" } });
    let integrating =
        json!({ "integrates": { "enum": [true, null] }, "integral_time_s": { "type": "number" } });
    let integrating = json!({ "required": ["integral_time_s"], "properties": integrating });
    add_rule(&mut schemas["SurgeLoop"], json!({ "anyOf": [{ "properties": steady }, integrating] }));
    for (shape, variants) in one_of() {
        let schema = &mut schemas[shape];
        let rules = variants.iter().map(|given| rule(given, variants, schema));
        let rules: Vec<Value> = rules.collect();
        add_rule(schema, json!({ "oneOf": rules }));
    }
    let has_one =
        |(name, least): (&str, &str)| json!({ "required": [name], "properties": { name: { least: 1 } } });
    let lists = [
        ("auvs", "minProperties"),
        ("asc", "minItems"),
        ("traffic", "minItems"),
        ("notes", "minItems"),
        ("steering", "minItems"),
    ];
    schemas["Reports"]["allOf"] = json!([{ "anyOf": lists.map(has_one) }]);
    let corners = schemas["PlanRequest"]["properties"]["area"]["items"].clone();
    for shape in ["PlanRequest", "Live"] {
        let area = &mut schemas[shape]["properties"]["area"];
        area["items"] = corners.clone();
        // An empty list is no limit.
        area["allOf"] = json!([{ "anyOf": [{ "maxItems": 0 }, { "minItems": area["minItems"] }] }]);
        area["minItems"] = json!(0);
    }
    for shape in POSITIONS {
        let schema = &mut schemas[shape];
        if let Some(required) = schema["required"].as_array_mut() {
            required.retain(|name| name != "north_m" && name != "east_m");
        }
        // Stored bodies may have both.
        let pairs = [["north_m", "east_m"], ["lat_deg", "lon_deg"]].map(|pair| json!({ "required": pair }));
        if shape == "Report" {
            let none = |names: &[&str]| {
                names.iter().map(|name| ((*name).to_owned(), json!({ "type": "null" }))).collect::<Value>()
            };
            let given = |name: &str, kind: &str, other: &str| {
                let mut range = none(&["north_m", "east_m", "lat_deg", "lon_deg", other]);
                range[name] = json!({ "type": kind });
                json!({ "required": [name], "properties": range })
            };
            let position = json!({ "properties": none(&["range_m", "travel", "from"]), "anyOf": pairs });
            let ranges = [given("range_m", "number", "travel"), given("travel", "object", "range_m")];
            add_rule(schema, json!({ "oneOf": [ranges[0], ranges[1], position] }));
            continue;
        }
        add_rule(schema, json!({ "anyOf": pairs }));
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

/// Points, which may be positions on Earth.
pub(super) const POINTS: [&str; 10] = [
    "NoGo.holes/items/items",
    "NoGo.polygon/items",
    "Report.from",
    "PlanRequest.area/items",
    "Setting.area/items",
    "Live.area/items",
    "Segment.from",
    "Segment.to",
    "Segment.centre",
    "Segment.points/items",
];

/// Adds degrees to every shape with a direction in radians. A required direction has one of both.
fn write_degrees(document: &mut Value) {
    let all = DIRECTED.iter().flat_map(|shape| DIRECTIONS.map(|names| (shape, names)));
    for (shape, [degrees, radians]) in all {
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
                let either = [given(radians, degrees), given(degrees, radians)];
                add_rule(schema, json!({ "oneOf": either }));
            }
        }
    }
}

fn add_rule(schema: &mut Value, rule: Value) {
    match schema["allOf"].as_array_mut() {
        Some(rules) => rules.push(rule),
        None => schema["allOf"] = json!([rule]),
    }
}

/// The rule that these members are given and those of other variants are not.
fn rule(given: &[&str], all: &[&[&str]], schema: &Value) -> Value {
    let is_given = |name: &&&str| given.contains(name);
    let others = all.iter().copied().flatten().filter(|name| !is_given(name));
    let mut properties: Map<_, _> =
        others.map(|name| ((*name).to_owned(), json!({ "type": "null" }))).collect();
    for name in given {
        let kind = kind(&schema["properties"][name]["type"]);
        properties.insert((*name).to_owned(), json!({ "type": kind }));
    }
    let mut rule = json!({ "properties": properties });
    if !given.is_empty() {
        rule["required"] = json!(given);
    }
    rule
}

/// The type of a schema that is not null.
pub(super) fn kind(kinds: &Value) -> Value {
    match kinds {
        Value::Array(kinds) => kinds.iter().find(|kind| *kind != "null").cloned().unwrap_or_default(),
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
        ("Report", &[&["course_rad", "speed_mps"], &["course_deg", "speed_mps"], &[]]),
        ("HeadingLoop", &[&["time_constant_s"], &["natural_frequency_radps", "damping"], &[]]),
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
