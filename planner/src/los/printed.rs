//! The tracker exactly as its source prints it, to show that it fails.

use crate::{
    facts::{
        angle::{Course, Heading},
        asc::{AscNow, Limits},
        reference::Reference,
    },
    los::{geometry::errors_in_target_frame, law::LosGains},
    predict::motion::Motion,
};

/// Saturated line of sight with the printed sign, cases and heading. **It runs away from its target**: never a
/// controller, only a proof.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)             ψ = ψ_d + atan(−e / Δ)
/// u = 0.05 where u* ≤ 0,   1.5 where 1.5 < u*,   else u* = u_d cos(ψ − ψ_d) + k₃ s
/// ```
/// Source: D. O. Akanji, *Cooperative Motion Control of Autonomous Marine Vehicles for Ocean Observation*,
/// eqs. (37), (38), (42), (49). Where the printed equations contradict each other (which ψ rotates the errors)
/// the reading that works is taken, the target's. The 0.05 and 1.5 m/s are the craft's limits there and here.
/// The course is steered as a heading: there is no current in the printed law.
#[must_use]
pub fn printed_los(
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
    let unlimited = u_d * chi_r.cos() + k_3 * s;
    let speed = if unlimited <= 0.0 {
        limits.speed_min
    } else if limits.speed_max < unlimited {
        limits.speed_max
    } else {
        unlimited
    };
    Reference {
        speed,
        heading: Heading::new(psi_d + chi_r),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use crate::los::flight::Flight;
    use crate::los::flight::miss_after;
    use crate::los::flight::tuning;
    use crate::los::law::LosLaw;

    #[test]
    fn from_behind_it_is_left_behind_and_from_ahead_it_runs_away() {
        let from = |start| {
            let flight = Flight {
                start,
                ..Flight::default()
            };
            miss_after(300, tuning(LosLaw::Printed), &flight)
        };
        // Behind it creeps at 0.05 m/s: 20 m and 300 s of (0.193 − 0.05) m/s.
        let behind = from(Vector2::new(-20.0, 2.0));
        assert!((behind.x + 20.0 + 300.0 * (0.193 - 0.05)).abs() < 0.5, "{behind}");
        // Ahead it soon runs at 1.5 m/s.
        assert!(from(Vector2::new(1.0, 0.0)).x > 300.0);
    }
}
