//! Names and gains of the laws.

use std::{fmt, ops::RangeInclusive};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LosLaw {
    /// [`saturated_los`](super::saturated_los): errors in the target's frame.
    SaturatedLos,
    /// [`saturated_los_tracker_frame`](super::saturated_los_tracker_frame): in the tracker's frame.
    TrackerFrame,
    /// [`integral_los`](super::integral_los): with an integral of the cross-track error.
    Integral,
    /// [`WaypointBox`](super::WaypointBox): around a box about the target's last fixes.
    WaypointBox,
}

impl LosLaw {
    /// All laws; the fallback level first.
    pub const ALL: [Self; 4] = [Self::SaturatedLos, Self::TrackerFrame, Self::Integral, Self::WaypointBox];

    /// Its name in JSON and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::SaturatedLos => "saturated_los",
            Self::TrackerFrame => "saturated_los_tracker_frame",
            Self::Integral => "integral_los",
            Self::WaypointBox => "waypoint_box",
        }
    }
}

/// Gains of a line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LosGains {
    /// Look-ahead distance Δ, m, positive.
    #[doc(alias = "delta")]
    pub look_ahead: f64,
    /// Along-track gain k₃, 1/s, positive.
    #[doc(alias = "k3")]
    pub along_track_gain: f64,
}

/// A law with all its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LosTuning {
    /// The law.
    pub law: LosLaw,
    /// Gains of all laws.
    pub gains: LosGains,
    /// Integral gain σ, m/s, positive; only for [`LosLaw::Integral`].
    #[doc(alias = "sigma")]
    pub integral_gain: f64,
}

/// Gains of a line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LawGains {
    /// Look-ahead distance, m.
    pub look_ahead_m: f64,
    /// Along-track gain, 1/s.
    pub along_track_gain_per_s: f64,
    /// Integral gain, m/s, of `integral_los`. Default: the planner's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integral_gain_mps: Option<f64>,
}

impl LawGains {
    /// Ranges of gains that clients send, by member.
    pub const RANGES: [(&str, RangeInclusive<f64>); 3] = [
        ("look_ahead_m", 0.1..=1_000.0),
        ("along_track_gain_per_s", 0.001..=10.0),
        ("integral_gain_mps", 0.0001..=10.0),
    ];

    /// The gains in the order of [`Self::RANGES`].
    pub fn values(&self) -> [Option<f64>; 3] {
        [Some(self.look_ahead_m), Some(self.along_track_gain_per_s), self.integral_gain_mps]
    }

    /// `law` with these gains; `integral_gain`, m/s, replaces an undeclared one.
    pub fn tuning(self, law: LosLaw, integral_gain: f64) -> LosTuning {
        LosTuning {
            law,
            gains: LosGains { look_ahead: self.look_ahead_m, along_track_gain: self.along_track_gain_per_s },
            integral_gain: self.integral_gain_mps.unwrap_or(integral_gain),
        }
    }
}

impl From<LosTuning> for LawGains {
    fn from(tuning: LosTuning) -> Self {
        Self {
            look_ahead_m: tuning.gains.look_ahead,
            along_track_gain_per_s: tuning.gains.along_track_gain,
            integral_gain_mps: (tuning.law == LosLaw::Integral).then_some(tuning.integral_gain),
        }
    }
}

impl fmt::Display for LawGains {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { look_ahead_m, along_track_gain_per_s, integral_gain_mps } = self;
        write!(f, "look-ahead {look_ahead_m} m, along-track gain {along_track_gain_per_s} 1/s")?;
        match integral_gain_mps {
            Some(integral_gain) => write!(f, ", integral gain {integral_gain} m/s"),
            None => Ok(()),
        }
    }
}
