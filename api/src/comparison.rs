//! The planner and the tuned line-of-sight law on the same mission: same scenario, same seed, same
//! snapshots.

use std::fmt;

use planner::{los::LosGains, policy::Policy, snapshot::ForecastModel};
use serde::Serialize;
use sim::{
    guide::{Guide, GuideError, LosGuide, MpcGuide},
    metrics::Metrics,
    mission,
    record::Record,
    scenario::Scenario,
    tuning::{TuningError, tune_los},
};

use crate::{
    scores::Scores,
    stopwatch::{Stopwatch, Told},
};

/// Both controllers' scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scenario.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The controllers.
    pub controllers: Controllers,
}

/// The controllers by name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controllers {
    /// The planner.
    pub mpc: Controller,
    /// The saturated line-of-sight law, its gains the best of the grid for this scenario and seed.
    pub saturated_los: Controller,
}

/// What one controller knew and achieved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controller {
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// What it knew.
    pub information: Information,
    /// The gains it was tuned to, where it has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gains: Option<Gains>,
    /// What happened.
    #[serde(skip)]
    pub record: Record,
}

/// What a controller knew.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Information {
    /// Forecast models of the underwater vehicles that it used; none if it looks at the present only.
    pub forecasts: Vec<&'static str>,
    /// Whether every snapshot gave it the current.
    pub current_known: bool,
}

/// Gains of the line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// Look-ahead distance, m.
    pub look_ahead_m: f64,
    /// Along-track gain, 1/s.
    pub along_track_gain_per_s: f64,
}

/// What is being done, for a progress bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The law's gains are searched for.
    Tuning,
    /// The law's mission runs.
    LineOfSight,
    /// The planner's mission runs.
    Planner,
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// Nothing to guide.
    #[error(
        "scenario {scenario} has no surface craft, so there is nothing to compare; \
         `pilotfish simulate {scenario}` runs it"
    )]
    NoSurfaceCraft {
        /// The scenario.
        scenario: String,
    },
    /// A mission failed.
    #[error("a mission failed")]
    Mission(#[source] GuideError),
    /// The gains could not be tuned.
    #[error("the line-of-sight law could not be tuned")]
    Tuning(#[from] TuningError),
}

impl Comparison {
    /// Tunes the law, then runs both missions. `progress` is told the stage and the fraction of it done.
    pub fn run(
        scenario: &Scenario,
        seed: u64,
        progress: &mut dyn FnMut(Stage, f64),
    ) -> Result<Self, ComparisonError> {
        if !scenario.has_surface_craft() {
            return Err(ComparisonError::NoSurfaceCraft {
                scenario: scenario.name.clone(),
            });
        }
        let (gains, _) = tune_los(scenario, seed, &mut |done| progress(Stage::Tuning, done))?;
        let mut los = LosGuide::new(gains);
        let mut line_of_sight = flown(scenario, &mut los, seed, &mut |done| {
            progress(Stage::LineOfSight, done);
        })?;
        // It looks at the present only, whatever the snapshots call for.
        line_of_sight.information.forecasts.clear();
        let mut mpc = MpcGuide::new(Policy::default());
        let mpc = flown(scenario, &mut mpc, seed, &mut |done| {
            progress(Stage::Planner, done);
        })?;
        let saturated_los = Controller {
            gains: Some(Gains::from(gains)),
            ..line_of_sight
        };
        Ok(Self {
            scenario: scenario.name.clone(),
            seed,
            controllers: Controllers { mpc, saturated_los },
        })
    }
}

fn flown(
    scenario: &Scenario,
    guide: &mut dyn Guide,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Controller, ComparisonError> {
    let mut stopwatch = Stopwatch::new(guide);
    let record = mission::run(scenario, &mut stopwatch, seed, progress).map_err(ComparisonError::Mission)?;
    let metrics = Metrics::of(&record)
        .surface_craft
        .ok_or_else(|| ComparisonError::NoSurfaceCraft {
            scenario: scenario.name.clone(),
        })?;
    let told = stopwatch.told;
    Ok(Controller {
        scores: Scores::new(&record, metrics),
        information: Information {
            forecasts: told.forecasts.iter().copied().map(model_name).collect(),
            current_known: current_known(&told),
        },
        gains: None,
        record,
    })
}

fn current_known(told: &Told) -> bool {
    told.with_current == told.snapshots
}

fn model_name(model: ForecastModel) -> &'static str {
    match model {
        ForecastModel::Hold => "hold",
        ForecastModel::ConstantVelocity => "constant_velocity",
        ForecastModel::ConstantTurn => "constant_turn",
        ForecastModel::Path => "path",
    }
}

impl From<LosGains> for Gains {
    fn from(gains: LosGains) -> Self {
        Self {
            look_ahead_m: gains.look_ahead,
            along_track_gain_per_s: gains.along_track_gain,
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Controllers { mpc, saturated_los } = &self.controllers;
        writeln!(f, "{}, seed {}", self.scenario, self.seed)?;
        writeln!(f, "{:<26}{:>20}{:>20}", "", "mpc", "saturated_los")?;
        for ((name, planned), (_, line_of_sight)) in
            mpc.scores.lines().iter().zip(saturated_los.scores.lines())
        {
            writeln!(f, "{name:<26}{planned:>20}{line_of_sight:>20}")?;
        }
        let known = |controller: &Controller| {
            if controller.information.current_known {
                "yes"
            } else {
                "no"
            }
        };
        writeln!(
            f,
            "{:<26}{:>20}{:>20}",
            "current known",
            known(mpc),
            known(saturated_los)
        )?;
        writeln!(f)?;
        writeln!(
            f,
            "mpc forecasts with {}.",
            mpc.information.forecasts.join(" and ")
        )?;
        if let Some(Gains {
            look_ahead_m,
            along_track_gain_per_s,
        }) = saturated_los.gains
        {
            writeln!(
                f,
                "saturated_los sees the goal's present motion; tuned over its grid to a look-ahead of \
                 {look_ahead_m} m and an along-track gain of {along_track_gain_per_s} 1/s."
            )?;
        }
        Ok(())
    }
}
