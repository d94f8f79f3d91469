//! Ranges, lengths and defaults in the `OpenAPI` document, from the constants by which requests are checked: utoipa takes
//! literals only.

use std::ops::RangeInclusive;

use planner::{
    los::LawGains,
    path::{ARC_ANGLE_MAX, LENGTH_MAX, LENGTH_MIN, SEGMENTS_MAX},
    snapshot::{
        AREA_CORNERS, AUVS_MAX, COORDINATE_MAX, COVARIANCE, Dive, Fallback, Forecast, Hold, ID_LENGTH_MAX,
        KEEP_OUTS_MAX, Limits, REPORTS_MAX, SPEED_MAX_MOST, STEP, STEPS_COUNT, TIME_MAX,
        TRAJECTORY_POINTS_MAX, VISIT_COST, VISITS_MAX, WEIGHT, ranges_by_shape,
    },
};
use serde_json::{Map, Value, json};
use wire::{
    DEADLINE_MS,
    mission::{Setting, Step},
};

use super::rules;
use crate::missions::{check, parameters};

/// Writes what the checks accept into `document`.
pub(super) fn write(document: &mut Value) {
    let mut write = |place: &str, keyword: &str, value: Value| {
        let schema = document.pointer_mut(&format!("/components/schemas/{place}"));
        schema.unwrap_or_else(|| panic!("{place} is in the document"))[keyword] = value;
    };
    let by_shape =
        ranges_by_shape().map(|(shape, (member, range))| (format!("{shape}/properties/{member}"), range));
    for (place, range) in by_shape.chain(more_ranges()) {
        write(&place, "minimum", json!(range.start()));
        write(&place, "maximum", json!(range.end()));
    }
    // The least depends on the slowest speed.
    write(
        "Limits/properties/speed_max_mps",
        "maximum",
        json!(SPEED_MAX_MOST),
    );
    for keyword in ["minimum", "maximum"] {
        let ticks = if keyword == "minimum" {
            check::TICKS.start()
        } else {
            check::TICKS.end()
        };
        write("Step/properties/ticks", keyword, json!(ticks));
    }
    for (place, of, least, most) in lengths() {
        if let Some(least) = least {
            write(place, &format!("min{of}"), json!(least));
        }
        write(place, &format!("max{of}"), json!(most));
    }
    for (place, value) in defaults() {
        write(place, "default", value);
    }
    let paths = document["paths"].as_object_mut().into_iter();
    for path in paths.flat_map(Map::values_mut) {
        for call in path.as_object_mut().into_iter().flat_map(Map::values_mut) {
            write_parameter_limits(call);
        }
    }
}

