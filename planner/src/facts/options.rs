//! Options of a client: the forecast model, and the fallback without a solved program.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Forecast model of an AUV.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForecastModel {
    /// It stays at its position.
    Hold,
    /// It keeps its ground velocity and its drift. `auto`, with reports: the mean over its turns.
    ConstantVelocity,
    /// It keeps its speed, its rate of turn and its drift. `auto`, with reports: it forgets them.
    ConstantTurn,
    /// It follows its path at its speed through the water and its present offset from the path. Its
    /// drift changes the offset for half a minute.
    Path,
}

impl ForecastModel {
    /// Its name in JSON and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::ConstantVelocity => "constant_velocity",
            Self::ConstantTurn => "constant_turn",
            Self::Path => "path",
        }
    }
}

/// Forecast of the underwater vehicles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Forecast {
    /// The planner chooses for each vehicle: `hold` at rest; along its `path` if it is at most 15 m
    /// away; without a `path`, along the lanes or laps that its `reports` and the previous plan's
    /// `track` repeat; else with its rate of turn. Off any path, a vehicle with `reports` forgets
    /// its course over 60 m, or as its past track tells: the mean over turns that nobody declared.
    #[default]
    Auto,
    /// As `auto`, but only declared paths are followed.
    Declared,
    /// Each stays at its position.
    Hold,
    /// Each keeps its ground velocity.
    ConstantVelocity,
    /// Each keeps its speed and rate of turn.
    ConstantTurn,
    /// Each vehicle with a `path` follows it at its present offset; the planner chooses for the
    /// others. Unlike `auto`, this includes vehicles at rest or more than 15 m from their path.
    Path,
}

impl Forecast {
    /// The model for all vehicles; `None` if the planner chooses.
    pub fn model(self) -> Option<ForecastModel> {
        match self {
            Self::Auto | Self::Declared => None,
            Self::Hold => Some(ForecastModel::Hold),
            Self::ConstantVelocity => Some(ForecastModel::ConstantVelocity),
            Self::ConstantTurn => Some(ForecastModel::ConstantTurn),
            Self::Path => Some(ForecastModel::Path),
        }
    }
}

impl From<ForecastModel> for Forecast {
    fn from(model: ForecastModel) -> Self {
        match model {
            ForecastModel::Hold => Self::Hold,
            ForecastModel::ConstantVelocity => Self::ConstantVelocity,
            ForecastModel::ConstantTurn => Self::ConstantTurn,
            ForecastModel::Path => Self::Path,
        }
    }
}

/// Behaviour if no program was solved, or if the goal depends on a report that is too old.
///
/// Otherwise the candidate of least predicted cost answers with the outcome `ok`: the solved
/// program, the continued previous plan, or line of sight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// The better of the previous plan and line of sight answers, or `hold` if the report is too
    /// old. The outcome is `degraded`.
    #[default]
    Los,
    /// Refuse with 503, or with 504 after the deadline.
    None,
}

/// The last fallback level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Circle slowly to starboard at the least speed that steers.
    #[default]
    SlowTurn,
    /// Stop the thrusters: speed reference 0 on the present heading.
    Stop,
}
