//! Velocities of water and vehicles over ground.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Conversions between a velocity in JSON and a vector (north, east), m/s.
macro_rules! velocity {
    ($here:ty) => {
        impl From<Vector2<f64>> for $here {
            fn from(velocity: Vector2<f64>) -> Self {
                Self { north_mps: velocity.x, east_mps: velocity.y }
            }
        }

        impl From<$here> for Vector2<f64> {
            fn from(velocity: $here) -> Self {
                Self::new(velocity.north_mps, velocity.east_mps)
            }
        }
    };
}

velocity!(Current);
velocity!(Drift);

/// Velocity of the water over ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Current {
    /// Northward, m/s, within ±3.
    pub north_mps: f64,
    /// Eastward, m/s, within ±3.
    pub east_mps: f64,
}

/// A velocity over ground that a vehicle does not measure, such as a current's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Drift {
    /// Northward, m/s.
    pub north_mps: f64,
    /// Eastward, m/s.
    pub east_mps: f64,
}
