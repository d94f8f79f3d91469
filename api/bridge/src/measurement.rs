//! What the wires tell, whichever wire it was.

use nalgebra::Vector2;

/// A position on Earth (WGS 84), degrees, positive north and east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geographic {
    /// Geodetic latitude, degrees, within ±90.
    pub lat_deg: f64,
    /// Longitude, degrees, within ±180.
    pub lon_deg: f64,
}

impl Geographic {
    /// The position, if there is such a one on Earth.
    #[must_use]
    pub fn new(lat_deg: f64, lon_deg: f64) -> Option<Self> {
        let on_earth = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0;
        on_earth.then_some(Self { lat_deg, lon_deg })
    }
}

/// One thing measured of the surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CraftMeasurement {
    /// Where it is.
    Position(Geographic),
    /// Velocity over ground (north, east), m/s.
    GroundVelocity(Vector2<f64>),
    /// Heading, rad, true, clockwise from north.
    Heading(f64),
    /// Yaw rate, rad/s, positive clockwise seen from above.
    YawRate(f64),
    /// Velocity through the water (surge ahead, sway to starboard), m/s.
    WaterVelocity(Vector2<f64>),
}

/// Where an AUV was, as one message tells it.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvFix {
    /// Which one: a name, or an address on the wire as text.
    pub auv: String,
    /// When it was there, s of Unix time.
    pub t_s: f64,
    /// Where.
    pub position: Geographic,
    /// Standard deviation of the position along either axis, m, where the wire tells it.
    pub sigma_m: Option<f64>,
    /// Depth, m, positive down.
    pub depth_m: Option<f64>,
    /// Velocity over ground (north, east), m/s.
    pub ground_velocity: Option<Vector2<f64>>,
}

/// What one wire has told, in the order in which it came.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// Of the surface craft, and when it was so, s of Unix time.
    Craft {
        /// When it was so, s of Unix time.
        t_s: f64,
        /// What was measured.
        measured: CraftMeasurement,
    },
    /// Of an AUV.
    Auv(AuvFix),
}
