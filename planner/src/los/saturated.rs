//! Saturated line of sight in the target's frame.

use crate::{
    facts::{
        angle::{Course, wrap},
        asc::{AscNow, Limits},
        reference::Reference,
    },
    los::{
        geometry::{errors_in_target_frame, through_water},
        law::LosGains,
    },
    predict::motion::Motion,
};

/// Saturated line of sight in the target's frame, current compensated.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)                     along-track and cross-track error
/// χ_r    = atan(−e / Δ)          χ = ψ_d + χ_r    course over ground
/// u      = clamp(u_d cos χ_r − k₃ s, u_min, u_max) speed over ground
/// v_w    = u [cos χ, sin χ] − v_c                 the reference: its length and its direction
/// ```
/// Source: D. O. Akanji, *Cooperative Motion Control of Autonomous Marine Vehicles for Ocean
/// Observation*, eqs. (34)–(42), (49). Departures: (s, e) are rotated by the target's course, the
/// sign of k₃ s is negative (as printed the feedback is positive and diverges), and the current is
/// taken off as a vector, because a course is not a heading.
#[must_use]
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use crate::los::flight::Flight;
    use crate::los::flight::miss_after;
    use crate::los::flight::tuning;
    use crate::los::law::LosLaw;

    #[test]
    fn it_settles_on_a_straight_target_in_a_known_current() {
        for current in [Vector2::zeros(), Vector2::new(0.03, 0.12)] {
            let flight = Flight {
                current,
                known: current,
                ..Flight::default()
            };
            let miss = miss_after(600, tuning(LosLaw::SaturatedLos), &flight);
            assert!(miss.norm() < 1e-3, "{miss}");
        }
    }

    #[test]
    fn an_unknown_current_leaves_a_cross_track_error() {
        let flight = Flight {
            current: Vector2::new(0.0, 0.12),
            ..Flight::default()
        };
        let tuning = tuning(LosLaw::SaturatedLos);
        let miss = miss_after(900, tuning, &flight);
        // At rest u sin χ_r = −v_c and u cos χ_r = u_d: tan χ_r = −v_c / u_d, so e = Δ v_c / u_d.
        let e = tuning.gains.look_ahead * 0.12 / flight.target_speed;
        assert!((miss.y - e).abs() < 0.01 * e, "{miss} against {e}");
    }
}
