//! Accepted values in the `OpenAPI` document, of the checks' constants: utoipa takes literals only.

use std::ops::RangeInclusive;

use planner::craft::PRESETS;
use planner::fleet::CRAFT_MAX;
use planner::los::LawGains;
use planner::path::{ARC_ANGLE_MAX, LENGTH_MAX, LENGTH_MIN, SEGMENTS_MAX};
use planner::snapshot::{
    AREA_CORNERS, AUVS_MAX, COORDINATE_MAX, COVARIANCE, Dive, FIGURE_ROWS_MAX, Fallback, Forecast, Hold,
    ID_LENGTH_MAX, KEEP_OUTS_MAX, Limits, NO_GO_CORNERS_MAX, NO_GO_MAX, REPORTS_MAX, SPEED_MAX_MOST, STEP,
    STEPS_COUNT, TIME, TRAJECTORY_POINTS_MAX, VESSEL_PLAN_LENGTH, VESSEL_SEPARATION, VESSELS_MAX, VISIT_COST,
    VISITS_MAX, WEIGHT, ranges_by_shape,
};
use serde::Serialize;
use serde_json::{Map, Value, json};
use wire::mission::{Setting, Step};
use wire::{DEADLINE_MS, SCHEMA_VERSION};

use super::rules::{self, at};
use crate::{
    limits::BATCH_MAX,
    missions::{check, parameters},
};

