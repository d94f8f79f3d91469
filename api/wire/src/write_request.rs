//! From a snapshot to the request that means it: what a Rust client posts, and what a plan is named by.

use std::fmt::Write as _;

use nalgebra::{Matrix4, Vector2};
use planner::{
    path,
    snapshot::{self as facts, Evidence, ForecastChoice, ForecastModel, Snapshot},
};
use serde_json::Map;
use sha2::{Digest, Sha256};

use super::{
    SCHEMA_VERSION,
    both::{Current, Drift, Forecast, TrajectoryPoint},
    craft::Craft,
    request::{
        Acoustics, Asc, Auv, AuvState, Dive, Fallback, Goal, GoalKind, KeepOut, Limits, Offset, OffsetFrame,
        Path, PlanRequest, PreviousCraft, PreviousEstimate, PreviousPlan, PreviousReference, PreviousTarget,
        Report, Segment, SegmentKind,
    },
};

/// SHA-256 of the snapshot as this crate writes it, hexadecimal.
#[must_use]
pub fn plan_id(snapshot: &Snapshot) -> String {
    let canonical =
        serde_json::to_vec(&PlanRequest::from(snapshot)).expect("strings, numbers and lists only");
    sha256(&canonical)
}

/// SHA-256, hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in Sha256::digest(bytes) {
        write!(text, "{byte:02x}").expect("a string takes everything");
    }
    text
}

impl From<&Snapshot> for PlanRequest {
    /// The request that means this snapshot, every default spelled out.
    fn from(snapshot: &Snapshot) -> Self {
        Self {
            schema_version: SCHEMA_VERSION.to_owned(),
            t_s: snapshot.time,
            origin: None,
            asc: asc(&snapshot.asc),
            auvs: snapshot.auvs.iter().map(auv).collect(),
            goal: Goal {
                offset: snapshot.offset.as_ref().map(offset),
                ..goal(&snapshot.goal)
            },
            current: snapshot.current.map(Current::from),
            limits: Some(limits(&snapshot.limits)),
            craft: Some(Craft::from(&snapshot.craft)),
            keep_outs: snapshot.keep_outs.iter().map(keep_out).collect(),
            area: snapshot.area.iter().map(|corner| [corner.x, corner.y]).collect(),
            acoustics: snapshot.range_max.map(|range_max_m| Acoustics { range_max_m }),
            surfacing_separation_m: snapshot.surfacing_separation,
            forecast: match snapshot.forecast {
                ForecastChoice::Auto => Forecast::Auto,
                ForecastChoice::Model(model) => Forecast::from(model),
            },
            fallback: match snapshot.fallback {
                facts::Fallback::Los => Fallback::Los,
                facts::Fallback::None => Fallback::None,
            },
            hold: snapshot.hold.into(),
            deadline_ms: None,
            previous_plan: snapshot.previous_plan.as_ref().map(PreviousPlan::from),
            metadata: Map::new(),
        }
    }
}

impl From<&facts::PreviousPlan> for PreviousPlan {
    fn from(previous: &facts::PreviousPlan) -> Self {
        Self {
            origin: None,
            trajectory: previous.trajectory.iter().map(TrajectoryPoint::from).collect(),
            goal_course_rad: previous.goal_course.map(planner::angle::Course::radians),
            craft_estimate: previous
                .reference
                .zip(previous.craft)
                .map(|(reference, craft)| PreviousCraft {
                    asked_speed_mps: reference.speed,
                    asked_heading_rad: reference.heading.radians(),
                    memory: craft.memory().to_vec(),
                }),
            current: previous.current.map(Current::from),
            reference: previous.command.map(|reference| PreviousReference {
                speed_mps: reference.speed,
                heading_rad: Some(reference.heading.radians()),
            }),
            targets: Some(previous.targets.iter().map(PreviousTarget::from).collect()),
        }
    }
}

impl From<ForecastModel> for Forecast {
    fn from(model: ForecastModel) -> Self {
        match model {
            ForecastModel::Hold => Self::Hold,
            ForecastModel::ConstantVelocity => Self::ConstantVelocity,
            ForecastModel::ConstantTurn => Self::ConstantTurn,
            ForecastModel::Path => Self::Path,
        }
    }
}

impl From<&facts::PreviousTarget> for PreviousTarget {
    fn from(target: &facts::PreviousTarget) -> Self {
        Self {
            id: target.id.0.clone(),
            estimate: Some(PreviousEstimate {
                age_s: target.report_age,
                north_m: target.position.x,
                east_m: target.position.y,
                depth_m: target.depth,
                north_mps: target.velocity.x,
                east_mps: target.velocity.y,
                turn_rate_radps: target.turn_rate,
            }),
            forecast: Some(Forecast::from(target.model)),
            drift: Some(Drift::from(target.drift)),
        }
    }
}

fn asc(asc: &facts::AscState) -> Asc {
    Asc {
        north_m: asc.position.x,
        east_m: asc.position.y,
        lat_deg: None,
        lon_deg: None,
        heading_rad: asc.heading.radians(),
        speed_mps: asc.surge,
        sway_mps: asc.sway,
        yaw_rate_radps: asc.yaw_rate,
        ground_north_mps: asc.ground_velocity.map(|v| v.x),
        ground_east_mps: asc.ground_velocity.map(|v| v.y),
    }
}

