//! The saturated line-of-sight law, the analytic tracker that the program is compared with.

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading, angle_of, ned_from_body, wrap},
    forecast::{Motion, SPEED_AT_REST},
    snapshot::{Limits, Snapshot},
};

/// Tuning of the line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LosGains {
    /// Look-ahead distance Δ, m, positive.
    #[doc(alias = "delta")]
    pub look_ahead: f64,
    /// Along-track gain k₃, 1/s, positive.
    #[doc(alias = "k3")]
    pub along_track_gain: f64,
}

/// What a guidance law asks of the inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
}

/// The target's course, held while the target stands still (slower than 0.05 m/s): the course of a
/// vehicle at rest is noise. `held` is the course when it last moved.
#[must_use]
pub fn target_course(target: &Motion, held: Option<Course>) -> Course {
    match held {
        Some(course) if target.velocity.norm() < SPEED_AT_REST => course,
        Some(_) | None => Course::of(&target.velocity),
    }
}

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
    let error = ned_from_body(psi_d).transpose() * (asc.position - target.position);
    let (s, e) = (error.x, error.y);

    let chi_r = (-e / delta).atan();
    let chi = wrap(psi_d + chi_r);
    let u = (u_d * chi_r.cos() - k_3 * s).clamp(limits.speed_min, limits.speed_max);
    let through_water = Course::new(chi).unit() * u - asc.current;

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

/// What the law needs to know of the surface craft and its water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AscNow {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ.
    pub heading: Heading,
    /// Current (north, east), m/s; zero where unknown.
    pub current: Vector2<f64>,
}

impl From<&Snapshot> for AscNow {
    fn from(snapshot: &Snapshot) -> Self {
        Self {
            position: snapshot.asc.position,
            heading: snapshot.asc.heading,
            current: snapshot.current(),
        }
    }
}
