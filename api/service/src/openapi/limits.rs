//! Ranges, lengths and defaults in the `OpenAPI` document: those by which requests are checked, and no second list of them.
//!
//! The checks are asked. A request in which every number is too large is refused with what each may be, one with lists
//! that are too long with how many items they may have, and a request that says as little as it may comes back with every
//! default spelled out. A limit that depends on another member, such as the largest speed on the least, is left out.

use planner::snapshot::Snapshot;
use serde_json::{Map, Value, json};
use wire::{
    FieldError, PlanRequest,
    mission::{NewMission, Reports, Setting, Step},
};

use super::rules;
use crate::missions::{check, routes};

/// Beyond every limit of a number, and finite.
const HUGE: f64 = 1.0e300;
/// Beyond every limit of a list.
const LONG: usize = 300;

/// Writes what the checks accept into `document`.
pub(super) fn write(document: &mut Value) {
    for request in requests() {
        let request: PlanRequest = serde_json::from_value(request).expect("has the shape");
        let wrong = Snapshot::try_from(&request).expect_err("is beyond all limits");
        write_limits(document, "PlanRequest", &wrong);
    }
    for mission in missions() {
        let mission: NewMission = serde_json::from_value(mission).expect("has the shape");
        let wrong = check::new_mission(&mission).expect_err("is beyond all limits");
        write_limits(document, "NewMission", &wrong);
        // Its numbers are those of the shapes that it has in common with a mission.
        let wrong = mission.live.as_ref().map(check::changed);
        write_limits(
            document,
            "Setting",
            &wrong.and_then(Result::err).unwrap_or_default(),
        );
    }
    let wrong = check::patch(&Setting::default()).expect_err("changes nothing");
    write_limits(document, "Setting", &wrong);
    let wrong = check::speed_factor(Some(HUGE)).expect_err("is beyond all limits");
    write_limits(document, "Run", &wrong);
    let wrong = check::ticks(u32::MAX).expect_err("is beyond all limits");
    write_limits(document, "Step", &wrong);

    let least: PlanRequest = serde_json::from_value(least_request()).expect("has the shape");
    let snapshot = Snapshot::try_from(&least).expect("is valid");
    let spelled_out = json!(PlanRequest::from(&snapshot));
    write_defaults(document, "PlanRequest", &spelled_out, &least_request());
    let mission: NewMission = serde_json::from_value(least_mission()).expect("has the shape");
    write_defaults(document, "NewMission", &json!(mission), &least_mission());
    write_defaults(document, "Step", &json!(Step::default()), &json!({}));
    let live = mission.live.expect("is live");
    let wrong = check::reports(&live, &long_reports(), 0.0).expect_err("is too long");
    write_limits(document, "Reports", &wrong);
    let wrong = check::reports(&live, &long_note(), 0.0).expect_err("is too long");
    write_limits(document, "Reports", &wrong);
    for path in document["paths"]
        .as_object_mut()
        .into_iter()
        .flat_map(Map::values_mut)
    {
        for call in path.as_object_mut().into_iter().flat_map(Map::values_mut) {
            write_parameter_limits(call);
        }
    }
}

fn write_parameter_limits(call: &mut Value) {
    // Asked for by index, a member that is not there would be put there.
    let parameters = call.get_mut("parameters").and_then(Value::as_array_mut);
    for parameter in parameters.into_iter().flatten() {
        for (name, mut limits) in routes::parameter_limits() {
            if parameter["name"] == name
                && let Some(schema) = parameter["schema"].as_object_mut()
            {
                schema.append(&mut limits);
            }
        }
        // What is left out is no null.
        if let Some(kinds) = parameter.pointer_mut("/schema/type") {
            *kinds = rules::kind(kinds);
        }
    }
}

