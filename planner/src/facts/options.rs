//! What a client chooses: how to forecast, and what to do without a solved program.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How an AUV's future is forecast from its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForecastModel {
    /// It stays where it is.
    Hold,
    /// It keeps its ground velocity, and its drift.
    ConstantVelocity,
    /// It keeps its speed and its rate of turn, and its drift.
    ConstantTurn,
    /// It follows its path at its speed through the water, with its present offset from the path. Its drift changes that
    /// offset for half a minute.
    Path,
}

impl ForecastModel {
    /// Its name wherever it leaves the program.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::ConstantVelocity => "constant_velocity",
            Self::ConstantTurn => "constant_turn",
            Self::Path => "path",
        }
    }
}

/// How the underwater vehicles' future is forecast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Forecast {
    /// The planner chooses for each vehicle: `hold` for one at rest; along its `path` if that is known and no more than
    /// 15 m away; without a `path` along what its track repeats, such as lanes or laps, by its `reports` and the `track` of the
    /// previous plan; else by its rate of turn.
    #[default]
    Auto,
    /// The same, but only paths that are declared are followed.
    Declared,
    /// Each stays where it is.
    Hold,
    /// Each keeps its ground velocity.
    ConstantVelocity,
    /// Each keeps its speed and its rate of turn.
    ConstantTurn,
    /// Each vehicle with a `path` follows it, at its present offset from the path; the planner chooses for the others.
    /// `auto` does the same, except for a vehicle that rests or is more than 15 m from its path.
    Path,
}

impl Forecast {
    /// The model that is chosen for every vehicle; `None` if the planner chooses.
    #[must_use]
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

/// What to do if no program was solved, or if the goal rests on a report that is too old.
///
/// Otherwise the candidate of least predicted cost answers: the solved program, the previous plan followed further, or line of
/// sight. The outcome is then `ok`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// The better of the previous plan and line of sight answers, or `hold` if the report is too old. The outcome is
    /// `degraded`.
    #[default]
    Los,
    /// Refuse with 503, or with 504 if the deadline was the reason.
    None,
}

/// What the last fallback level does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Circle slowly to starboard at the least speed that steers.
    #[default]
    SlowTurn,
    /// Stop the thrusters: speed reference 0 on the present heading.
    Stop,
}
