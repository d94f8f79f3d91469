//! Position of the datum on Earth.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A place on Earth, WGS 84, such as the datum.
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
        Self { latitude: origin.lat_deg.to_radians(), longitude: origin.lon_deg.to_radians() }
    }
}

impl From<geodesy::Origin> for Origin {
    fn from(place: geodesy::Origin) -> Self {
        Self { lat_deg: place.latitude.to_degrees(), lon_deg: place.longitude.to_degrees() }
    }
}