/// Requests of which, taken together, every number and every list is at fault.
fn requests() -> Vec<Value> {
    let mut bare = json!({
        "schema_version": wire::SCHEMA_VERSION, "t_s": 0,
        "asc": { "north_m": 0, "east_m": 0, "heading_rad": 0, "speed_mps": 0, "sway_mps": 0, "yaw_rate_radps": 0,
            "ground_north_mps": 0, "ground_east_mps": 0 },
        "auvs": [
            { "id": "", "state": { "north_m": 0, "east_m": 0, "depth_m": 0, "course_rad": 0, "speed_mps": 0,
                "turn_rate_radps": 0, "age_s": 0, "covariance": [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]] },
              "dive": { "depth_min_m": 0, "depth_max_m": 0, "pitch_rad": 0, "reversal_s": 0 } },
            { "id": "b", "reports": [{ "t_s": 0, "north_m": 0, "east_m": 0, "sigma_m": 0, "depth_m": 0, "course_rad": 0,
                "speed_mps": 0, "turn_rate_radps": 0 }] },
        ],
        "goal": {}, "current": { "north_mps": 0, "east_mps": 0 },
        "limits": { "speed_min_mps": 0, "speed_max_mps": 0, "turn_rate_max_radps": 0, "acceleration_max_mps2": 0,
            "deceleration_max_mps2": 0 },
        "keep_outs": [{ "north_m": 0, "east_m": 0, "radius_m": 0 }], "area": [[0, 0], [0, 0], [0, 0]],
        "acoustics": { "range_max_m": 0 }, "surfacing_separation_m": 0, "deadline_ms": 0,
        "previous_plan": {
            "trajectory": [{ "t_s": 0, "north_m": 0, "east_m": 0, "speed_mps": 0, "heading_rad": 0 }],
            "goal_course_rad": 0, "current": { "north_mps": 0, "east_mps": 0 },
            "craft_estimate": { "asked_speed_mps": 0, "asked_heading_rad": 0, "memory": [] },
            "reference": { "speed_mps": 0, "heading_rad": 0 },
            "targets": [{ "id": "a", "forecast": "hold", "drift": { "north_mps": 0, "east_mps": 0 }, "estimate": {
                "age_s": 0, "north_m": 0, "east_m": 0, "depth_m": 0, "north_mps": 0, "east_mps": 0, "turn_rate_radps": 0
            } }],
        },
        "craft": { "sway_per_yaw_rate_s": 0, "power": { "linear_w_per_mps": 0, "cubic_w_per_mps3": 0 },
            "relative_uncertainty": 0, "surge_loop": { "time_constant_s": 0, "delay_s": 0, "acceleration_max_mps2": 0,
                "deceleration_max_mps2": 0, "integral_time_s": 0 } },
    });
    enlarge(&mut bare, &mut 0);
    let goals = [
        json!({ "kind": "intermittent", "auvs": ["b"], "dwell_s": HUGE, "epoch_s": HUGE,
            "offset": { "frame": "ned", "north_m": HUGE, "east_m": HUGE } }),
        json!({ "kind": "weighted", "weights": { "b": HUGE },
            "offset": { "frame": "target", "ahead_m": HUGE, "starboard_m": HUGE } }),
        json!({ "kind": "range", "auvs": ["b"], "range_m": HUGE,
            "offset": { "frame": "polar", "range_m": HUGE, "bearing_rad": HUGE } }),
    ];
    let loops = [
        json!({ "time_constant_s": HUGE, "delay_s": HUGE, "rate_max_radps": HUGE }),
        json!({ "natural_frequency_radps": HUGE, "damping": HUGE }),
    ];
    let mut requests = Vec::new();
    for (goal, heading_loop) in goals.into_iter().zip(loops.iter().cycle()) {
        let mut request = bare.clone();
        request["goal"] = goal;
        request["craft"]["heading_loop"] = heading_loop.clone();
        requests.push(request);
    }
    // A path is checked before the speed on it is.
    let legs = json!({ "kind": "waypoints", "points": [[0, 0], [9, 0]], "fillet_m": 0 });
    bare["goal"] = json!({ "kind": "track", "auv": "b" });
    bare["auvs"][0]["path"] = json!({ "segments": [legs], "speed_mps": HUGE });
    requests.push(bare.clone());
    for far in [
        json!({ "kind": "waypoints", "points": [[HUGE, HUGE], [9, 0]], "fillet_m": 0 }),
        json!({ "kind": "waypoints", "points": [[0, 0], [9, 0]], "fillet_m": HUGE }),
        json!({ "kind": "line", "from": [HUGE, HUGE], "to": [0, 9] }),
        json!({ "kind": "line", "from": [0, 0], "to": [HUGE, HUGE] }),
        json!({ "kind": "arc", "from": [0, 0], "centre": [HUGE, HUGE], "angle_rad": 1 }),
        json!({ "kind": "arc", "from": [0, 0], "centre": [0, 9], "angle_rad": HUGE }),
    ] {
        bare["auvs"][0]["path"]["segments"][0] = far;
        requests.push(bare.clone());
    }
    // Lists are checked alone, before what is in them.
    for pointer in [
        "/auvs/1/reports",
        "/auvs/0/path/segments",
        "/auvs",
        "/keep_outs",
        "/area",
        "/previous_plan/trajectory",
        "/previous_plan/targets",
    ] {
        let list = bare.pointer_mut(pointer).expect("is there");
        let missing = LONG - list.as_array().map_or(0, Vec::len);
        let more = vec![list[0].clone(); missing];
        list.as_array_mut().expect("is a list").extend(more);
    }
    bare["goal"] = json!({ "kind": "weighted", "auvs": vec![""; LONG],
        "weights": (0..LONG).map(|i| (i.to_string(), json!(0))).collect::<Map<_, _>>() });
    requests.push(bare);
    requests
}

