//! The surface craft now, and what the operator allows it.

use nalgebra::Vector2;

use crate::facts::angle::{Heading, ned_from_body};

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

/// State of the surface craft.
#[derive(Clone, Debug, PartialEq)]
pub struct AscState {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ.
    pub heading: Heading,
    /// Surge speed through the water, m/s, positive ahead.
    pub surge: f64,
    /// Sway speed through the water, m/s, positive to starboard.
    pub sway: f64,
    /// Yaw rate, rad/s, positive clockwise seen from above.
    pub yaw_rate: f64,
    /// Velocity over ground (north, east), m/s, where a GNSS receiver gives it.
    pub ground_velocity: Option<Vector2<f64>>,
}

impl AscState {
    /// A craft at `position` (north, east), m, that moves ahead at `surge`, m/s, through the water, as far as is known: its
    /// sway and yaw rate are 0, and no receiver gives its velocity over ground.
    #[must_use]
    pub fn new(position: Vector2<f64>, heading: Heading, surge: f64) -> Self {
        Self {
            position,
            heading,
            surge,
            sway: 0.0,
            yaw_rate: 0.0,
            ground_velocity: None,
        }
    }

    /// Velocity through the water (north, east), m/s.
    #[must_use]
    pub fn water_velocity(&self) -> Vector2<f64> {
        ned_from_body(self.heading.radians()) * Vector2::new(self.surge, self.sway)
    }

    /// Current (north, east), m/s, that velocity over ground less velocity through the water leaves, be it possible
    /// or not.
    #[must_use]
    pub fn apparent_current(&self) -> Option<Vector2<f64>> {
        Some(self.ground_velocity? - self.water_velocity())
    }
}

/// What the operator allows the surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Slowest speed reference through the water, m/s: below it the craft does not steer.
    pub speed_min: f64,
    /// Fastest speed reference through the water, m/s.
    pub speed_max: f64,
    /// Largest yaw rate, rad/s.
    pub turn_rate_max: f64,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: f64,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: f64,
}

impl Limits {
    /// No limit but a small craft's speeds: it may turn and gather way as it can.
    pub const ANY: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 3.0,
        acceleration_max: 5.0,
        deceleration_max: 5.0,
    };

    /// What the simulated MEDUSA-class craft is allowed: all that its hull does.
    pub const MEDUSA: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 0.3,
        acceleration_max: 0.09,
        deceleration_max: 0.09,
    };
}
