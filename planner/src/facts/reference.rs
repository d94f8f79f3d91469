//! References and trajectories.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::Heading;

/// Reference of a guidance law for the inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
}

/// A point of a trajectory of the surface craft.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrajectoryPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north, if the request has an `origin`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east, if the request has an `origin`.
    pub lon_deg: Option<f64>,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, in (−π, π].
    #[doc(alias = "psi")]
    pub heading_rad: f64,
}

impl TrajectoryPoint {
    /// A point at time `t_s` and `position` (north, east), m, without latitude and longitude.
    pub fn new(t_s: f64, position: Vector2<f64>, speed_mps: f64, heading: Heading) -> Self {
        Self {
            t_s,
            north_m: position.x,
            east_m: position.y,
            lat_deg: None,
            lon_deg: None,
            speed_mps,
            heading_rad: heading.radians(),
        }
    }

    /// Position (north, east), m.
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    /// Heading ψ.
    pub fn heading(&self) -> Heading {
        Heading::new(self.heading_rad)
    }
}
