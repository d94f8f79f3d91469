//! Saturated line of sight in the tracker's frame.

use std::f64::consts::FRAC_PI_2;

use crate::facts::angle::Course;
use crate::facts::asc::{AscNow, Limits};
use crate::facts::bisection::last_at_which;
use crate::facts::reference::Reference;
use crate::los::geometry::{errors_in_target_frame, through_water};
use crate::los::law::LosGains;
use crate::predict::motion::Motion;

/// Bisections of the quarter turn with the relative course: the bits of a double.
const HALVINGS: u32 = 53;

/// Saturated line of sight in the tracker's frame, with the current compensated.
///
/// The frame's origin is the tracker, its first axis the tracker's course over ground χ. The law's
/// course is relative to the frame that it defines, so it is the root of an equation:
///
/// ```text
/// (s, e) = R(χ)ᵀ (p − p_d)                         errors along and across the tracker's course
/// χ      = ψ_d + χ_r,    χ_r = atan(−e(χ_r) / Δ)     course over ground
/// u      = clamp(u_d cos χ_r − k₃ s, u_min, u_max)   speed over ground
/// v_w    = u [cos χ, sin χ] − v_c
/// ```
/// With (s_d, e_d) = R(ψ_d)ᵀ (p − p_d), the errors in the target's frame, the equation is
///
/// ```text
/// Δ sin χ_r = cos χ_r (s_d sin χ_r − e_d cos χ_r)
/// ```
/// It has exactly one root in (−π/2, π/2) with the sign opposite to e_d's, which turns to the
/// track: from −e_d at 0 to Δ at π/2 the difference is concave or monotonic. Far behind, the craft
/// aims at the target (tan χ_r → e_d / s_d); near it, at a point Δ ahead. More than Δ ahead on the
/// track it waits by crossing the track in turn.
///
/// In this frame ṡ = r e + u − u_d cos χ_r and ė = −r s + u_d sin χ_r with r = χ̇; unsaturated
///
/// ```text
/// d/dt ½ (s² + e²) = −k₃ s² − u_d e² / √(e² + Δ²)
/// ```
/// The only equilibrium is s = e = 0, and there χ = ψ_d and u = u_d.
///
/// Source: D. O. Akanji, *Cooperative Motion Control of Autonomous Marine Vehicles for Ocean
/// Observation*, eqs. (44)–(49), whose rates are this frame's. Departures: one frame throughout,
/// the sign of k₃ s in (49), and the current, as in [`saturated_los`](super::saturated_los).
pub fn saturated_los_tracker_frame(
    asc: &AscNow,
    target: &Motion,
    target_course: Course,
    gains: LosGains,
    limits: &Limits,
) -> Reference {
    let (u_d, psi_d) = (target.velocity.norm(), target_course.radians());
    let (delta, k_3) = (gains.look_ahead, gains.along_track_gain);
    let [s_d, e_d] = errors_in_target_frame(asc, target, target_course);

    let chi_r = relative_course(s_d, e_d, delta);
    let s = s_d * chi_r.cos() + e_d * chi_r.sin();
    let u = (u_d * chi_r.cos() - k_3 * s).clamp(limits.speed_min, limits.speed_max);
    through_water(asc, u, Course::new(psi_d + chi_r), limits)
}

/// The root χ_r, by bisection of the quarter turn on the other side of the track.
fn relative_course(s_d: f64, e_d: f64, delta: f64) -> f64 {
    let offset = e_d.abs();
    // Mirrored to e_d ≥ 0 and χ_r = −t: positive before the root, negative after it.
    let before = |t: f64| delta * t.sin() < t.cos() * (offset * t.cos() + s_d * t.sin());
    -e_d.signum() * last_at_which(before, [0.0, FRAC_PI_2], HALVINGS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::los::{
        flight_for_tests::{craft_at, tuning},
        law::LosLaw,
    };
    use crate::tests::prelude::*;

    const POINTS: [(f64, f64); 8] = [
        (-40.0, 20.0),
        (-40.0, -0.1),
        (-3.0, -8.0),
        (0.0, 5.0),
        (1.0, 1.0),
        (12.0, -7.0),
        (40.0, 20.0),
        (0.5, 0.0),
    ];

    #[test]
    fn the_course_is_the_look_ahead_course_in_its_own_frame() {
        for delta in [3.0, 20.0] {
            for (s_d, e_d) in POINTS {
                let chi_r = relative_course(s_d, e_d, delta);
                let e = -s_d * chi_r.sin() + e_d * chi_r.cos();
                near(chi_r, (-e / delta).atan(), 1e-9);
                assert!(chi_r * e_d <= 0.0, "turned to the track");
            }
        }
    }

    #[test]
    fn the_distance_decreases_at_the_proved_rate() {
        let (delta, k_3, u_d) = (10.0, 0.1, 0.193);
        for (s_d, e_d) in POINTS {
            let chi_r = relative_course(s_d, e_d, delta);
            let [s, e] = (ned_from_body(chi_r).transpose() * Vector2::new(s_d, e_d)).into();
            // Second route to the rate of ½ (s² + e²): from velocities in the target's frame.
            let u = u_d * chi_r.cos() - k_3 * s;
            let rate = s_d * (u * chi_r.cos() - u_d) + e_d * u * chi_r.sin();
            near(rate, -k_3 * s * s - u_d * e * e / f64::hypot(e, delta), 1e-9);
        }
    }

    #[test]
    fn a_craft_far_behind_aims_at_the_target_and_a_near_one_ahead_of_it() {
        near(relative_course(-1e6, 5e5, 5.0), -0.5_f64.atan(), 1e-4);
        // Just abreast: as in the target's frame, where (s, e) differ in second order only.
        near(relative_course(0.0, 1e-3, 5.0), -1e-3 / 5.0, 1e-9);
    }

    #[test]
    fn at_the_target_the_reference_is_the_target_s_motion() {
        let target = Motion { position: Vector2::new(7.0, -3.0), velocity: Vector2::new(-0.1, 0.15) };
        let asc = craft_at(target.position, 2.0);
        let (gains, course) = (tuning(LosLaw::TrackerFrame).gains, Course::of(&target.velocity));
        let reference = saturated_los_tracker_frame(&asc, &target, course, gains, &Limits::MEDUSA);
        near_to(reference.heading.unit() * reference.speed, target.velocity, 1e-12);
    }
}
