//! The laws by name, and their gains.

/// The laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LosLaw {
    /// [`saturated_los`](super::saturated_los): errors in the target's frame.
    SaturatedLos,
    /// [`saturated_los_tracker_frame`](super::saturated_los_tracker_frame): errors in the tracker's frame.
    TrackerFrame,
    /// [`integral_los`](super::integral_los): with an integral of the cross-track error.
    Integral,
    /// [`WaypointBox`](super::WaypointBox): round a box about the target's last fixes.
    WaypointBox,
}

impl LosLaw {
    /// Every law, the one that is a fallback level first.
    pub const ALL: [Self; 4] = [
        Self::SaturatedLos,
        Self::TrackerFrame,
        Self::Integral,
        Self::WaypointBox,
    ];

    /// Its name wherever it leaves the program.
    #[must_use]
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
    /// Gains that every law has.
    pub gains: LosGains,
    /// Integral gain σ, m/s, positive: [`LosLaw::Integral`]'s, and no other's.
    #[doc(alias = "sigma")]
    pub integral_gain: f64,
}
