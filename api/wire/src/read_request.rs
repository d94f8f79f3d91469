//! From a client's JSON to a snapshot.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading},
    craft::{CraftDescription, CraftEstimate},
    los::Reference,
    path::SEGMENTS_MAX,
    snapshot as domain,
    snapshot::{
        AREA_CORNERS, AUVS_MAX, KEEP_OUTS_MAX, Observation, REPORTS_MAX, Snapshot, TRAJECTORY_POINTS_MAX,
        VehicleId,
    },
};
use serde_json::Value;

use super::{
    DEADLINE_MS, METADATA_BYTES_MAX, SCHEMA_VERSION,
    both::{Forecast, TrajectoryPoint},
    craft::{Craft, read_craft},
    field_pointers::length,
    read_evidence, read_goal, read_path,
    request::{Asc, Auv, Dive, Fallback, KeepOut, Limits, PlanRequest, PreviousPlan, PreviousTarget},
};
use crate::FieldError;

impl TryFrom<&PlanRequest> for Snapshot {
    type Error = Vec<FieldError>;

    /// Checks everything that a JSON schema cannot say. Fails with every field that is wrong.
    fn try_from(request: &PlanRequest) -> Result<Self, Vec<FieldError>> {
        let mut invalid = Vec::new();
        // First and alone: the checks behind compare every name with every other.
        bound_lists(request, &mut invalid);
        if !invalid.is_empty() {
            return Err(invalid);
        }
        check_envelope(request, &mut invalid);
        check_angles(request, &mut invalid);
        let ground_velocity = ground_velocity(&request.asc, &mut invalid);
        let auvs = request
            .auvs
            .iter()
            .enumerate()
            .map(|(i, given)| auv(i, given, &mut invalid))
            .collect::<Vec<_>>();
        let craft = craft(request.craft.as_ref(), request.limits.as_ref(), &mut invalid);
        let goal = read_goal::goal(&request.goal, &mut invalid);
        let offset = read_goal::offset(&request.goal, &mut invalid);

        // An AUV of which nothing is known, and a goal that is none, have been said to be wrong.
        let (Some(auvs), Some(goal)) = (auvs.into_iter().collect(), goal) else {
            return Err(invalid);
        };
        let observation = Observation {
            time: request.t_s,
            asc: asc(&request.asc, ground_velocity),
            auvs,
            goal,
            offset,
            current: request.current.map(Vector2::from),
            limits: limits(request.limits.as_ref()),
            craft,
            keep_outs: request.keep_outs.iter().map(keep_out).collect(),
            area: request.area.iter().map(|corner| Vector2::from(*corner)).collect(),
            range_max: request.acoustics.map(|acoustics| acoustics.range_max_m),
            surfacing_separation: request.surfacing_separation_m,
            forecast: forecast(request.forecast),
            fallback: match request.fallback {
                Fallback::Los => domain::Fallback::Los,
                Fallback::None => domain::Fallback::None,
            },
            hold: request.hold.into(),
            previous_plan: request.previous_plan.as_ref().map(previous_plan),
        };
        match Snapshot::try_from(observation) {
            Ok(snapshot) if invalid.is_empty() => Ok(snapshot),
            Ok(_) => Err(invalid),
            Err(domain::InvalidObservation(fields)) => {
                invalid.extend(fields.iter().map(FieldError::from));
                Err(invalid)
            }
        }
    }
}

impl From<&PreviousPlan> for domain::PreviousPlan {
    /// Angles wrap unchecked: from a request, they have been checked before; from an answer of the
    /// service, they are in range.
    fn from(previous: &PreviousPlan) -> Self {
        previous_plan(previous)
    }
}

fn bound_lists(request: &PlanRequest, invalid: &mut Vec<FieldError>) {
    let mut bound = |pointer: &str, given: usize, least: usize, most: usize| {
        if given < least || most < given {
            invalid.push(length(pointer.to_owned(), given, least..=most, "items"));
        }
    };
    bound("/auvs", request.auvs.len(), 1, AUVS_MAX);
    for (i, auv) in request.auvs.iter().enumerate() {
        if let Some(reports) = &auv.reports {
            bound(&format!("/auvs/{i}/reports"), reports.len(), 1, REPORTS_MAX);
        }
        if let Some(path) = &auv.path {
            let n_segments = read_path::count(path);
            bound(&format!("/auvs/{i}/path/segments"), n_segments, 1, SEGMENTS_MAX);
        }
    }
    if let Some(auvs) = &request.goal.auvs {
        bound("/goal/auvs", auvs.len(), 1, AUVS_MAX);
    }
    if let Some(weights) = &request.goal.weights {
        bound("/goal/weights", weights.len(), 1, AUVS_MAX);
    }
    bound("/keep_outs", request.keep_outs.len(), 0, KEEP_OUTS_MAX);
    if !request.area.is_empty() {
        bound(
            "/area",
            request.area.len(),
            *AREA_CORNERS.start(),
            *AREA_CORNERS.end(),
        );
    }
    if let Some(previous) = &request.previous_plan {
        let (n_points, n_targets) = (
            previous.trajectory.len(),
            previous.targets.iter().flatten().count(),
        );
        bound("/previous_plan/trajectory", n_points, 0, TRAJECTORY_POINTS_MAX);
        bound("/previous_plan/targets", n_targets, 0, AUVS_MAX);
    }
}

