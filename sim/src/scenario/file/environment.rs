//! The environment in a scenario file: water, sensors, acoustics.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

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
    /// What the current does on top of its mean: a first-order Gauss–Markov process, each component by itself; none if left out.
    pub gauss_markov: Option<GaussMarkovFile>,
    /// How the current changes with depth; not at all if left out.
    pub shear: Option<ShearFile>,
    /// Waves; none if left out.
    pub waves: Option<WavesFile>,
}

/// A mean current.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CurrentFile {
    /// The same everywhere and always.
    Constant {
        /// Towards north, m/s.
        north_mps: Quantity<CurrentComponent>,
        /// Towards east, m/s.
        east_mps: Quantity<CurrentComponent>,
    },
    /// A grid over north, east and time, interpolated: a CSV file beside the scenario file, with the columns
    /// `t_s, north_m, east_m, current_north_mps, current_east_mps`.
    Grid {
        /// Name of the file.
        file: String,
    },
}

/// A first-order Gauss–Markov process.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussMarkovFile {
    /// Standard deviation of each component, m/s.
    pub sigma_mps: Quantity<WaterSpeedNoise>,
    /// Time after which 1/e of a deviation is left, s.
    pub correlation_s: Quantity<CorrelationTime>,
}

/// Vertical shear: the surface's current scaled and turned, linearly down to a depth and not further.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShearFile {
    /// The depth, m.
    pub depth_m: Quantity<ShearDepth>,
    /// Factor on the current there.
    pub factor: Quantity<Factor>,
    /// Its turn there, rad, clockwise; 0 if left out.
    pub turn_rad: Option<Quantity<HalfTurn>>,
}

/// Waves: motion that they would give the craft, if neither drag nor thrust acted on it.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WavesFile {
    /// Standard deviation of the heading, rad.
    pub heading_sigma_rad: Quantity<AngleNoise>,
    /// Standard deviation of the surge speed, m/s.
    pub surge_sigma_mps: Quantity<WaterSpeedNoise>,
    /// Peak period, s.
    pub peak_period_s: Quantity<WavePeriod>,
    /// Relative damping: how broad the spectrum is.
    pub damping: Quantity<Damping>,
}

/// What the surface craft knows.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnowledgeFile {
    /// Whether every snapshot gives the current at the craft, or the craft estimates it from its velocities through water and over ground; `known` if left out.
    #[serde(default)]
    pub current: CurrentKnowledge,
    /// Whether it knows the paths and speeds of the underwater vehicles, and how they dive.
    #[serde(default)]
    pub paths: bool,
    /// Its sensors' errors; none if left out.
    #[serde(default)]
    pub sensors: SensorsFile,
    /// How it hears of the underwater vehicles; at once and exactly if left out.
    pub acoustics: Option<AcousticsFile>,
}

/// Whether the current is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurrentKnowledge {
    /// Every snapshot gives it.
    #[default]
    Known,
    /// No snapshot gives it; the ground velocity contains it.
    Unknown,
}

/// Errors of the surface craft's sensors; each is 0 if left out.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsFile {
    /// Standard deviation of a GNSS position along each axis, m; 0 if left out.
    pub position_sigma_m: Option<Quantity<PositionNoise>>,
    /// Time after which 1/e of that error is left, s; 0 if left out.
    pub position_correlation_s: Option<Quantity<Period>>,
    /// Standard deviation of a GNSS velocity along each axis, m/s; 0 if left out.
    pub velocity_sigma_mps: Option<Quantity<SpeedNoise>>,
    /// Standard deviation of the heading, rad; 0 if left out.
    pub heading_sigma_rad: Option<Quantity<AngleNoise>>,
    /// Bias of the heading, rad; 0 if left out.
    pub heading_bias_rad: Option<Quantity<AngleBias>>,
    /// Standard deviation of the yaw rate, rad/s; 0 if left out.
    pub yaw_rate_sigma_radps: Option<Quantity<RateNoise>>,
    /// Standard deviation of the speed through the water, ahead and abeam, m/s; 0 if left out.
    pub speed_sigma_mps: Option<Quantity<SpeedNoise>>,
}

/// How a snapshot carries the messages of an underwater vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportedAs {
    /// As `reports`: every message of the last minutes.
    #[default]
    Reports,
    /// As `state`: the newest message, taken for exact.
    State,
}

/// Acoustic positioning and telemetry in time slots.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AcousticsFile {
    /// How a snapshot carries the messages; `reports` if left out.
    #[serde(default, alias = "told_as")]
    pub reported_as: ReportedAs,
    /// Time from one slot of a vehicle to its next, s.
    pub frame_s: Quantity<FrameTime>,
    /// Length of a message, s.
    pub slot_length_s: Quantity<MessageTime>,
    /// Start of every vehicle's slot in the frame, s, by the vehicle's name.
    pub slots_s: BTreeMap<String, Quantity<Period>>,
    /// Time from a message's arrival until its fix is known, s.
    pub latency_s: Quantity<MessageTime>,
    /// Standard deviation of a fix along each axis, m.
    pub position_sigma_m: Quantity<PositionNoise>,
    /// Standard deviation of the depth in a message, m; 0 if left out.
    pub depth_sigma_m: Option<Quantity<DepthNoise>>,
    /// Standard deviation of the course in a message, rad; 0 if left out.
    pub course_sigma_rad: Option<Quantity<AngleNoise>>,
    /// Standard deviation of the speed in a message, m/s; 0 if left out.
    pub speed_sigma_mps: Option<Quantity<SpeedNoise>>,
    /// Range beyond which nothing is heard, m.
    pub range_max_m: Quantity<AcousticRange>,
    /// Share of messages lost at no range; 0 if left out.
    pub loss: Option<Quantity<Share>>,
    /// Share lost just inside the largest range; that at no range if left out.
    pub loss_at_range_max: Option<Quantity<Share>>,
    /// Share of fixes that are outliers; 0 if left out.
    pub outlier_share: Option<Quantity<Share>>,
    /// Standard deviation of an outlier along each axis, m; ten times that of a fix if left out.
    pub outlier_sigma_m: Option<Quantity<PositionNoise>>,
    /// Speed of sound, m/s; 1500 if left out.
    pub sound_speed_mps: Option<Quantity<SoundSpeed>>,
}
