//! Measurements, independent of the wire.

use nalgebra::Vector2;
use planner::snapshot::{Origin, VesselStatus};

/// The position at this latitude and longitude, degrees, if in range. `None` at 0°, 0°, which
/// receivers without a position report.
pub fn on_earth(lat_deg: f64, lon_deg: f64) -> Option<Origin> {
    let is_in_range = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0;
    (is_in_range && (lat_deg, lon_deg) != (0.0, 0.0)).then_some(Origin { lat_deg, lon_deg })
}

/// One measurement of the surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CraftMeasurement {
    /// Position.
    Position(Origin),
    /// Velocity over ground (north, east), m/s.
    GroundVelocity(Vector2<f64>),
    /// Speed over ground, m/s, of a receiver without a course: many omit it at rest.
    GroundSpeed(f64),
    /// Heading, rad, true, clockwise from north.
    Heading(f64),
    /// Yaw rate, rad/s, positive clockwise seen from above.
    YawRate(f64),
    /// Velocity through the water (surge ahead, sway to starboard), m/s.
    WaterVelocity(Vector2<f64>),
}

/// The position of an AUV in one message, or a range to it.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvFix {
    /// The AUV: its name, or its address on the wire as text.
    pub auv: String,
    /// Time of the position, s of Unix time.
    pub t_s: f64,
    /// Position; of a range, that of the transducer.
    pub position: Origin,
    /// Slant range from there, m, if no position was measured.
    pub range_m: Option<f64>,
    /// Standard deviation of the position along either axis, or of the range, m, if known.
    pub sigma_m: Option<f64>,
    /// Depth, m, positive down.
    pub depth_m: Option<f64>,
    /// Velocity over ground (north, east), m/s.
    pub ground_velocity: Option<Vector2<f64>>,
}

impl AuvFix {
    /// A position, of which nothing else is known.
    pub(crate) fn at(auv: &str, t_s: f64, position: Origin) -> Self {
        let auv = auv.to_owned();
        Self { auv, t_s, position, range_m: None, sigma_m: None, depth_m: None, ground_velocity: None }
    }
}

/// A message from another vessel, by AIS.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VesselMessage {
    /// Its MMSI.
    pub mmsi: u32,
    /// `true` if the craft's own transponder sent it.
    pub is_own: bool,
    /// Its position and motion, if the message has a position.
    pub fix: Option<VesselFix>,
    /// Its name, if stated.
    pub name: Option<String>,
    /// From its antenna to bow, stern, port and starboard, m, if stated.
    pub dimensions: Option<[f64; 4]>,
}

/// Position and motion of another vessel. What it does not know is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VesselFix {
    /// Time since the position was received elsewhere, s.
    pub age_s: f64,
    /// Position of its antenna.
    pub position: Origin,
    /// Course over ground, rad.
    pub course: Option<f64>,
    /// Speed over ground, m/s.
    pub speed: Option<f64>,
    /// True heading, rad.
    pub heading: Option<f64>,
    /// Its navigational status.
    pub status: VesselStatus,
}

/// A measurement from a wire.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// A measurement of the surface craft.
    Craft {
        /// Time of the measurement, s of Unix time.
        t_s: f64,
        /// Talker of the sentence; zeros on wires without talkers.
        talker: [u8; 2],
        /// The measurement.
        measured: CraftMeasurement,
    },
    /// A fix of an AUV.
    Auv(AuvFix),
    /// A message from another vessel.
    Vessel(VesselMessage),
}
