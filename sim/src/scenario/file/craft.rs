//! The craft description that a scenario file gives to the planner: the members of the JSON object `craft`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{HeadingHeldFile, SpeedHeldFile};
use crate::scenario::quantity::{
    IntegralTime, LoopAcceleration, LoopDamping, LoopDelay, LoopLag, LoopRate, NaturalFrequency,
    PowerCoefficient, Quantity, RelativeUncertainty, SwayPerYawRate,
};

/// Closed-loop response of the craft as given to the planner; what is left out is the preset's or, without one,
/// estimated.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CraftFile {
    /// Name of a known craft whose values stand for every member that is not given here; none if left out.
    pub preset: Option<String>,
    /// Response of the heading loop; the preset's if left out.
    #[serde(default)]
    pub heading_loop: HeadingResponseFile,
    /// Response of the speed loop; the preset's if left out.
    #[serde(default)]
    pub surge_loop: SurgeResponseFile,
    /// Sway per surge and yaw rate, s, positive where the craft drifts outwards in a turn; the preset's if left out.
    pub sway_per_yaw_rate_s: Option<Quantity<SwayPerYawRate>>,
    /// Power that propulsion draws at a steady speed through the water; the preset's if left out.
    pub power: Option<PowerFile>,
    /// What the speed reference is held against; the preset's if left out.
    pub speed_held: Option<SpeedHeldFile>,
    /// What the heading reference is held against; the preset's if left out.
    pub heading_held: Option<HeadingHeldFile>,
    /// Standard deviation of the numbers given, as a share of each; the preset's if left out.
    pub relative_uncertainty: Option<Quantity<RelativeUncertainty>>,
}

/// Response of a heading loop: a time constant, or a natural frequency and a damping ratio.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadingResponseFile {
    /// Time constant of a first-order answer, s; the preset's if left out.
    pub time_constant_s: Option<Quantity<LoopLag>>,
    /// Natural frequency of a second-order answer, rad/s; together with `damping`; the preset's if left out.
    pub natural_frequency_radps: Option<Quantity<NaturalFrequency>>,
    /// Damping ratio of a second-order answer; together with `natural_frequency_radps`; the preset's if left out.
    pub damping: Option<Quantity<LoopDamping>>,
    /// Time until a reference begins to act, s; the preset's if left out.
    pub delay_s: Option<Quantity<LoopDelay>>,
    /// Fastest turn that the loop makes, rad/s; the preset's if left out.
    pub rate_max_radps: Option<Quantity<LoopRate>>,
}

/// Response of a speed loop.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurgeResponseFile {
    /// Time constant of the answer to a small step, s; the preset's if left out.
    pub time_constant_s: Option<Quantity<LoopLag>>,
    /// Time until a reference begins to act, s; the preset's if left out.
    pub delay_s: Option<Quantity<LoopDelay>>,
    /// Largest acceleration ahead, m/s²; the preset's if left out.
    pub acceleration_max_mps2: Option<Quantity<LoopAcceleration>>,
    /// Largest deceleration, m/s², positive; the preset's if left out.
    pub deceleration_max_mps2: Option<Quantity<LoopAcceleration>>,
    /// Whether the loop has an integrator that winds up noticeably; estimated if left out, as is its time.
    pub integrates: Option<bool>,
    /// Integral time of the loop, s: the integrator gathers the proportional part in it; the preset's if left out.
    pub integral_time_s: Option<Quantity<IntegralTime>>,
}

/// Power that propulsion draws at a steady speed through the water: linear · u + cubic · u³.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerFile {
    /// Linear coefficient, W/(m/s); 0 if left out.
    pub linear_w_per_mps: Option<Quantity<PowerCoefficient>>,
    /// Cubic coefficient, W/(m/s)³; 0 if left out.
    pub cubic_w_per_mps3: Option<Quantity<PowerCoefficient>>,
}
