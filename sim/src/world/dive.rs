//! The sawtooth: dive until deep enough, climb until shallow enough.

use schemars::JsonSchema;
use serde::Deserialize;

/// Depths and angle of a sawtooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dive {
    /// Depth at which a climb ends, m.
    pub depth_min: f64,
    /// Depth at which a dive ends, m.
    pub depth_max: f64,
    /// Pitch of both legs, rad, positive.
    pub pitch: f64,
}

impl Dive {
    /// The paper's: 1 to 23 m at 50°. Source: Figs. 4 and 6, eq. (32).
    pub fn paper() -> Self {
        Self { depth_min: 1.0, depth_max: 23.0, pitch: 50_f64.to_radians() }
    }
}

/// A leg of a dive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Leg {
    /// Nose down.
    #[default]
    Down,
    /// Nose up.
    Up,
}

impl Leg {
    /// The leg after a reading of `depth`, m: unchanged between the two depths.
    #[must_use]
    pub fn next(self, depth: f64, dive: &Dive) -> Self {
        match self {
            Self::Down if depth >= dive.depth_max => Self::Up,
            Self::Up if depth <= dive.depth_min => Self::Down,
            same => same,
        }
    }

    /// Pitch reference θ, rad, positive nose-up.
    pub fn pitch(self, dive: &Dive) -> f64 {
        match self {
            Self::Down => -dive.pitch,
            Self::Up => dive.pitch,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_the_depths_the_leg_does_not_change() {
        let dive = Dive::paper();
        assert_eq!(Leg::Down.next(12.0, &dive), Leg::Down);
        assert_eq!(Leg::Up.next(12.0, &dive), Leg::Up);
        assert_eq!(Leg::Down.next(23.0, &dive), Leg::Up);
        assert_eq!(Leg::Up.next(1.0, &dive), Leg::Down);
        // Beyond either depth on the way back, it does not switch again.
        assert_eq!(Leg::Up.next(23.4, &dive), Leg::Up);
        assert_eq!(Leg::Down.next(0.6, &dive), Leg::Down);
    }
}
