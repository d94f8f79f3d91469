//! Ranges, lengths and defaults in the `OpenAPI` document, from the constants of the checks: utoipa
//! takes literals only.

use std::ops::RangeInclusive;

use planner::{
    los::LawGains,
    path::{ARC_ANGLE_MAX, LENGTH_MAX, LENGTH_MIN, SEGMENTS_MAX},
    snapshot::{
        AREA_CORNERS, AUVS_MAX, COORDINATE_MAX, COVARIANCE, Dive, Fallback, Forecast, Hold, ID_LENGTH_MAX,
        KEEP_OUTS_MAX, Limits, REPORTS_MAX, SPEED_MAX_MOST, STEP, STEPS_COUNT, TIME, TRAJECTORY_POINTS_MAX,
        VISIT_COST, VISITS_MAX, WEIGHT, ranges_by_shape,
    },
};
use serde_json::{Map, Value, json};
use wire::{
    DEADLINE_MS,
    mission::{Setting, Step},
};

use super::rules::{self, at};
use crate::{
    limits::BATCH_MAX,
    missions::{check, parameters},
};

/// Writes the accepted values into `document`.
pub(super) fn write(document: &mut Value) {
    let mut write = |place: &str, keyword: &str, value: Value| {
        for schema in at(document, place) {
            schema[keyword] = value.clone();
        }
    };
    let by_shape = ranges_by_shape().map(|(shape, (member, range))| (format!("{shape}.{member}"), range));
    let gains = LawGains::RANGES.map(|(member, range)| (format!("LawGains.{member}"), range));
    let more = RANGES.map(|(at, range)| (at.to_owned(), range));
    for (at, range) in by_shape.chain(more).chain(gains) {
        write(&at, "minimum", json!(range.start()));
        write(&at, "maximum", json!(range.end()));
    }
    // The minimum depends on the slowest speed.
    write("Limits.speed_max_mps", "maximum", json!(SPEED_MAX_MOST));
    write("Step.ticks", "minimum", json!(check::TICKS.start()));
    write("Step.ticks", "maximum", json!(check::TICKS.end()));
    for (of, rows) in [
        ("Length", &TEXTS[..]),
        ("Items", &LISTS),
        ("Properties", &OBJECTS),
    ] {
        for (at, least, most) in rows {
            if let Some(least) = least {
                write(at, &format!("min{of}"), json!(least));
            }
            write(at, &format!("max{of}"), json!(most));
        }
    }
    for (at, value) in defaults() {
        write(at, "default", value);
    }
    let paths = document["paths"].as_object_mut().into_iter();
    for path in paths.flat_map(Map::values_mut) {
        for call in path.as_object_mut().into_iter().flat_map(Map::values_mut) {
            write_parameter_limits(call);
        }
    }
}

fn write_parameter_limits(call: &mut Value) {
    let limits = parameters::parameter_limits();
    // `get_mut`, because an index would insert a missing member.
    let parameters = call.get_mut("parameters").and_then(Value::as_array_mut);
    for parameter in parameters.into_iter().flatten() {
        let limits = parameter["name"].as_str().and_then(|name| limits.get(name));
        if let Some(Value::Object(limits)) = limits.cloned()
            && let Some(schema) = parameter["schema"].as_object_mut()
        {
            schema.extend(limits);
        }
        // An absent parameter is not null.
        if let Some(kinds) = parameter.pointer_mut("/schema/type") {
            *kinds = rules::kind(kinds);
        }
    }
}

/// A coordinate of a point, m.
const COORDINATE: RangeInclusive<f64> = -COORDINATE_MAX..=COORDINATE_MAX;

/// Ranges of numbers that are not in the planner's table, by the place of their schema.
const RANGES: [(&str, RangeInclusive<f64>); 18] = [
    ("AuvState.covariance/items/items", COVARIANCE),
    ("PlanRequest.area/items/items", COORDINATE),
    ("Goal.weights/additionalProperties", WEIGHT),
    ("Goal.costs_now/additionalProperties", VISIT_COST),
    ("Goal.serve_by_s/additionalProperties", TIME),
    ("ServedVehicle.served_by_s", TIME),
    ("Tuning.steps_s/items", STEP),
    ("Segment.from/items", COORDINATE),
    ("Segment.to/items", COORDINATE),
    ("Segment.centre/items", COORDINATE),
    ("Segment.points/items/items", COORDINATE),
    ("Segment.angle_rad", -ARC_ANGLE_MAX..=ARC_ANGLE_MAX),
    ("Segment.fillet_m", 0.0..=LENGTH_MAX),
    ("Segment.turn_radius_m", LENGTH_MIN..=LENGTH_MAX),
    ("PlanRequest.deadline_ms", DEADLINE_MS),
    ("Live.period_s", check::PERIOD),
    ("Live.clock_rate", check::CLOCK_RATE),
    ("Run.speed_factor", check::SPEED_FACTOR),
];

