//! What clients post and receive alike, and what is the planner's by the same names.

use nalgebra::Vector2;
use planner::{craft, plan, snapshot as facts};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{
    craft::{HeadingHeld, SpeedHeld},
    request::Hold,
    response::Method,
};

/// Both ways between a choice here and the planner's, whose names are the same.
macro_rules! same_choice {
    ($here:ty, $planner:ty: $($name:ident),+) => {
        impl From<$planner> for $here {
            fn from(choice: $planner) -> Self {
                match choice {
                    $(<$planner>::$name => Self::$name,)+
                }
            }
        }

        impl From<$here> for $planner {
            fn from(choice: $here) -> Self {
                match choice {
                    $(<$here>::$name => Self::$name,)+
                }
            }
        }
    };
}

same_choice!(Hold, facts::HoldStyle: SlowTurn, Stop);
same_choice!(SpeedHeld, craft::SpeedHeld: ThroughWater, OverGround);
same_choice!(HeadingHeld, craft::HeadingHeld: Heading, Course);
same_choice!(
    Method, plan::Method: Mpc, PreviousPlan, SaturatedLos, Hold, SaturatedLosTrackerFrame, IntegralLos, WaypointBox,
    PrintedLos
);

/// Both ways between a velocity here and the planner's.
macro_rules! velocity {
    ($here:ty) => {
        impl From<Vector2<f64>> for $here {
            fn from(velocity: Vector2<f64>) -> Self {
                Self {
                    north_mps: velocity.x,
                    east_mps: velocity.y,
                }
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

/// A place on Earth, WGS 84, such as where the datum lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Geodetic latitude, degrees, positive north.
    pub lat_deg: f64,
    /// Longitude, degrees, positive east.
    pub lon_deg: f64,
}

impl From<Origin> for geodesy::Origin {
    fn from(origin: Origin) -> Self {
        Self {
            latitude: origin.lat_deg.to_radians(),
            longitude: origin.lon_deg.to_radians(),
        }
    }
}

impl From<geodesy::Origin> for Origin {
    fn from(place: geodesy::Origin) -> Self {
        Self {
            lat_deg: place.latitude.to_degrees(),
            lon_deg: place.longitude.to_degrees(),
        }
    }
}

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
    /// Its latitude, degrees, positive north, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Its longitude, degrees, positive east, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
}
