//! Drawn properties of a random craft beside its hull and gains.

use planner::craft::{HeadingReference, SpeedReference};
use schemars::JsonSchema;
use serde::Deserialize;

/// Range of the dry mass, kg.
pub const MASS: [f64; 2] = [20.0, 500.0];
/// Range of the design lags of heading and surge loops, s.
pub const LAG: [f64; 2] = [0.5, 8.0];
/// Range of the acceleration, m/s².
pub const ACCELERATION: [f64; 2] = [0.03, 0.8];
/// Range of the delay of a reference before it reaches the loops, s.
pub const DELAY: [f64; 2] = [0.0, 2.0];

/// Properties that a random craft must have. The others are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CraftConstraints {
    /// Dry mass, kg.
    pub mass: Option<f64>,
    /// Kind of heading loop.
    pub heading_loop: Option<HeadingLoopKind>,
    /// Lag that the heading loop is tuned for, s.
    pub heading_lag: Option<f64>,
    /// Kind of surge loop.
    pub surge_loop: Option<SurgeLoopKind>,
    /// Lag that the surge loop is tuned for, s.
    pub surge_lag: Option<f64>,
    /// Largest acceleration that the surge loop commands, m/s².
    pub acceleration: Option<f64>,
    /// Delay of a reference, s.
    pub delay: Option<f64>,
    /// Speed that the surge loop holds.
    pub speed_held: Option<SpeedReference>,
    /// Angle that the heading loop holds.
    pub heading_held: Option<HeadingReference>,
}

/// A kind of heading loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingLoopKind {
    /// Proportional-derivative.
    #[serde(rename = "pd")]
    ProportionalDerivative,
    /// Proportional-integral-derivative.
    #[serde(rename = "pid")]
    ProportionalIntegralDerivative,
    /// Proportional-integral-derivative behind a second-order reference model.
    ReferenceModel,
    /// Heading error to a limited yaw rate, and yaw rate to a moment.
    Cascade,
}

/// A kind of surge loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SurgeLoopKind {
    /// Proportional, with drag feed-forward.
    #[serde(rename = "p")]
    Proportional,
    /// Proportional-integral, with anti-windup.
    #[serde(rename = "pi")]
    AntiWindup,
    /// Proportional-integral, without anti-windup.
    #[serde(rename = "pi_windup")]
    Windup,
}

/// Drawn properties of a craft beside its hull and gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraftTraits {
    /// Dry mass, kg.
    pub mass: f64,
    /// Length, m.
    pub length: f64,
    /// Kind of heading loop.
    pub heading_loop: HeadingLoopKind,
    /// Lag that the heading loop is tuned for, without the delay, s.
    pub heading_lag: f64,
    /// Kind of surge loop.
    pub surge_loop: SurgeLoopKind,
    /// Lag that the surge loop is tuned for, without the delay, s.
    pub surge_lag: f64,
    /// Largest acceleration that the surge loop commands, m/s².
    pub acceleration: f64,
    /// Delay of a reference, s.
    pub delay: f64,
}