/// What is wrong with a `schema_version`, wherever one is given.
#[must_use]
pub fn unsupported_version(given: &str) -> Option<FieldError> {
    (given != SCHEMA_VERSION).then(|| {
        let detail = format!("this service speaks version {SCHEMA_VERSION}");
        FieldError::new("/schema_version", "unsupported", detail)
            .given(given)
            .limit(SCHEMA_VERSION)
    })
}

fn check_envelope(request: &PlanRequest, invalid: &mut Vec<FieldError>) {
    invalid.extend(unsupported_version(&request.schema_version));
    if let Some(origin) = &request.origin {
        invalid.extend(origin.wrong("/origin"));
        let previous = request.previous_plan.as_ref().and_then(|plan| plan.origin);
        if previous.is_some_and(|previous| previous != *origin) {
            let detail =
                "the previous plan counts from another origin: leave it out after a change of the origin";
            invalid.push(FieldError::new("/previous_plan/origin", "contradicts", detail));
        }
    }
    let deadline = request.deadline_ms;
    invalid.extend(deadline.and_then(|given| FieldError::outside("/deadline_ms", given, &DEADLINE_MS)));
    let bytes = Value::Object(request.metadata.clone()).to_string().len();
    if METADATA_BYTES_MAX < bytes {
        let pointer = "/metadata".to_owned();
        invalid.push(length(pointer, bytes, 0..=METADATA_BYTES_MAX, "bytes"));
    }
}

/// Headings and courses wrap whatever they are given, so a value in degrees would pass unseen behind
/// this point.
fn check_angles(request: &PlanRequest, invalid: &mut Vec<FieldError>) {
    let mut check =
        |pointer: &str, angle: f64| invalid.extend(FieldError::outside(pointer, angle, &(-TAU..=TAU)));
    check("/asc/heading_rad", request.asc.heading_rad);
    for (i, auv) in request.auvs.iter().enumerate() {
        if let Some(state) = &auv.state {
            check(&format!("/auvs/{i}/state/course_rad"), state.course_rad);
        }
        for (j, report) in auv.reports.iter().flatten().enumerate() {
            if let Some(course) = report.course_rad {
                check(&format!("/auvs/{i}/reports/{j}/course_rad"), course);
            }
        }
    }
    if let Some(previous) = &request.previous_plan {
        if let Some(course) = previous.goal_course_rad {
            check("/previous_plan/goal_course_rad", course);
        }
        if let Some(craft) = &previous.craft_estimate {
            let pointer = "/previous_plan/craft_estimate/asked_heading_rad";
            check(pointer, craft.asked_heading_rad);
        }
        if let Some(heading) = previous.reference.and_then(|reference| reference.heading_rad) {
            check("/previous_plan/reference/heading_rad", heading);
        }
        for (i, point) in previous.trajectory.iter().enumerate() {
            let pointer = format!("/previous_plan/trajectory/{i}/heading_rad");
            check(&pointer, point.heading_rad);
        }
    }
}

fn ground_velocity(asc: &Asc, invalid: &mut Vec<FieldError>) -> Option<Vector2<f64>> {
    let mut missing = |name: &str| {
        let detail = "the two components of the ground velocity come together or not at all";
        invalid.push(FieldError::new(format!("/asc/{name}"), "missing", detail));
        None
    };
    match (asc.ground_north_mps, asc.ground_east_mps) {
        (Some(north), Some(east)) => Some(Vector2::new(north, east)),
        (None, None) => None,
        (Some(_), None) => missing("ground_east_mps"),
        (None, Some(_)) => missing("ground_north_mps"),
    }
}

fn asc(asc: &Asc, ground_velocity: Option<Vector2<f64>>) -> domain::AscState {
    domain::AscState {
        position: Vector2::new(asc.north_m, asc.east_m),
        heading: Heading::new(asc.heading_rad),
        surge: asc.speed_mps,
        sway: asc.sway_mps,
        yaw_rate: asc.yaw_rate_radps,
        ground_velocity,
    }
}

/// The AUV, if it is known where it is; else what is missing or too much goes into `invalid`.
fn auv(i: usize, auv: &Auv, invalid: &mut Vec<FieldError>) -> Option<domain::Auv> {
    let path = auv
        .path
        .as_ref()
        .and_then(|path| read_path::known_path(&format!("/auvs/{i}/path"), path, invalid));
    Some(domain::Auv {
        id: VehicleId(auv.id.clone()),
        evidence: read_evidence::evidence(&format!("/auvs/{i}"), auv, invalid)?,
        path,
        dive: auv.dive.map(dive),
    })
}

