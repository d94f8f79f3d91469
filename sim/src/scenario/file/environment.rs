//! The environment in a scenario file: water, sensors, acoustics.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{AisFile, Point, yes};
pub use crate::observe::ReportedAs;
use crate::scenario::quantity::{
    AcousticRange, AngleBias, AngleNoise, CorrelationTime, CurrentComponent, Damping, DepthNoise, Factor,
    FrameTime, HalfTurn, MessageTime, Period, PositionNoise, Quantity, RateNoise, Share, ShearDepth,
    SoundSpeed, SpeedNoise, WaterSpeedNoise, WavePeriod,
};

/// The water.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaterFile {
    /// Mean current at the surface; none if left out.
    pub current: Option<CurrentFile>,
    /// Fluctuation about the mean current, a first-order Gauss–Markov process; none if left out.
    pub gauss_markov: Option<GaussMarkovFile>,
    /// Change of the current with depth; none if left out.
    pub shear: Option<ShearFile>,
    /// Waves; none if left out.
    pub waves: Option<WavesFile>,
}

/// A mean current.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CurrentFile {
    /// Constant in space and time.
    Constant {
        /// Towards north, m/s.
        north_mps: Quantity<CurrentComponent>,
        /// Towards east, m/s.
        east_mps: Quantity<CurrentComponent>,
    },
    /// Interpolated on a grid, from a CSV file with the columns `t_s`, `north_m`, `east_m`,
    /// `current_north_mps` and `current_east_mps`.
    Grid {
        /// Its name, beside the scenario file.
        file: String,
    },
}

/// A first-order Gauss–Markov process.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussMarkovFile {
    /// Standard deviation of each component, m/s.
    pub sigma_mps: Quantity<WaterSpeedNoise>,
    /// Correlation time, s.
    pub correlation_s: Quantity<CorrelationTime>,
}

/// Vertical shear: the surface current, scaled and turned linearly down to a depth, then constant.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShearFile {
    /// The depth, m.
    pub depth_m: Quantity<ShearDepth>,
    /// Factor on the current there.
    pub factor: Quantity<Factor>,
    /// Its turn there, rad; 0 if left out.
    pub turn_rad: Option<Quantity<HalfTurn>>,
}

/// Waves, as the motion of a craft without drag and thrust.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WavesFile {
    /// Standard deviation of the heading, rad.
    pub heading_sigma_rad: Quantity<AngleNoise>,
    /// Standard deviation of the surge speed, m/s.
    pub surge_sigma_mps: Quantity<WaterSpeedNoise>,
    /// Peak period, s.
    pub peak_period_s: Quantity<WavePeriod>,
    /// Relative damping: the width of the spectrum.
    pub damping: Quantity<Damping>,
}

/// Knowledge of the surface craft.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnowledgeFile {
    /// Knowledge of the current at the craft; `known` if left out.
    #[serde(default)]
    pub current: CurrentKnowledge,
    /// `true`: it knows paths, speeds and dives of the AUVs.
    #[serde(default)]
    pub paths: bool,
    /// `true`: forecasts follow known paths only, not what tracks repeat.
    #[serde(default)]
    pub known_paths_only: bool,
    /// Errors of its sensors; none if left out.
    #[serde(default)]
    pub sensors: SensorsFile,
    /// Messages of the AUVs; exact states if left out.
    pub acoustics: Option<AcousticsFile>,
    /// Faults of the measurements of a goal that localises; none if left out.
    pub ranging: Option<RangingFile>,
    /// AIS, by which other vessels are known; usual errors if left out.
    pub ais: Option<AisFile>,
}

/// Faults of the ranges or fixes between the surface craft and AUVs that it localises.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangingFile {
    /// Share that does not arrive; 0 if left out.
    pub lost_share: Option<Quantity<Share>>,
    /// Share that went a longer way; 0 if left out.
    pub outlier_share: Option<Quantity<Share>>,
    /// The longest detour, m; 0 if left out.
    pub outlier_max_m: Option<Quantity<PositionNoise>>,
    /// Growth of a one-way range by the drift of an AUV's clock, m/s; 0 if left out.
    pub clock_drift_mps: Option<Quantity<SpeedNoise>>,
    /// Anchored modems that AUVs measure ranges or fixes to instead of the craft; none if left out.
    #[serde(default)]
    pub anchored: Vec<Point>,
}