pub(super) fn write(document: &mut Value) {
    let by_shape = ranges_by_shape().map(|(shape, range)| (shape, range.0, range.1));
    let gains = LawGains::RANGES.map(|(member, range)| ("LawGains", member, range));
    let ranges = by_shape.chain(gains);
    let ranges = ranges.map(|(shape, member, range)| (format!("{shape}.{member}"), between(range)));
    let members = members().into_iter();
    let points = rules::POINTS.into_iter().flat_map(|place| {
        let coordinate = between(-COORDINATE_MAX..=COORDINATE_MAX);
        [(place.to_owned(), list(2, 2)), (format!("{place}/items"), coordinate)]
    });
    let members = members.map(|(place, values)| (place.to_owned(), values));
    for (place, mut values) in ranges.chain(members).chain(points) {
        let values = values.as_object_mut().expect("are an object");
        for schema in at(document, &place) {
            let schema = schema.as_object_mut().expect("is a schema");
            schema.append(&mut values.clone());
        }
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

fn between<T: Serialize>(range: RangeInclusive<T>) -> Value {
    json!({ "minimum": range.start(), "maximum": range.end() })
}

fn list(least: usize, most: usize) -> Value {
    json!({ "minItems": least, "maxItems": most })
}

fn default(value: impl Serialize) -> Value {
    json!({ "default": value })
}

/// Values that are not in the planner's table of ranges, by the place of their schema.
#[expect(clippy::too_many_lines, reason = "it is a table")]
fn members() -> Vec<(&'static str, Value)> {
    // Names have no control characters, Unicode's general category Cc.
    let name = json!({ "minLength": 1, "maxLength": ID_LENGTH_MAX, "pattern": "^[^\\u0000-\\u001f\\u007f-\\u009f]*$" });
    let presets: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
    let preset = format!("^({})$", presets.join("|"));
    let version = json!({ "const": SCHEMA_VERSION });
    let note = json!({ "maxLength": check::NOTE_BYTES_MAX });
    let at_most = |most: usize| json!({ "maxItems": most });
    let ring = list(3, NO_GO_CORNERS_MAX);
    let corners = list(*AREA_CORNERS.start(), *AREA_CORNERS.end());
    let object = |least: usize, most: usize| json!({ "minProperties": least, "maxProperties": most });
    vec![
        ("Asc.sway_mps", default(0.0)),
        ("Asc.yaw_rate_radps", default(0.0)),
        ("Auv.id", name.clone()),
        ("Auv.reports", list(1, REPORTS_MAX)),
        ("AuvState.age_s", default(0.0)),
        ("AuvState.covariance", list(4, 4)),
        ("AuvState.covariance/items", list(4, 4)),
        ("AuvState.covariance/items/items", between(COVARIANCE)),
        ("AuvState.turn_rate_radps", default(0.0)),
        ("Batch", json!({ "additionalProperties": false })),
        ("Batch.requests", list(1, BATCH_MAX)),
        ("Craft.preset", json!({ "pattern": preset })),
        ("Dive.reversal_s", default(Dive::REVERSAL_MEDUSA)),
        ("Goal.auvs", json!({ "minItems": 1, "maxItems": AUVS_MAX, "uniqueItems": true })),
        ("Goal.costs_now/additionalProperties", between(VISIT_COST)),
        ("Goal.serve_by_s/additionalProperties", between(TIME)),
        ("Goal.weights", object(1, AUVS_MAX)),
        ("Goal.weights/additionalProperties", between(WEIGHT)),
        // The minimum depends on the slowest speed.
        ("Limits.speed_max_mps", json!({ "maximum": SPEED_MAX_MOST, "default": Limits::ANY.speed_max })),
        ("Limits.speed_min_mps", default(Limits::ANY.speed_min)),
        ("Live.area", corners.clone()),
        ("Live.auvs", list(1, AUVS_MAX)),
        ("Live.clock_rate", between(check::CLOCK_RATE)),
        ("Live.clock_rate", default(1.0)),
        ("Live.forecast", default(Forecast::default())),
        ("Live.hold", default(Hold::default())),
        ("Live.keep_outs", list(0, KEEP_OUTS_MAX)),
        ("Live.no_go", list(0, NO_GO_MAX)),
        ("Live.period_s", between(check::PERIOD)),
        ("Live.period_s", default(1.0)),
        ("LiveAuv.id", name.clone()),
        ("LiveAuv.id", json!({ "not": { "const": "asc" } })),
        ("LocalisedVehicle.over_time", list(0, FIGURE_ROWS_MAX)),
        ("LocalisedVehicle.over_time/items", list(3, 3)),
        ("NewMission.schema_version", version.clone()),
        ("NewMission.title", json!({ "maxLength": check::TITLE_BYTES_MAX })),
        ("NoGo.holes/items", ring.clone()),
        ("NoGo.name", json!({ "maxLength": ID_LENGTH_MAX })),
        ("NoGo.polygon", ring),
        ("Note.text", note.clone()),
        ("Path.closed", default(false)),
        ("Path.segments", list(1, SEGMENTS_MAX)),
        ("PlanRequest.area", corners.clone()),
        ("PlanRequest.auvs", list(1, AUVS_MAX)),
        ("PlanRequest.deadline_ms", between(DEADLINE_MS)),
        ("PlanRequest.fallback", default(Fallback::default())),
        ("PlanRequest.forecast", default(Forecast::default())),
        ("PlanRequest.hold", default(Hold::default())),
        ("PlanRequest.keep_outs", list(0, KEEP_OUTS_MAX)),
        ("PlanRequest.no_go", list(0, NO_GO_MAX)),
        ("PlanRequest.schema_version", version),
        ("PlanRequest.traffic", list(0, VESSELS_MAX)),
        ("Vessel.plan", list(0, *VESSEL_PLAN_LENGTH.end())),
        ("Vessel.plan/items", list(3, 3)),
        ("Power.cubic_w_per_mps3", default(0.0)),
        ("Power.linear_w_per_mps", default(0.0)),
        ("PreviousPlan.targets", list(0, AUVS_MAX)),
        ("PreviousPlan.trajectory", list(0, TRAJECTORY_POINTS_MAX)),
        ("Assignment.craft", list(0, CRAFT_MAX)),
        ("Assignment.hand_overs", list(0, CRAFT_MAX * AUVS_MAX)),
        ("Assignment.unserved", list(0, AUVS_MAX)),
        ("CraftAssignment.auvs", list(0, AUVS_MAX)),
        ("Reports.asc", at_most(REPORTS_MAX)),
        // Of the service's own answers; a post with them is refused.
        ("Reports.origin", json!({ "readOnly": true })),
        ("Reports.rejected", json!({ "readOnly": true })),
        ("Reports.auvs", json!({ "maxProperties": AUVS_MAX })),
        ("Reports.notes", at_most(REPORTS_MAX)),
        ("Reports.steering", at_most(REPORTS_MAX)),
        ("Reports.traffic", at_most(VESSELS_MAX)),
        ("Run.speed_factor", between(check::SPEED_FACTOR)),
        ("Schedule.costs", list(0, AUVS_MAX)),
        ("Schedule.visits", list(0, VISITS_MAX)),
        ("Segment.angle_rad", between(-ARC_ANGLE_MAX..=ARC_ANGLE_MAX)),
        ("Segment.fillet_m", between(0.0..=LENGTH_MAX)),
        ("Segment.points", json!({ "minItems": 2 })),
        ("Segment.turn_radius_m", between(LENGTH_MIN..=LENGTH_MAX)),
        ("ServedVehicle.served_by_s", between(TIME)),
        ("Setting", object(1, Setting::MEMBERS)),
        ("Setting.area", corners),
        ("Setting.keep_outs", list(0, KEEP_OUTS_MAX)),
        ("Setting.no_go", list(0, NO_GO_MAX)),
        ("Setting.vessel_separation_m", between(VESSEL_SEPARATION)),
        ("Setting.paths", json!({ "maxProperties": AUVS_MAX })),
        ("Steering.why", note),
        ("Step.ticks", between(check::TICKS)),
        ("Step.ticks", default(Step::default().ticks)),
        ("PreviousFleet.surface_craft", list(0, CRAFT_MAX)),
        ("AscReport.battery", between(check::BATTERY)),
        ("LiveCraft.battery_min", between(check::BATTERY)),
        ("SurfaceCraft.id", name.clone()),
        ("SurfaceCraft.serves", list(0, AUVS_MAX)),
        ("Tuning.steps_s", list(*STEPS_COUNT.start(), *STEPS_COUNT.end())),
        ("Tuning.steps_s/items", between(STEP)),
        ("Vessel.id", name),
        ("Vessel.name", json!({ "maxLength": ID_LENGTH_MAX })),
    ]
}