/// Makes every number larger than any that is accepted, each another.
fn enlarge(value: &mut Value, n_before: &mut u32) {
    match value {
        Value::Number(_) => {
            *n_before += 1;
            *value = json!(HUGE * (1.0 + f64::from(*n_before)));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| enlarge(item, n_before)),
        Value::Object(members) => members.values_mut().for_each(|member| enlarge(member, n_before)),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// Missions of which, taken together, every number and every list of their own is at fault.
fn missions() -> [Value; 2] {
    let (mut large, mut long) = (least_mission(), least_mission());
    large["title"] = json!("x".repeat(LONG));
    large["live"]["auvs"][0]["id"] = json!("");
    for member in ["period_s", "clock_rate", "surfacing_separation_m"] {
        large["live"][member] = json!(HUGE);
    }
    let disc = json!({ "north_m": 0, "east_m": 0, "radius_m": 1 });
    for (member, item) in [
        ("auvs", json!({ "id": "a" })),
        ("keep_outs", disc),
        ("area", json!([0, 0])),
    ] {
        long["live"][member] = json!(vec![item; LONG]);
    }
    [large, long]
}

fn long_reports() -> Reports {
    let state = json!({ "north_m": 0, "east_m": 0, "heading_rad": 0, "speed_mps": 0 });
    let auvs: Map<_, _> = (0..LONG).map(|i| (i.to_string(), json!([]))).collect();
    let note = json!({ "t_s": 0, "text": "x" });
    let reports = json!({ "auvs": auvs, "asc": vec![json!({ "t_s": 0, "state": state }); LONG], "notes": vec![note; LONG] });
    serde_json::from_value(reports).expect("has the shape")
}

fn long_note() -> Reports {
    let reports = json!({ "notes": [{ "t_s": 0, "text": "x".repeat(4 * LONG) }] });
    serde_json::from_value(reports).expect("has the shape")
}

fn least_mission() -> Value {
    json!({ "schema_version": wire::SCHEMA_VERSION,
        "live": { "auvs": [{ "id": "a" }], "goal": { "kind": "track", "auv": "a" } } })
}

/// A request with a member of every kind that has a default, and as little in each as there may be.
fn least_request() -> Value {
    json!({
        "schema_version": wire::SCHEMA_VERSION, "t_s": 0, "limits": {},
        "asc": { "north_m": 0, "east_m": 0, "heading_rad": 0, "speed_mps": 0 },
        "auvs": [{ "id": "a", "state": { "north_m": 0, "east_m": 0, "depth_m": 1, "course_rad": 0, "speed_mps": 0 },
            "path": { "segments": [{ "kind": "line", "from": [0, 0], "to": [9, 0] }], "speed_mps": 1 },
            "dive": { "depth_min_m": 0, "depth_max_m": 9, "pitch_rad": 1 } }],
        "goal": { "kind": "track", "auv": "a" }, "craft": { "power": {} },
    })
}

/// Writes the limits that the errors in a body of the `shape` state. The first error about a member counts.
fn write_limits(document: &mut Value, shape: &str, wrong: &[FieldError]) {
    for error in wrong {
        let Some(limit) = &error.limit else { continue };
        let tokens: Vec<&str> = error.pointer.split('/').skip(1).collect();
        let Some(schema) = place(document, shape, &tokens) else {
            continue;
        };
        let (least, most) = if is(schema, "array") {
            ("minItems", "maxItems")
        } else if is(schema, "string") {
            ("minLength", "maxLength")
        } else if is(schema, "object") {
            ("minProperties", "maxProperties")
        } else {
            ("minimum", "maximum")
        };
        for (keyword, bound) in [(least, &limit["least"]), (most, &limit["most"])] {
            let is_limit = bound.as_f64().is_some_and(|bound| bound.abs() < HUGE);
            // utoipa says of every unsigned number that it is 0 or more.
            if is_limit && schema.get(keyword).is_none_or(|kept| *kept == 0) {
                schema[keyword] = bound.clone();
            }
        }
    }
}

/// What a body of the `shape` comes to, where it leaves members out that need not be there: those that are not in `said`.
fn write_defaults(document: &mut Value, shape: &str, body: &Value, said: &Value) {
    let mut members = vec![(Vec::new(), body)];
    while let Some((tokens, value)) = members.pop() {
        match value {
            Value::Object(object) => members.extend(object.iter().map(|(name, value)| {
                let path: Vec<&str> = tokens.iter().copied().chain([name.as_str()]).collect();
                (path, value)
            })),
            Value::Array(items) => members.extend(items.iter().map(|item| {
                let path: Vec<&str> = tokens.iter().copied().chain(["0"]).collect();
                (path, item)
            })),
            Value::Null => {}
            _ if said.pointer(&format!("/{}", tokens.join("/"))).is_some() => {}
            scalar => write_default(document, shape, &tokens, scalar),
        }
    }
}

fn write_default(document: &mut Value, shape: &str, tokens: &[&str], value: &Value) {
    let Some(schema) = place(document, shape, tokens) else {
        return;
    };
    // What is as large as it may be is no limit.
    if schema["maximum"] != *value {
        schema["default"] = value.clone();
    }
}

/// The schema of what stands at a pointer into a body of the `shape`.
fn place<'a>(document: &'a mut Value, shape: &str, tokens: &[&str]) -> Option<&'a mut Value> {
    let mut path = format!("/components/schemas/{shape}");
    for token in tokens {
        path = resolved(document, path)?;
        let schema = document.pointer(&path)?;
        path = if is(schema, "array") {
            format!("{path}/items")
        } else if schema.get("additionalProperties").is_some_and(Value::is_object) {
            format!("{path}/additionalProperties")
        } else {
            format!("{path}/properties/{token}")
        };
    }
    // What is of a named shape has its default beside that name.
    document.pointer_mut(&path)
}

/// Where the schema at `path` leads by its name, the null beside it apart.
fn resolved(document: &Value, path: String) -> Option<String> {
    let schema = document.pointer(&path)?;
    let named = match schema["oneOf"].as_array() {
        Some(shapes) => shapes.iter().find(|shape| shape.get("$ref").is_some())?,
        None => schema,
    };
    match named["$ref"].as_str() {
        Some(name) => Some(name.trim_start_matches('#').to_owned()),
        None => Some(path),
    }
}

/// Whether the schema is of that type, or null.
fn is(schema: &Value, kind: &str) -> bool {
    let kinds = &schema["type"];
    *kinds == kind
        || kinds
            .as_array()
            .is_some_and(|kinds| kinds.iter().any(|one| one == kind))
}