/// Knowledge of the current.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurrentKnowledge {
    /// Every snapshot contains it.
    #[default]
    Known,
    /// No snapshot contains it; the ground velocity includes it.
    Unknown,
}

/// Errors of the surface craft's sensors; each is 0 if left out.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsFile {
    /// Standard deviation of a GNSS position along each axis, m; 0 if left out.
    pub position_sigma_m: Option<Quantity<PositionNoise>>,
    /// Correlation time of that error, s; 0 if left out.
    pub position_correlation_s: Option<Quantity<Period>>,
    /// Standard deviation of a GNSS velocity along each axis, m/s; 0 if left out.
    pub velocity_sigma_mps: Option<Quantity<SpeedNoise>>,
    /// Standard deviation of the heading, rad; 0 if left out.
    pub heading_sigma_rad: Option<Quantity<AngleNoise>>,
    /// Bias of the heading, rad; 0 if left out.
    pub heading_bias_rad: Option<Quantity<AngleBias>>,
    /// Standard deviation of the yaw rate, rad/s; 0 if left out.
    pub yaw_rate_sigma_radps: Option<Quantity<RateNoise>>,
    /// Standard deviation of the speed through the water, m/s; 0 if left out.
    pub speed_sigma_mps: Option<Quantity<SpeedNoise>>,
}

/// What makes an AUV send a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Calls {
    /// Nothing: it sends in its slot, for all craft in range.
    #[default]
    Unasked,
    /// A call of the craft that has it, in the slot of the planner's table.
    Planned,
    /// A call of the craft that has it, each of which calls its AUVs one after the other from the
    /// beginning of the frame on.
    Unplanned,
}

/// Acoustic positioning and telemetry in time slots.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AcousticsFile {
    /// Form of the messages in a snapshot; `reports` if left out.
    #[serde(default, alias = "told_as")]
    pub reported_as: ReportedAs,
    /// What makes an AUV send where there are several surface craft; `unasked` if left out.
    #[serde(default)]
    pub calls: Calls,
    /// Time between two messages of an AUV, s.
    pub frame_s: Quantity<FrameTime>,
    /// Length of a message, s.
    pub slot_length_s: Quantity<MessageTime>,
    /// Start of its slot in the frame, s.
    pub slots_s: BTreeMap<String, Quantity<Period>>,
    /// Time from a message's arrival to its fix, s.
    pub latency_s: Quantity<MessageTime>,
    /// `true`: messages contain course, speed and rate of turn; `false` requires `reports`.
    #[serde(default = "yes")]
    pub course_and_speed: bool,
    /// Standard deviation of a fix along each axis, or of a range, m.
    pub position_sigma_m: Quantity<PositionNoise>,
    /// Standard deviation of the depth in a message, m; 0 if left out.
    pub depth_sigma_m: Option<Quantity<DepthNoise>>,
    /// Standard deviation of the course in a message, rad; 0 if left out.
    pub course_sigma_rad: Option<Quantity<AngleNoise>>,
    /// Standard deviation of the speed in a message, m/s; 0 if left out.
    pub speed_sigma_mps: Option<Quantity<SpeedNoise>>,
    /// Range beyond which no message arrives, m.
    pub range_max_m: Quantity<AcousticRange>,
    /// Share of messages lost at no range; 0 if left out.
    pub loss: Option<Quantity<Share>>,
    /// Share lost at the largest range; `loss` if left out.
    pub loss_at_range_max: Option<Quantity<Share>>,
    /// Share of fixes that are outliers; 0 if left out.
    pub outlier_share: Option<Quantity<Share>>,
    /// Standard deviation of an outlier along each axis, or of the detour of a range, m; ten times
    /// that of a fix if left out.
    pub outlier_sigma_m: Option<Quantity<PositionNoise>>,
    /// Speed of sound, m/s; 1500 if left out.
    pub sound_speed_mps: Option<Quantity<SoundSpeed>>,
}
