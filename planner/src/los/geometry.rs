//! Errors in the target's frame, and the reference for a velocity over ground.

use crate::facts::angle::{Course, Heading, angle_of, ned_from_body};
use crate::facts::asc::{AscNow, Limits};
use crate::facts::reference::Reference;
use crate::predict::motion::Motion;

/// Along-track and cross-track error of the craft, m, positive ahead and to starboard.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)
/// ```
pub(crate) fn errors_in_target_frame(asc: &AscNow, target: &Motion, target_course: Course) -> [f64; 2] {
    let ned_from_target = ned_from_body(target_course.radians());
    (ned_from_target.transpose() * (asc.position - target.position)).into()
}

/// Reference for speed `u` over ground on `course`, with the current compensated.
///
/// ```text
/// v_w = u [cos χ, sin χ] − v_c        the reference: its length and its direction
/// ```
/// The direction is χ − β with the craft's crab angle β. Every law gets the planner's current; the
/// apparent one contains a measured crab angle and its speed.
pub(crate) fn through_water(asc: &AscNow, u: f64, course: Course, limits: &Limits) -> Reference {
    let through_water = course.unit() * u - asc.current;
    let speed = through_water.norm();
    // If the current alone suffices, the heading is arbitrary: keep the present one.
    let heading = if speed < f64::EPSILON { asc.heading } else { Heading::new(angle_of(&through_water)) };
    Reference { speed: speed.clamp(limits.speed_min, limits.speed_max), heading }
}
