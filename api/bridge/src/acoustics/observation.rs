//! One line of a modem about an AUV, before it is placed on Earth; numbers and addresses from text.

use nalgebra::Vector3;

use crate::{Origin, Parsed, on_earth};

pub(super) const OTHER: &str = "another message";
pub(super) const CHECKSUM: &str = "checksum does not match";
pub(super) const FIELDS: &str = "wrong number of fields";
pub(super) const NUMBER: &str = "a field is no number";
pub(super) const ADDRESS: &str = "no usable address";
pub(super) const NO_POSITION: &str = "the modem has no position";
pub(super) const NOT_ON_EARTH: &str = "no place on Earth";

/// Longest address or name on a wire, bytes: names are shown and stored.
const ADDRESS_MAX: usize = 32;

/// One AUV as a modem observed it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Observation {
    pub(super) address: String,
    pub(super) time: SignalTime,
    pub(super) location: Location,
    /// One-way travel time, s, if the modem measured it.
    pub(super) travel_s: Option<f64>,
    /// Standard deviation of the position along either axis, m, if the modem states it.
    pub(super) sigma_m: Option<f64>,
    /// Depth of the AUV, m, if the modem states it.
    pub(super) depth_m: Option<f64>,
    /// Depth of the transducer, m, if the modem measures it.
    pub(super) transducer_depth_m: Option<f64>,
}

/// The known one of the two times of a signal, s of Unix time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SignalTime {
    /// Time of arrival at the transducer.
    Arrived(f64),
    Sent(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Location {
    /// On Earth: lever arm and heading are already applied.
    Geographic(Origin),
    /// From the transducer, m.
    Vector {
        axes: Axes,
        vector: Vector3<f64>,
        /// `true` if the third component was measured.
        has_depth: bool,
    },
    /// From the transducer along a line of unknown length.
    Direction {
        axes: Axes,
        unit: Vector3<f64>,
        /// Standard deviation of the direction, rad.
        sigma_rad: f64,
    },
    /// At this distance from the transducer, m, in an unknown direction.
    Range(f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axes {
    /// Forward, starboard, down of the transducer.
    Transducer,
    /// Ahead and to starboard in the horizontal plane, and down, without roll and pitch.
    HeadUp,
    /// Magnetic north, its east, down.
    Magnetic,
    /// North, east, down.
    North,
}

impl Observation {
    pub(super) fn new(address: String, time: SignalTime, location: Location) -> Self {
        Self {
            address,
            time,
            location,
            travel_s: None,
            sigma_m: None,
            depth_m: None,
            transducer_depth_m: None,
        }
    }
}

impl Location {
    pub(super) fn vector(axes: Axes, vector: Vector3<f64>) -> Self {
        Self::Vector { axes, vector, has_depth: true }
    }

    pub(super) fn geographic(lat_deg: f64, lon_deg: f64) -> Parsed<Self> {
        let position = on_earth(lat_deg, lon_deg).ok_or(NOT_ON_EARTH)?;
        Ok(Self::Geographic(position))
    }
}

/// A unit vector (forward, starboard, down): `bearing` clockwise from forward, `elevation` up, rad.
pub(super) fn line_of_sight(bearing: f64, elevation: f64) -> Vector3<f64> {
    let ((sin_b, cos_b), (sin_e, cos_e)) = (bearing.sin_cos(), elevation.sin_cos());
    Vector3::new(cos_e * cos_b, cos_e * sin_b, -sin_e)
}

pub(super) fn number(text: &str) -> Parsed<f64> {
    text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or(NUMBER)
}

/// A finite number; `None` if the field is empty.
pub(super) fn optional(text: &str) -> Parsed<Option<f64>> {
    Some(text).filter(|text| !text.trim().is_empty()).map(number).transpose()
}

/// An address or a name that can be shown and stored.
pub(super) fn address(text: &str) -> Parsed<String> {
    let text = text.trim();
    let is_printable = text.bytes().all(|byte| byte.is_ascii_graphic() || byte == b' ');
    let is_usable = is_printable && (1..=ADDRESS_MAX).contains(&text.len());
    is_usable.then(|| text.to_owned()).ok_or(ADDRESS)
}
