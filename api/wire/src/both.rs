//! What clients post and receive alike.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Velocity of the water over ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Current {
    /// Northward, m/s, within ±3.
    pub north_mps: f64,
    /// Eastward, m/s, within ±3.
    pub east_mps: f64,
}

/// How the underwater vehicles' future is guessed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Forecast {
    /// The planner chooses for each vehicle.
    #[default]
    Auto,
    /// Each stays where it is.
    Hold,
    /// Each keeps its ground velocity.
    ConstantVelocity,
    /// Each keeps its speed and its rate of turn.
    ConstantTurn,
    /// Each that has a `path` follows it, with the offset from it that it has; the planner chooses for the
    /// others. `auto` does so too, save for a vehicle that rests or is more than 15 m from its path.
    Path,
}

/// A velocity over ground that a vehicle does not know of, such as a current's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Drift {
    /// Northward, m/s.
    pub north_mps: f64,
    /// Eastward, m/s.
    pub east_mps: f64,
}

/// A point of a trajectory of the surface craft.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrajectoryPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
}
