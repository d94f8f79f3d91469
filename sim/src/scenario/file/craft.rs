//! What a scenario file says that the planner is told of the craft: the members of the JSON object `craft`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{HeadingHeldFile, SpeedHeldFile};
use crate::scenario::quantity::{
    IntegralTime, LoopAcceleration, LoopDamping, LoopDelay, LoopLag, LoopRate, NaturalFrequency,
    PowerCoefficient, Quantity, RelativeUncertainty, SwayPerYawRate,
};

/// What the planner is told of how the craft answers its references; what is left out is the preset's or, without
/// one, learnt.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CraftFile {
    /// Name of a known craft of which everything is taken that is not told here.
    pub preset: Option<String>,
    /// How the heading loop answers.
    #[serde(default)]
    pub heading_loop: ToldHeadingLoopFile,
    /// How the speed loop answers.
    #[serde(default)]
    pub surge_loop: ToldSurgeLoopFile,
    /// Sway per surge and yaw rate, s, positive where the craft drifts outwards in a turn.
    pub sway_per_yaw_rate_s: Option<Quantity<SwayPerYawRate>>,
    /// Power that propulsion draws at a steady speed through the water.
    pub power: Option<PowerFile>,
    /// What the speed reference is held against.
    pub speed_held: Option<SpeedHeldFile>,
    /// What the heading reference is held against.
    pub heading_held: Option<HeadingHeldFile>,
    /// Standard deviation of the numbers told, as a part of each.
    pub relative_uncertainty: Option<Quantity<RelativeUncertainty>>,
}

/// How a heading loop answers: with a time constant, or with a natural frequency and a damping ratio.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToldHeadingLoopFile {
    /// Time constant of a first-order answer, s.
    pub time_constant_s: Option<Quantity<LoopLag>>,
    /// Natural frequency of a second-order answer, rad/s; together with `damping`.
    pub natural_frequency_radps: Option<Quantity<NaturalFrequency>>,
    /// Damping ratio of a second-order answer; together with `natural_frequency_radps`.
    pub damping: Option<Quantity<LoopDamping>>,
    /// Time until a reference begins to act, s.
    pub delay_s: Option<Quantity<LoopDelay>>,
    /// Fastest turn that the loop makes, rad/s.
    pub rate_max_radps: Option<Quantity<LoopRate>>,
}

/// How a speed loop answers.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToldSurgeLoopFile {
    /// Time constant of the answer to a small step, s.
    pub time_constant_s: Option<Quantity<LoopLag>>,
    /// Time until a reference begins to act, s.
    pub delay_s: Option<Quantity<LoopDelay>>,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max_mps2: Option<Quantity<LoopAcceleration>>,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max_mps2: Option<Quantity<LoopAcceleration>>,
    /// Whether the loop has an integrator that winds up noticeably; learnt if neither this nor its time is given.
    pub integrates: Option<bool>,
    /// Time in which the integrator gathers what the proportional part asks for, s.
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
