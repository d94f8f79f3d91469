//! From a goal in a client's JSON to what the surface craft is to do, and where, seen from there.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{
    angle::direction,
    snapshot::{self as domain, OFFSET_MAX, VehicleId},
};

use super::{
    field_pointers::{members_fit, out_of_range},
    request::{Goal, GoalKind, Offset, OffsetFrame},
};
use crate::FieldError;

/// The goal, if every member that its kind needs is there; what is missing or too much goes into `invalid`.
pub(super) fn goal(goal: &Goal, invalid: &mut Vec<FieldError>) -> Option<domain::Goal> {
    let Goal {
        kind,
        auv,
        auvs,
        dwell_s,
        epoch_s,
        weights,
        range_m,
        offset: _,
    } = goal;
    let needed: &[&str] = match kind {
        GoalKind::Track => &["auv"],
        GoalKind::Intermittent => &["auvs", "dwell_s", "epoch_s"],
        GoalKind::Midpoint => &["auvs"],
        GoalKind::Weighted => &["weights"],
        GoalKind::Range => &["auvs", "range_m"],
    };
    let present = [
        ("auv", auv.is_some()),
        ("auvs", auvs.is_some()),
        ("dwell_s", dwell_s.is_some()),
        ("epoch_s", epoch_s.is_some()),
        ("weights", weights.is_some()),
        ("range_m", range_m.is_some()),
    ];
    members_fit("/goal", "goal", needed, &present, invalid);
    let names = |ids: &[String]| ids.iter().cloned().map(VehicleId).collect();
    Some(match kind {
        GoalKind::Track => domain::Goal::Track {
            auv: VehicleId(auv.clone()?),
        },
        GoalKind::Intermittent => domain::Goal::Intermittent {
            auvs: names(auvs.as_ref()?),
            dwell: (*dwell_s)?,
            epoch: (*epoch_s)?,
        },
        GoalKind::Midpoint => domain::Goal::Midpoint {
            auvs: names(auvs.as_ref()?),
        },
        GoalKind::Weighted => domain::Goal::Weighted {
            weights: weights
                .as_ref()?
                .iter()
                .map(|(id, weight)| (VehicleId(id.clone()), *weight))
                .collect(),
        },
        GoalKind::Range => domain::Goal::Range {
            auvs: names(auvs.as_ref()?),
            radius: (*range_m)?,
        },
    })
}

/// The goal's offset, where it has one and every member that its frame needs is there; else what is wrong goes into
/// `invalid`.
pub(super) fn offset(goal: &Goal, invalid: &mut Vec<FieldError>) -> Option<domain::Offset> {
    let Offset {
        frame,
        north_m,
        east_m,
        ahead_m,
        starboard_m,
        range_m,
        bearing_rad,
    } = goal.offset.as_ref()?;
    let needed: &[&str] = match frame {
        OffsetFrame::Ned => &["north_m", "east_m"],
        OffsetFrame::Target | OffsetFrame::Path => &["ahead_m", "starboard_m"],
        OffsetFrame::Polar => &["range_m", "bearing_rad"],
    };
    let present = [
        ("north_m", north_m.is_some()),
        ("east_m", east_m.is_some()),
        ("ahead_m", ahead_m.is_some()),
        ("starboard_m", starboard_m.is_some()),
        ("range_m", range_m.is_some()),
        ("bearing_rad", bearing_rad.is_some()),
    ];
    if !members_fit("/goal/offset", "offset", needed, &present, invalid) {
        return None;
    }
    let pair = |first: &Option<f64>, second: &Option<f64>| Some(Vector2::new((*first)?, (*second)?));
    Some(match frame {
        OffsetFrame::Ned => domain::Offset::Ned(pair(north_m, east_m)?),
        OffsetFrame::Target => domain::Offset::Target(pair(ahead_m, starboard_m)?),
        OffsetFrame::Path => domain::Offset::Path(pair(ahead_m, starboard_m)?),
        OffsetFrame::Polar => domain::Offset::Ned(polar((*range_m)?, (*bearing_rad)?, invalid)),
    })
}

/// Its bearing is lost behind this point, so that it is checked here.
fn polar(range: f64, bearing: f64, invalid: &mut Vec<FieldError>) -> Vector2<f64> {
    for (name, value, least, most) in [
        ("range_m", range, 0.0, OFFSET_MAX),
        ("bearing_rad", bearing, -TAU, TAU),
    ] {
        if !(least..=most).contains(&value) {
            invalid.push(out_of_range(format!("/goal/offset/{name}"), value, least, most));
        }
    }
    direction(bearing) * range.clamp(0.0, OFFSET_MAX)
}
