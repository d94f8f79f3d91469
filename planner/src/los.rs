//! Line-of-sight laws: analytic trackers that the program is compared with. The first of them is also its
//! seed and a rung of its ladder.
//!
//! Each law is a pure function in a file of its own. [`TrackingLaw`] holds what a law remembers from one look
//! to the next, so that whoever holds it (a simulated mission, a rollout) holds the memory.

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading, angle_of, ned_from_body},
    forecast::{Motion, SPEED_AT_REST},
    snapshot::{Limits, Snapshot},
};

mod integral;
mod printed;
mod saturated;
mod tracker_frame;
mod tracking_law;
mod waypoint_box;

pub use integral::{IntegralState, integral_los};
pub use printed::printed_los;
pub use saturated::saturated_los;
pub use tracker_frame::saturated_los_tracker_frame;
pub use tracking_law::TrackingLaw;
pub use waypoint_box::WaypointBox;

/// The laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LosLaw {
    /// [`saturated_los`]: errors in the target's frame.
    SaturatedLos,
    /// [`saturated_los_tracker_frame`]: errors in the tracker's frame.
    TrackerFrame,
    /// [`integral_los`]: with an integral of the cross-track error.
    Integral,
    /// [`WaypointBox`]: round a box about the target's last fixes.
    WaypointBox,
    /// [`printed_los`]: as its source prints it. It runs away from the target.
    Printed,
}

impl LosLaw {
    /// Every law, the one of the ladder first.
    pub const ALL: [Self; 5] = [
        Self::SaturatedLos,
        Self::TrackerFrame,
        Self::Integral,
        Self::WaypointBox,
        Self::Printed,
    ];

    /// Its name wherever it leaves the program.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SaturatedLos => "saturated_los",
            Self::TrackerFrame => "saturated_los_tracker_frame",
            Self::Integral => "integral_los",
            Self::WaypointBox => "waypoint_box",
            Self::Printed => "printed_los",
        }
    }

    /// Whether it may win a comparison. What is shown because it fails never does.
    #[must_use]
    pub fn may_win(self) -> bool {
        self != Self::Printed
    }
}

/// Gains of a line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LosGains {
    /// Look-ahead distance Δ, m, positive.
    #[doc(alias = "delta")]
    pub look_ahead: f64,
    /// Along-track gain k₃, 1/s, positive.
    #[doc(alias = "k3")]
    pub along_track_gain: f64,
}

/// A law with all its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LosTuning {
    /// The law.
    pub law: LosLaw,
    /// Gains that every law has.
    pub gains: LosGains,
    /// Integral gain σ, m/s, positive: [`LosLaw::Integral`]'s, and no other's.
    #[doc(alias = "sigma")]
    pub integral_gain: f64,
}

/// What a guidance law asks of the inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
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

/// The target's course, held while the target stands still (slower than 0.05 m/s): the course of a
/// vehicle at rest is noise. `held` is the course when it last moved.
#[must_use]
pub fn target_course(target: &Motion, held: Option<Course>) -> Course {
    match held {
        Some(course) if target.velocity.norm() < SPEED_AT_REST => course,
        Some(_) | None => Course::of(&target.velocity),
    }
}

/// Along-track and cross-track error, m: where the craft is, seen from the target along and across its course,
/// positive ahead and to starboard.
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)
/// ```
fn errors_in_target_frame(asc: &AscNow, target: &Motion, target_course: Course) -> [f64; 2] {
    let ned_from_target = ned_from_body(target_course.radians());
    (ned_from_target.transpose() * (asc.position - target.position)).into()
}

/// The reference that moves the craft over ground at speed `u` on `course`, current compensated.
///
/// ```text
/// v_w = u [cos χ, sin χ] − v_c        the reference: its length and its direction
/// ```
/// The direction is χ − β, β the crab that the craft will have there. Every law is told the current that the
/// planner is told: the client's, else ground velocity less velocity through the water, which holds what a
/// measured crab holds and the speed besides; else none.
fn through_water(asc: &AscNow, u: f64, course: Course, limits: &Limits) -> Reference {
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

#[cfg(test)]
mod flight;
