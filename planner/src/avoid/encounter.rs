//! The kind of encounter that two courses make.

use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::facts::angle::{angle_of, wrap};
use crate::facts::traffic::EncounterKind;

/// A course within this of the opposite one is head-on, and so is the bearing, rad: 15°.
const HEAD_ON: f64 = 0.26;

/// The end of the sidelights' sector, from the bow, rad: 112.5° (rule 21).
const ABAFT_THE_BEAM: f64 = 0.625 * PI;

/// Speed below which a vessel has no side, m/s: half a knot.
pub(crate) const SPEED_UNDER_WAY: f64 = 0.25;

/// The encounter of the craft with a vessel at `there` from it, m; `own` is the craft's velocity
/// over ground, m/s. A craft that hardly moves has the course of its bow.
pub(crate) fn kind(own: &Vector2<f64>, there: &Vector2<f64>, velocity: &Vector2<f64>) -> EncounterKind {
    if velocity.norm() < SPEED_UNDER_WAY {
        return EncounterKind::KeepClear;
    }
    let bearing = wrap(angle_of(there) - angle_of(own));
    let back = wrap(angle_of(&-there) - angle_of(velocity));
    let turned = wrap(angle_of(velocity) - angle_of(own));
    let is_slower = velocity.norm() < own.norm();
    if ABAFT_THE_BEAM < back.abs() && is_slower {
        EncounterKind::Overtaking
    } else if ABAFT_THE_BEAM < bearing.abs() {
        EncounterKind::Overtaken
    } else if PI - turned.abs() < HEAD_ON && bearing.abs() < HEAD_ON {
        EncounterKind::HeadOn
    } else if 0.0 < bearing {
        EncounterKind::CrossingGiveWay
    } else {
        EncounterKind::CrossingStandOn
    }
}

/// Least distance of two points that keep their velocities, m, and the time until then, s.
pub(crate) fn closest_approach(there: &Vector2<f64>, velocity: &Vector2<f64>) -> (f64, f64) {
    let square = velocity.norm_squared();
    let time = if square < f64::EPSILON { 0.0 } else { (-there.dot(velocity) / square).max(0.0) };
    ((there + velocity * time).norm(), time)
}