fn dive(given: Dive) -> domain::Dive {
    domain::Dive {
        depth_min: given.depth_min_m,
        depth_max: given.depth_max_m,
        pitch: given.pitch_rad,
        reversal: given.reversal_s.unwrap_or(domain::Dive::REVERSAL_MEDUSA),
        descending: given.descending,
    }
}

fn keep_out(disc: &KeepOut) -> domain::KeepOut {
    domain::KeepOut {
        centre: Vector2::new(disc.north_m, disc.east_m),
        radius: disc.radius_m,
    }
}

fn limits(given: Option<&Limits>) -> domain::Limits {
    let default = domain::Limits::ANY;
    let Some(given) = given else { return default };
    domain::Limits {
        speed_min: given.speed_min_mps.unwrap_or(default.speed_min),
        speed_max: given.speed_max_mps.unwrap_or(default.speed_max),
        turn_rate_max: given.turn_rate_max_radps.unwrap_or(default.turn_rate_max),
        acceleration_max: given.acceleration_max_mps2.unwrap_or(default.acceleration_max),
        deceleration_max: given.deceleration_max_mps2.unwrap_or(default.deceleration_max),
    }
}

/// What is said of the craft. Of a request that says nothing of it, limits are taken for what the craft does as well.
fn craft(given: Option<&Craft>, limits: Option<&Limits>, invalid: &mut Vec<FieldError>) -> CraftDescription {
    let said = given.map(|given| read_craft(given, invalid));
    let surge_time_constant = limits.and_then(|limits| limits.surge_lag_s);
    match (said, limits) {
        (Some(said), _) => CraftDescription {
            surge_time_constant: said.surge_time_constant.or(surge_time_constant),
            ..said
        },
        (None, Some(limits)) => CraftDescription {
            heading_rate_max: limits.turn_rate_max_radps,
            acceleration_max: limits.acceleration_max_mps2,
            deceleration_max: limits.deceleration_max_mps2,
            surge_time_constant,
            ..CraftDescription::default()
        },
        (None, None) => CraftDescription::default(),
    }
}

fn forecast(choice: Forecast) -> domain::ForecastChoice {
    use domain::{ForecastChoice, ForecastModel};
    match choice {
        Forecast::Auto => ForecastChoice::Auto,
        Forecast::Hold => ForecastChoice::Model(ForecastModel::Hold),
        Forecast::ConstantVelocity => ForecastChoice::Model(ForecastModel::ConstantVelocity),
        Forecast::ConstantTurn => ForecastChoice::Model(ForecastModel::ConstantTurn),
        Forecast::Path => ForecastChoice::Model(ForecastModel::Path),
    }
}

fn previous_plan(previous: &PreviousPlan) -> domain::PreviousPlan {
    let reference = |speed, heading| Reference {
        speed,
        heading: Heading::new(heading),
    };
    let command = previous
        .reference
        .and_then(|given| Some(reference(given.speed_mps, given.heading_rad?)));
    let craft = previous.craft_estimate.as_ref();
    // Without an estimate of the craft, the command counts as asked through the water.
    let asked = craft.map(|craft| reference(craft.asked_speed_mps, craft.asked_heading_rad));
    let point = |point: &TrajectoryPoint| domain::TrajectoryPoint {
        time: point.t_s,
        position: Vector2::new(point.north_m, point.east_m),
        speed: point.speed_mps,
        heading: Heading::new(point.heading_rad),
    };
    domain::PreviousPlan {
        trajectory: previous.trajectory.iter().map(point).collect(),
        goal_course: previous.goal_course_rad.map(Course::new),
        current: previous.current.map(Vector2::from),
        reference: asked.or(command),
        command,
        craft: craft.and_then(|craft| CraftEstimate::from_memory(&craft.memory)),
        targets: previous
            .targets
            .iter()
            .flatten()
            .filter_map(previous_target)
            .collect(),
    }
}

/// None of one that is not whole.
fn previous_target(target: &PreviousTarget) -> Option<domain::PreviousTarget> {
    let (estimate, drift) = (target.estimate?, target.drift?);
    let domain::ForecastChoice::Model(model) = forecast(target.forecast?) else {
        return None;
    };
    Some(domain::PreviousTarget {
        id: VehicleId(target.id.clone()),
        model,
        report_age: estimate.age_s,
        position: Vector2::new(estimate.north_m, estimate.east_m),
        depth: estimate.depth_m,
        velocity: Vector2::new(estimate.north_mps, estimate.east_mps),
        turn_rate: estimate.turn_rate_radps,
        drift: drift.into(),
    })
}
