//! Saturated line of sight in the target's frame.

use crate::facts::angle::{Course, wrap};
use crate::facts::asc::{AscNow, Limits};
use crate::facts::reference::Reference;
use crate::los::geometry::{errors_in_target_frame, through_water};
use crate::los::law::LosGains;
use crate::predict::motion::Motion;

/// Saturated line of sight in the target's frame, with the current compensated.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)                     along-track and cross-track error
/// χ_r    = atan(−e / Δ)          χ = ψ_d + χ_r    course over ground
/// u      = clamp(u_d cos χ_r − k₃ s, u_min, u_max) speed over ground
/// v_w    = u [cos χ, sin χ] − v_c                 the reference: its length and its direction
/// ```
/// Source: D. O. Akanji, *Cooperative Motion Control of Autonomous Marine Vehicles for Ocean
/// Observation*, eqs. (34)–(42), (49). Departures: (s, e) are rotated by the target's course; k₃ s
/// is negative (as printed the feedback is positive and diverges); the current is subtracted as a
/// vector, since a course is not a heading.
pub fn saturated_los(
    asc: &AscNow,
    target: &Motion,
    target_course: Course,
    gains: LosGains,
    limits: &Limits,
) -> Reference {
    let (u_d, psi_d) = (target.velocity.norm(), target_course.radians());
    let (delta, k_3) = (gains.look_ahead, gains.along_track_gain);
    let [s, e] = errors_in_target_frame(asc, target, target_course);

    let chi_r = (-e / delta).atan();
    let chi = wrap(psi_d + chi_r);
    let u = (u_d * chi_r.cos() - k_3 * s).clamp(limits.speed_min, limits.speed_max);
    through_water(asc, u, Course::new(chi), limits)
}
