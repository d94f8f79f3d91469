//! The classes of underwater vehicle: hull, inner loops, dive, speed and navigation of each.

use schemars::JsonSchema;
use serde::Deserialize;

pub use super::hull::{PITCH_MAX, UnderwaterHull, UnderwaterInput, UnderwaterState, heading_rate};
use super::{dive::Dive, inner_loop::UnderwaterLoops};

/// A class of underwater vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UnderwaterClass {
    /// MEDUSA: 0.3 m/s, 1 to 23 m at 50°; exact navigation.
    #[default]
    Medusa,
    /// Slocum glider: 0.29 m/s horizontally at 26°; a position fix at the surface only.
    Slocum,
}

/// Navigation of an underwater vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Navigation {
    /// Its own estimate is its true position.
    Exact,
    /// A satellite fix while at the surface, dead reckoning by compass and speed through the water
    /// below: a current carries the estimate away until the next surfacing.
    GpsAtSurface,
}

impl UnderwaterClass {
    /// Its hull and actuators.
    pub fn hull(self) -> UnderwaterHull {
        match self {
            Self::Medusa => UnderwaterHull::MEDUSA,
            Self::Slocum => UnderwaterHull::SLOCUM,
        }
    }

    /// Its inner loops.
    pub fn loops(self) -> UnderwaterLoops {
        match self {
            Self::Medusa => UnderwaterLoops::MEDUSA,
            Self::Slocum => UnderwaterLoops::SLOCUM,
        }
    }

    /// Its sawtooth, unless the scenario gives another.
    ///
    /// MEDUSA: the paper's. Slocum: 26°, from 30 m, the limit of its shallowest buoyancy engine, up
    /// to 0.5 m, where the antenna on the tail is above water.
    pub fn dive(self) -> Dive {
        match self {
            Self::Medusa => Dive::paper(),
            Self::Slocum => Dive { depth_min: 0.5, depth_max: 30.0, pitch: SLOCUM_PITCH },
        }
    }

    /// Its speed along the body, through the water, m/s.
    ///
    /// MEDUSA: 0.3 m/s, Fig. 6 of the paper. Slocum: 0.29 m/s horizontally.
    pub fn speed(self) -> f64 {
        match self {
            Self::Medusa => 0.3,
            Self::Slocum => SLOCUM_HORIZONTAL_SPEED / SLOCUM_PITCH.cos(),
        }
    }

    /// Its navigation.
    pub fn navigation(self) -> Navigation {
        match self {
            Self::Medusa => Navigation::Exact,
            Self::Slocum => Navigation::GpsAtSurface,
        }
    }
}

/// Pitch of the Slocum's glides, rad: 26°.
const SLOCUM_PITCH: f64 = 26.0 / 180.0 * std::f64::consts::PI;
/// Horizontal speed of the Slocum's glides, m/s, a usual one; it makes 0.35 m/s at most.
const SLOCUM_HORIZONTAL_SPEED: f64 = 0.29;