/// Lengths by the place of their schema: the minimum, if any, and the maximum.
type Lengths = (&'static str, Option<usize>, usize);

const TEXTS: [Lengths; 5] = [
    ("Auv.id", Some(1), ID_LENGTH_MAX),
    ("LiveAuv.id", Some(1), ID_LENGTH_MAX),
    ("NewMission.title", None, check::TITLE_BYTES_MAX),
    ("Note.text", None, check::NOTE_BYTES_MAX),
    ("Steering.why", None, check::NOTE_BYTES_MAX),
];

const LISTS: [Lengths; 20] = [
    ("Auv.reports", Some(1), REPORTS_MAX),
    ("Path.segments", Some(1), SEGMENTS_MAX),
    ("Tuning.steps_s", Some(*STEPS_COUNT.start()), *STEPS_COUNT.end()),
    ("Goal.auvs", Some(1), AUVS_MAX),
    ("PlanRequest.auvs", Some(1), AUVS_MAX),
    ("PlanRequest.keep_outs", Some(0), KEEP_OUTS_MAX),
    ("PlanRequest.area", CORNERS.0, CORNERS.1),
    ("PreviousPlan.trajectory", Some(0), TRAJECTORY_POINTS_MAX),
    ("PreviousPlan.targets", Some(0), AUVS_MAX),
    ("Schedule.visits", Some(0), VISITS_MAX),
    ("Schedule.costs", Some(0), AUVS_MAX),
    ("Live.auvs", Some(1), AUVS_MAX),
    ("Live.keep_outs", Some(0), KEEP_OUTS_MAX),
    ("Live.area", CORNERS.0, CORNERS.1),
    ("Setting.keep_outs", Some(0), KEEP_OUTS_MAX),
    ("Setting.area", CORNERS.0, CORNERS.1),
    ("Reports.asc", None, REPORTS_MAX),
    ("Reports.notes", None, REPORTS_MAX),
    ("Reports.steering", None, REPORTS_MAX),
    ("Batch.requests", Some(1), BATCH_MAX),
];
const CORNERS: (Option<usize>, usize) = (Some(*AREA_CORNERS.start()), *AREA_CORNERS.end());

const OBJECTS: [Lengths; 4] = [
    ("Goal.weights", Some(1), AUVS_MAX),
    ("Setting.paths", None, AUVS_MAX),
    ("Setting", Some(1), Setting::MEMBERS),
    ("Reports.auvs", None, AUVS_MAX),
];

/// Defaults by the place of their schema.
fn defaults() -> [(&'static str, Value); 18] {
    [
        ("Asc.sway_mps", json!(0.0)),
        ("Asc.yaw_rate_radps", json!(0.0)),
        ("AuvState.turn_rate_radps", json!(0.0)),
        ("AuvState.age_s", json!(0.0)),
        ("Dive.reversal_s", json!(Dive::REVERSAL_MEDUSA)),
        ("Path.closed", json!(false)),
        ("Limits.speed_min_mps", json!(Limits::ANY.speed_min)),
        ("Limits.speed_max_mps", json!(Limits::ANY.speed_max)),
        ("Power.linear_w_per_mps", json!(0.0)),
        ("Power.cubic_w_per_mps3", json!(0.0)),
        ("PlanRequest.forecast", json!(Forecast::default())),
        ("PlanRequest.fallback", json!(Fallback::default())),
        ("PlanRequest.hold", json!(Hold::default())),
        ("Live.forecast", json!(Forecast::default())),
        ("Live.hold", json!(Hold::default())),
        ("Live.period_s", json!(1.0)),
        ("Live.clock_rate", json!(1.0)),
        ("Step.ticks", json!(Step::default().ticks)),
    ]
}
