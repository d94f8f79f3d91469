//! What is known of where an AUV is: its state, or the reports that an estimate is made of.

use nalgebra::{Matrix4, Vector2};

use crate::facts::angle::Course;

/// Slower than this over ground, an AUV counts as standing still, m/s.
///
/// A quarter of the slowest horizontal speed of the vehicles at hand (0.193 m/s): under it the
/// course is noise.
pub const SPEED_AT_REST: f64 = 0.05;

/// An AUV that was last heard of longer ago is not forecast: it is held where it was, s. Assumption: in an hour a current
/// that is not known carries it as far as any forecast is long.
pub(crate) const FORECAST_AGE_MAX: f64 = 3600.0;

/// Either of the two ways in which a client declares where an AUV is.
#[derive(Clone, Debug, PartialEq)]
pub enum Evidence {
    /// A state, as some estimator of the client's has it.
    State(AuvState),
    /// Recent reports, at least one, in any order.
    Reports(Vec<Report>),
}

impl Evidence {
    /// The state, where that is what was declared.
    #[must_use]
    pub fn state(&self) -> Option<&AuvState> {
        match self {
            Self::State(state) => Some(state),
            Self::Reports(_) => None,
        }
    }

    /// The same, to be changed.
    #[must_use]
    pub fn state_mut(&mut self) -> Option<&mut AuvState> {
        match self {
            Self::State(state) => Some(state),
            Self::Reports(_) => None,
        }
    }
}

/// State of an AUV, as old as it says.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvState {
    /// Position (north, east) then, m.
    pub position: Vector2<f64>,
    /// Depth, m, positive down.
    pub depth: f64,
    /// Course over ground χ.
    pub course: Course,
    /// Horizontal speed over ground, m/s, never negative.
    pub speed: f64,
    /// Rate of turn of the course, rad/s, positive clockwise.
    pub turn_rate: f64,
    /// Age, s.
    pub age: f64,
    /// Covariance of (north, east, north velocity, east velocity) then, m², m²/s and m²/s², where it is known.
    /// Symmetric, with no negative eigenvalue.
    pub covariance: Option<Matrix4<f64>>,
}

impl AuvState {
    /// The state now of an AUV at `position` (north, east), m, and `depth`, m, that goes straight on at `speed`, m/s, over
    /// ground; how surely that is known is not.
    #[must_use]
    pub fn new(position: Vector2<f64>, depth: f64, course: Course, speed: f64) -> Self {
        Self {
            position,
            depth,
            course,
            speed,
            turn_rate: 0.0,
            age: 0.0,
            covariance: None,
        }
    }

    /// Velocity over ground (north, east), m/s.
    #[must_use]
    pub fn velocity(&self) -> Vector2<f64> {
        self.course.unit() * self.speed
    }
}

/// A position that was measured at a time, and what the vehicle said of itself then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// When it was so, s on the snapshot's clock: when the message was sent, not when it arrived.
    pub time: f64,
    /// Measured position (north, east), m.
    pub position: Vector2<f64>,
    /// Standard deviation of `position` along either axis, m.
    pub sigma: f64,
    /// Telemetered depth, m, positive down.
    pub depth: Option<f64>,
    /// Telemetered course and speed.
    pub ground_track: Option<GroundTrack>,
    /// Telemetered rate of turn of the course, rad/s, positive clockwise.
    pub turn_rate: Option<f64>,
}

/// How a vehicle says that it moves over ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTrack {
    /// Course over ground χ.
    pub course: Course,
    /// Horizontal speed over ground, m/s, never negative.
    pub speed: f64,
}

impl GroundTrack {
    /// Velocity over ground (north, east), m/s.
    #[must_use]
    pub fn velocity(&self) -> Vector2<f64> {
        self.course.unit() * self.speed
    }
}