fn write_parameter_limits(call: &mut Value) {
    // Asked for by index, a member that is not there would be put there.
    let parameters = call.get_mut("parameters").and_then(Value::as_array_mut);
    for parameter in parameters.into_iter().flatten() {
        for (name, mut limits) in parameters::parameter_limits() {
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

/// A coordinate of a point, m.
const COORDINATE: RangeInclusive<f64> = -COORDINATE_MAX..=COORDINATE_MAX;

/// Ranges of numbers that are not in the planner's table, by the place of their schema.
fn more_ranges() -> impl Iterator<Item = (String, RangeInclusive<f64>)> {
    let gains = LawGains::RANGES.map(|(member, range)| (format!("LawGains/properties/{member}"), range));
    [
        ("AuvState/properties/covariance/items/items", COVARIANCE),
        (
            "PlanRequest/properties/area/items/items",
            -COORDINATE_MAX..=COORDINATE_MAX,
        ),
        ("Goal/properties/weights/additionalProperties", WEIGHT),
        ("Goal/properties/costs_now/additionalProperties", VISIT_COST),
        (
            "Goal/properties/serve_by_s/additionalProperties",
            -TIME_MAX..=TIME_MAX,
        ),
        ("ServedVehicle/properties/served_by_s", -TIME_MAX..=TIME_MAX),
        ("Tuning/properties/steps_s/items", STEP),
        ("Segment/properties/from/items", COORDINATE),
        ("Segment/properties/to/items", COORDINATE),
        ("Segment/properties/centre/items", COORDINATE),
        ("Segment/properties/points/items/items", COORDINATE),
        ("Segment/properties/angle_rad", -ARC_ANGLE_MAX..=ARC_ANGLE_MAX),
        ("Segment/properties/fillet_m", 0.0..=LENGTH_MAX),
        ("Segment/properties/turn_radius_m", LENGTH_MIN..=LENGTH_MAX),
        ("PlanRequest/properties/deadline_ms", DEADLINE_MS),
        ("Live/properties/period_s", check::PERIOD),
        ("Live/properties/clock_rate", check::CLOCK_RATE),
        ("Run/properties/speed_factor", check::SPEED_FACTOR),
    ]
    .map(|(place, range)| (place.to_owned(), range))
    .into_iter()
    .chain(gains)
}

/// Lengths by the place of their schema: of what, the least where there is one, and the most.
fn lengths() -> [(&'static str, &'static str, Option<usize>, usize); 27] {
    let corners = (Some(*AREA_CORNERS.start()), *AREA_CORNERS.end());
    [
        ("Auv/properties/id", "Length", Some(1), ID_LENGTH_MAX),
        ("LiveAuv/properties/id", "Length", Some(1), ID_LENGTH_MAX),
        (
            "NewMission/properties/title",
            "Length",
            None,
            check::TITLE_BYTES_MAX,
        ),
        ("Note/properties/text", "Length", None, check::NOTE_BYTES_MAX),
        ("Auv/properties/reports", "Items", Some(1), REPORTS_MAX),
        ("Path/properties/segments", "Items", Some(1), SEGMENTS_MAX),
        (
            "Tuning/properties/steps_s",
            "Items",
            Some(*STEPS_COUNT.start()),
            *STEPS_COUNT.end(),
        ),
        ("Goal/properties/auvs", "Items", Some(1), AUVS_MAX),
        ("Goal/properties/weights", "Properties", Some(1), AUVS_MAX),
        ("PlanRequest/properties/auvs", "Items", Some(1), AUVS_MAX),
        (
            "PlanRequest/properties/keep_outs",
            "Items",
            Some(0),
            KEEP_OUTS_MAX,
        ),
        ("PlanRequest/properties/area", "Items", corners.0, corners.1),
        (
            "PreviousPlan/properties/trajectory",
            "Items",
            Some(0),
            TRAJECTORY_POINTS_MAX,
        ),
        ("PreviousPlan/properties/targets", "Items", Some(0), AUVS_MAX),
        ("Schedule/properties/visits", "Items", Some(0), VISITS_MAX),
        ("Schedule/properties/costs", "Items", Some(0), AUVS_MAX),
        ("Live/properties/auvs", "Items", Some(1), AUVS_MAX),
        ("Live/properties/keep_outs", "Items", Some(0), KEEP_OUTS_MAX),
        ("Live/properties/area", "Items", corners.0, corners.1),
        ("Setting/properties/keep_outs", "Items", Some(0), KEEP_OUTS_MAX),
        ("Setting/properties/area", "Items", corners.0, corners.1),
        ("Setting/properties/paths", "Properties", None, AUVS_MAX),
        ("Setting", "Properties", Some(1), Setting::MEMBERS),
        ("Reports/properties/auvs", "Properties", None, AUVS_MAX),
        ("Reports/properties/asc", "Items", None, REPORTS_MAX),
        ("Reports/properties/notes", "Items", None, REPORTS_MAX),
        (
            "Batch/properties/requests",
            "Items",
            Some(1),
            crate::batch::BATCH_MAX,
        ),
    ]
}

/// Defaults by the place of their schema.
fn defaults() -> [(&'static str, Value); 18] {
    [
        ("Asc/properties/sway_mps", json!(0.0)),
        ("Asc/properties/yaw_rate_radps", json!(0.0)),
        ("AuvState/properties/turn_rate_radps", json!(0.0)),
        ("AuvState/properties/age_s", json!(0.0)),
        ("Dive/properties/reversal_s", json!(Dive::REVERSAL_MEDUSA)),
        ("Path/properties/closed", json!(false)),
        ("Limits/properties/speed_min_mps", json!(Limits::ANY.speed_min)),
        ("Limits/properties/speed_max_mps", json!(Limits::ANY.speed_max)),
        ("Power/properties/linear_w_per_mps", json!(0.0)),
        ("Power/properties/cubic_w_per_mps3", json!(0.0)),
        ("PlanRequest/properties/forecast", json!(Forecast::default())),
        ("PlanRequest/properties/fallback", json!(Fallback::default())),
        ("PlanRequest/properties/hold", json!(Hold::default())),
        ("Live/properties/forecast", json!(Forecast::default())),
        ("Live/properties/hold", json!(Hold::default())),
        ("Live/properties/period_s", json!(1.0)),
        ("Live/properties/clock_rate", json!(1.0)),
        ("Step/properties/ticks", json!(Step::default().ticks)),
    ]
}
