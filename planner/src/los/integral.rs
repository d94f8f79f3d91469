//! Integral line of sight.

use crate::facts::angle::Course;
use crate::facts::asc::{AscNow, Limits};
use crate::facts::reference::Reference;
use crate::los::geometry::{errors_in_target_frame, through_water};
use crate::los::law::LosTuning;
use crate::predict::motion::Motion;

/// Longest interval of the error's integration, s: twice that of plans.
const GAP_MAX: f64 = 2.0;

/// The integral of the cross-track error, bounded in its rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegralState {
    /// The integral z, s: near the track, of the cross-track error in look-ahead distances.
    pub integral: f64,
    /// Time of the last step, s.
    pub looked_at: Option<f64>,
}

/// Saturated line of sight in the target's frame with an integral of the cross-track error.
///
/// ```text
/// χ = ψ_d − atan((e + σ z) / Δ)                    course, or heading if no current is known
/// ż = Δ e / ((e + σ z)² + Δ²)                       bounded, which prevents windup far away
/// u = clamp(u_d cos(atan(e / Δ)) − k₃ s, u_min, u_max)
/// ```
/// In a constant cross-track current v_c it settles at e = 0 with (σ z / Δ) = v_c / √(u² − v_c²).
/// The speed has no integral: an unknown current leaves s = (u_d − u) / k₃, u cos β + v_c∥ = u_d.
/// Source: E. Børhaug, A. Pavlov, K. Y. Pettersen, *Integral LOS control for path following of
/// underactuated marine surface vessels in the presence of constant ocean currents*, IEEE CDC 2008;
/// T. I. Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control*, 2nd ed., chapter 12.
/// Departures: the path is the line through the target along its course and turns with it; the
/// speed is that of [`saturated_los`](super::saturated_los), reduced by the cross-track error
/// alone, since a crab angle is no error; a known current is subtracted first.
pub fn integral_los(
    time: f64,
    asc: &AscNow,
    target: &Motion,
    target_course: Course,
    tuning: &LosTuning,
    limits: &Limits,
    state: &mut IntegralState,
) -> Reference {
    let (u_d, psi_d) = (target.velocity.norm(), target_course.radians());
    let (delta, k_3) = (tuning.gains.look_ahead, tuning.gains.along_track_gain);
    let sigma = tuning.integral_gain;
    let [s, e] = errors_in_target_frame(asc, target, target_course);

    let elapsed = state.looked_at.map_or(0.0, |before| time - before);
    state.looked_at = Some(time);
    let shifted = e + sigma * state.integral;
    // A clock set back integrates nothing.
    state.integral += elapsed.clamp(0.0, GAP_MAX) * delta * e / (shifted * shifted + delta * delta);

    let chi_r = -((e + sigma * state.integral) / delta).atan();
    let u = (u_d * (e / delta).atan().cos() - k_3 * s).clamp(limits.speed_min, limits.speed_max);
    through_water(asc, u, Course::new(psi_d + chi_r), limits)
}

#[cfg(test)]
mod tests {
    use crate::los::flight_for_tests::{Flight, miss_after, tuning};
    use crate::los::law::LosLaw;
    use crate::tests::prelude::*;

    #[test]
    fn the_integral_rejects_an_unknown_cross_current() {
        let flight = Flight { current: Vector2::new(0.0, 0.12), ..Flight::default() };
        let cross_track = |law| miss_after(1800, tuning(law), &flight).y.abs();
        let (with, without) = (cross_track(LosLaw::Integral), cross_track(LosLaw::SaturatedLos));
        // At rest u sin χ_r = −v_c and u cos χ_r = u_d: tan χ_r = −v_c / u_d, so e = Δ v_c / u_d.
        let e = tuning(LosLaw::SaturatedLos).gains.look_ahead * 0.12 / flight.target_speed;
        assert!(with < 0.01, "{with}");
        near(without, e, 0.01 * e);
    }

    #[test]
    fn an_unknown_current_along_the_track_leaves_an_along_track_error() {
        let flight = Flight { current: Vector2::new(0.05, 0.0), ..Flight::default() };
        let tuning = tuning(LosLaw::Integral);
        // u + v_c = u_d and u = u_d − k₃ s: s = v_c / k₃.
        let s = 0.05 / tuning.gains.along_track_gain;
        near(miss_after(1800, tuning, &flight).x, s, 0.01);
    }
}
