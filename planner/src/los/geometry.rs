//! Errors in the target's frame, and the reference that makes a velocity over ground.

use crate::{
    facts::{
        angle::{Course, Heading, angle_of, ned_from_body},
        asc::{AscNow, Limits},
        reference::Reference,
    },
    predict::motion::Motion,
};

/// Along-track and cross-track error, m: where the craft is, seen from the target along and across its course,
/// positive ahead and to starboard.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)
/// ```
pub(crate) fn errors_in_target_frame(asc: &AscNow, target: &Motion, target_course: Course) -> [f64; 2] {
    let ned_from_target = ned_from_body(target_course.radians());
    (ned_from_target.transpose() * (asc.position - target.position)).into()
}

/// The reference that moves the craft over ground at speed `u` on `course`, current compensated.
///
/// ```text
/// v_w = u [cos χ, sin χ] − v_c        the reference: its length and its direction
/// ```
/// The direction is χ − β, β the crab that the craft will have there. Every law gets the current that the
/// planner gets: the client's, else ground velocity less velocity through the water, which holds what a
/// measured crab holds and the speed besides; else none.
pub(crate) fn through_water(asc: &AscNow, u: f64, course: Course, limits: &Limits) -> Reference {
    let through_water = course.unit() * u - asc.current;
    let speed = through_water.norm();
    // Where the current alone does the work, no direction is asked for: keep the present one.
    let heading = if speed < f64::EPSILON {
        asc.heading
    } else {
        Heading::new(angle_of(&through_water))
    };
    Reference {
        speed: speed.clamp(limits.speed_min, limits.speed_max),
        heading,
    }
}