fn auv(auv: &facts::Auv) -> Auv {
    let (state, reports) = match &auv.evidence {
        Evidence::State(known) => (Some(state(known)), None),
        Evidence::Reports(known) => (None, Some(known.iter().map(report).collect())),
    };
    Auv {
        id: auv.id.0.clone(),
        state,
        reports,
        path: auv.path.as_ref().map(path),
        dive: auv.dive.map(dive),
    }
}

fn dive(known: facts::Dive) -> Dive {
    Dive {
        depth_min_m: known.depth_min,
        depth_max_m: known.depth_max,
        pitch_rad: known.pitch,
        reversal_s: Some(known.reversal),
        descending: known.descending,
    }
}

fn state(state: &facts::AuvState) -> AuvState {
    AuvState {
        north_m: state.position.x,
        east_m: state.position.y,
        lat_deg: None,
        lon_deg: None,
        depth_m: state.depth,
        course_rad: state.course.radians(),
        speed_mps: state.speed,
        turn_rate_radps: state.turn_rate,
        age_s: state.age,
        covariance: state.covariance.as_ref().map(rows),
    }
}

fn report(report: &facts::Report) -> Report {
    Report {
        t_s: report.time,
        north_m: report.position.x,
        east_m: report.position.y,
        lat_deg: None,
        lon_deg: None,
        sigma_m: report.sigma,
        depth_m: report.depth,
        course_rad: report.ground_track.map(|track| track.course.radians()),
        speed_mps: report.ground_track.map(|track| track.speed),
        turn_rate_radps: report.turn_rate,
    }
}

/// A matrix as JSON has it.
pub(super) fn rows(matrix: &Matrix4<f64>) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

fn path(known: &facts::KnownPath) -> Path {
    Path {
        segments: known.path.segments().iter().map(segment).collect(),
        closed: known.path.is_closed(),
        speed_mps: known.horizontal_speed,
    }
}

fn segment(segment: &path::Segment) -> Segment {
    let pair = |point: &Vector2<f64>| [point.x, point.y];
    let bare = |kind| Segment {
        kind,
        from: None,
        to: None,
        centre: None,
        angle_rad: None,
        points: None,
        fillet_m: None,
    };
    match segment {
        path::Segment::Line { from, to } => Segment {
            from: Some(pair(from)),
            to: Some(pair(to)),
            ..bare(SegmentKind::Line)
        },
        path::Segment::Arc { from, centre, angle } => Segment {
            from: Some(pair(from)),
            centre: Some(pair(centre)),
            angle_rad: Some(*angle),
            ..bare(SegmentKind::Arc)
        },
        path::Segment::Waypoints {
            points,
            fillet_radius,
        } => Segment {
            points: Some(points.iter().map(pair).collect()),
            fillet_m: Some(*fillet_radius),
            ..bare(SegmentKind::Waypoints)
        },
    }
}

fn goal(goal: &facts::Goal) -> Goal {
    let names = |ids: &[facts::VehicleId]| Some(ids.iter().map(|id| id.0.clone()).collect());
    let bare = |kind| Goal {
        kind,
        auv: None,
        auvs: None,
        dwell_s: None,
        epoch_s: None,
        weights: None,
        range_m: None,
        offset: None,
    };
    match goal {
        facts::Goal::Track { auv } => Goal {
            auv: Some(auv.0.clone()),
            ..bare(GoalKind::Track)
        },
        facts::Goal::Intermittent { auvs, dwell, epoch } => Goal {
            auvs: names(auvs),
            dwell_s: Some(*dwell),
            epoch_s: Some(*epoch),
            ..bare(GoalKind::Intermittent)
        },
        facts::Goal::Midpoint { auvs } => Goal {
            auvs: names(auvs),
            ..bare(GoalKind::Midpoint)
        },
        facts::Goal::Weighted { weights } => Goal {
            weights: Some(
                weights
                    .iter()
                    .map(|(id, weight)| (id.0.clone(), *weight))
                    .collect(),
            ),
            ..bare(GoalKind::Weighted)
        },
        facts::Goal::Range { auvs, radius } => Goal {
            auvs: names(auvs),
            range_m: Some(*radius),
            ..bare(GoalKind::Range)
        },
    }
}

fn offset(offset: &facts::Offset) -> Offset {
    let (frame, by) = match offset {
        facts::Offset::Ned(by) => (OffsetFrame::Ned, by),
        facts::Offset::Target(by) => (OffsetFrame::Target, by),
        facts::Offset::Path(by) => (OffsetFrame::Path, by),
    };
    let fixed = frame == OffsetFrame::Ned;
    Offset {
        frame,
        north_m: fixed.then_some(by.x),
        east_m: fixed.then_some(by.y),
        ahead_m: (!fixed).then_some(by.x),
        starboard_m: (!fixed).then_some(by.y),
        range_m: None,
        bearing_rad: None,
    }
}

/// A disc as a request gives it.
#[must_use]
pub fn keep_out(disc: &facts::KeepOut) -> KeepOut {
    KeepOut {
        north_m: disc.centre.x,
        east_m: disc.centre.y,
        lat_deg: None,
        lon_deg: None,
        radius_m: disc.radius,
    }
}

fn limits(limits: &facts::Limits) -> Limits {
    Limits {
        speed_min_mps: Some(limits.speed_min),
        speed_max_mps: Some(limits.speed_max),
        turn_rate_max_radps: Some(limits.turn_rate_max),
        acceleration_max_mps2: Some(limits.acceleration_max),
        deceleration_max_mps2: Some(limits.deceleration_max),
        surge_lag_s: None,
    }
}
