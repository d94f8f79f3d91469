//! Rules between members and items in the `OpenAPI` document, which no single member states.
//!
//! They are written as `allOf`, which generators of clients skip if they do not know it. Null and
//! absent are equal for optional members.

use planner::craft::PRESETS;
use serde_json::{Map, Value, json};
use wire::{LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG, SCHEMA_VERSION};

/// Points (north, east) that may be positions on Earth.
const POINTS: [&str; 3] = ["from", "to", "centre"];

/// Shapes with a position, in metres or on Earth.
const POSITIONS: [&str; 4] = ["Asc", "AuvState", "Report", "KeepOut"];

/// Writes every rule into `document`, after limits and directions in degrees.
pub(super) fn write(document: &mut Value) {
    for (at, mut words) in words() {
        let schema = document.pointer_mut(&place(at)).and_then(Value::as_object_mut);
        let words = words.as_object_mut().expect("are an object");
        schema.expect("is in the document").append(words);
    }
    let schemas = &mut document["components"]["schemas"];
    for (shape, variants) in one_of() {
        let schema = &mut schemas[shape];
        let rule: Vec<Value> = variants
            .iter()
            .map(|variant| variant.rule(&variants, schema))
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
    for shape in ["PlanRequest", "Live", "Setting"] {
        or_on_earth(&mut schemas[shape]["properties"]["area"]["items"]);
    }
    let segment = &mut schemas["Segment"]["properties"];
    for point in POINTS {
        or_on_earth(&mut segment[point]);
    }
    or_on_earth(&mut segment["points"]["items"]);
    unsigned(document);
}

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
    *point = json!({ "anyOf": [metres, { "$ref": "#/components/schemas/Origin" }] });
}

/// A combination of a shape's members that are given together.
#[derive(Clone)]
struct Variant {
    /// A member that chooses this variant, and the values that do.
    choice: Option<(&'static str, Vec<&'static str>)>,
    given: &'static [&'static str],
    /// Further members that may be given. Those of other variants may not.
    optional: &'static [&'static str],
}

impl Variant {
    /// A variant that the member `by` chooses.
    fn of(
        by: &'static str,
        values: &[&'static str],
        given: &'static [&'static str],
        optional: &'static [&'static str],
    ) -> Self {
        Self {
            choice: Some((by, values.to_vec())),
            given,
            optional,
        }
    }

    fn members(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.given.iter().chain(self.optional).copied()
    }

    fn rule(&self, all: &[Self], schema: &Value) -> Value {
        let given = self.given.iter();
        let given = given.map(|name| {
            let kind = if POINTS.contains(name) {
                json!(["array", "object"])
            } else {
                kind(&schema["properties"][name]["type"])
            };
            (*name, json!({ "type": kind }))
        });
        let others = all.iter().flat_map(Self::members);
        let absent = others
            .filter(|name| !self.members().any(|own| own == *name))
            .map(|name| (name, json!({ "type": "null" })));
        let choice = self
            .choice
            .iter()
            .map(|(name, values)| (*name, json!({ "enum": values })));
        let properties: Map<_, _> = given
            .chain(absent)
            .chain(choice)
            .map(|(name, schema)| (name.to_owned(), schema))
            .collect();
        let mut rule = json!({ "properties": properties });
        if !self.given.is_empty() {
            rule["required"] = json!(self.given);
        }
        rule
    }
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

/// Shapes of whose variants exactly one is given.
fn one_of() -> Vec<(&'static str, Vec<Variant>)> {
    let kind = |kind, given| Variant::of("kind", &[kind], given, &[]);
    let frame = |frames, given| Variant::of("frame", frames, given, &[]);
    let and = |kind, given, optional| Variant::of("kind", &[kind], given, optional);
    vec![
        ("Auv", given(&[&["state"], &["reports"]])),
        ("NewMission", given(&[&["live"], &["simulated"]])),
        ("Simulated", given(&[&["scenario"], &["scenario_file"]])),
        ("Asc", given(&[&["ground_north_mps", "ground_east_mps"], &[]])),
        (
            "Report",
            given(&[&["course_rad", "speed_mps"], &["course_deg", "speed_mps"], &[]]),
        ),
        (
            "HeadingLoop",
            given(&[&["time_constant_s"], &["natural_frequency_radps", "damping"], &[]]),
        ),
        (
            "Goal",
            vec![
                kind("track", &["auv"]),
                kind("intermittent", &["auvs", "dwell_s", "epoch_s"]),
                kind("midpoint", &["auvs"]),
                kind("weighted", &["weights"]),
                kind("range", &["auvs", "range_m"]),
                and("visit", &["auvs"], &VISIT_OPTIONAL),
            ],
        ),
        (
            "VisitCost",
            vec![
                kind("age", &[]),
                and(
                    "uncertainty",
                    &["growth_m2ps"],
                    &["sigma_m", "sigma_rad", "interval_s"],
                ),
                kind("data", &["growth_kbps", "upload_kbps", "range_max_m"]),
            ],
        ),
        (
            "Offset",
            vec![
                frame(&["ned"], &["north_m", "east_m"]),
                frame(&["target", "path"], &["ahead_m", "starboard_m"]),
                frame(&["polar"], &["range_m", "bearing_rad"]),
                frame(&["polar"], &["range_m", "bearing_deg"]),
            ],
        ),
        (
            "Segment",
            vec![
                kind("line", &["from", "to"]),
                kind("arc", &["from", "centre", "angle_rad"]),
                and("waypoints", &["points"], &["fillet_m", "turn_radius_m"]),
            ],
        ),
    ]
}

/// Optional members of a goal of the kind `visit`.
const VISIT_OPTIONAL: [&str; 8] = [
    "cost",
    "weights",
    "within_m",
    "dwell_min_s",
    "serve_by_s",
    "reduce",
    "costs_now",
    "next",
];

/// Variants without a member that chooses.
fn given(variants: &[&'static [&'static str]]) -> Vec<Variant> {
    let variant = |given: &&'static [_]| Variant {
        choice: None,
        given,
        optional: &[],
    };
    variants.iter().map(variant).collect()
}

/// The pointer of a schema: `Shape`, or `Shape.member` with what follows.
pub(super) fn place(short: &str) -> String {
    format!("/components/schemas/{}", short.replace('.', "/properties/"))
}

/// Lengths and patterns, by the [`place`] of their schema.
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
        ("Segment.from", exactly(2)),
        ("Segment.to", exactly(2)),
        ("Segment.centre", exactly(2)),
        ("Segment.points/items", exactly(2)),
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
