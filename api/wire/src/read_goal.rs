//! From a goal in a client's JSON to what the surface craft is to do, and where, seen from there.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{
    angle::direction,
    snapshot::{self as domain, OFFSET_MAX, VehicleId},
};

use super::{
    field_pointers::{members_fit, present},
    request::{Goal, GoalKind, OffsetFrame},
};
use crate::FieldError;

/// The goal, if every member that its kind needs is there; what is missing or too much goes into `invalid`.
pub(super) fn goal(goal: &Goal, invalid: &mut Vec<FieldError>) -> Option<domain::Goal> {
    let needed: &[&str] = match goal.kind {
        GoalKind::Track => &["auv"],
        GoalKind::Intermittent => &["auvs", "dwell_s", "epoch_s"],
        GoalKind::Midpoint => &["auvs"],
        GoalKind::Weighted => &["weights"],
        GoalKind::Range => &["auvs", "range_m"],
    };
    let present = present!(goal; auv, auvs, dwell_s, epoch_s, weights, range_m);
    members_fit("/goal", "goal", needed, &present, invalid);
    let auvs = || Some(goal.auvs.as_ref()?.iter().cloned().map(VehicleId).collect());
    Some(match goal.kind {
        GoalKind::Track => domain::Goal::Track {
            auv: VehicleId(goal.auv.clone()?),
        },
        GoalKind::Intermittent => domain::Goal::Intermittent {
            auvs: auvs()?,
            dwell: goal.dwell_s?,
            epoch: goal.epoch_s?,
        },
        GoalKind::Midpoint => domain::Goal::Midpoint { auvs: auvs()? },
        GoalKind::Weighted => domain::Goal::Weighted {
            weights: goal
                .weights
                .as_ref()?
                .iter()
                .map(|(id, weight)| (VehicleId(id.clone()), *weight))
                .collect(),
        },
        GoalKind::Range => domain::Goal::Range {
            auvs: auvs()?,
            radius: goal.range_m?,
        },
    })
}

/// The goal's offset, where it has one and every member that its frame needs is there; else what is wrong goes into
/// `invalid`.
pub(super) fn offset(goal: &Goal, invalid: &mut Vec<FieldError>) -> Option<domain::Offset> {
    let offset = goal.offset.as_ref()?;
    let needed: &[&str] = match offset.frame {
        OffsetFrame::Ned => &["north_m", "east_m"],
        OffsetFrame::Target | OffsetFrame::Path => &["ahead_m", "starboard_m"],
        OffsetFrame::Polar => &["range_m", "bearing_rad"],
    };
    let present = present!(offset; north_m, east_m, ahead_m, starboard_m, range_m, bearing_rad);
    if !members_fit("/goal/offset", "offset", needed, &present, invalid) {
        return None;
    }
    let along_course = || Some(Vector2::new(offset.ahead_m?, offset.starboard_m?));
    Some(match offset.frame {
        OffsetFrame::Ned => domain::Offset::Ned(Vector2::new(offset.north_m?, offset.east_m?)),
        OffsetFrame::Target => domain::Offset::Target(along_course()?),
        OffsetFrame::Path => domain::Offset::Path(along_course()?),
        OffsetFrame::Polar => domain::Offset::Ned(polar(offset.range_m?, offset.bearing_rad?, invalid)),
    })
}

/// Its bearing is lost behind this point, so that it is checked here.
fn polar(range: f64, bearing: f64, invalid: &mut Vec<FieldError>) -> Vector2<f64> {
    invalid.extend(FieldError::outside(
        "/goal/offset/range_m",
        range,
        &(0.0..=OFFSET_MAX),
    ));
    invalid.extend(FieldError::outside(
        "/goal/offset/bearing_rad",
        bearing,
        &(-TAU..=TAU),
    ));
    direction(bearing) * range.clamp(0.0, OFFSET_MAX)
}
