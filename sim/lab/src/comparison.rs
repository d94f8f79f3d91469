//! The planner and every tuned line-of-sight law on the same mission: same scenario, same seed, same snapshots.

use crate::{
    scores::Scores,
    stopwatch::Stopwatch,
    tuning::{TuningError, tune},
};
use planner::{
    los::{LosLaw, LosTuning},
    policy::Policy,
    snapshot::ForecastModel,
};
use serde::{Serialize, Serializer};
use sim::{
    guide::{Guide, GuideError, LosGuide, MpcGuide},
    metrics::Metrics,
    mission,
    record::Record,
    scenario::Scenario,
};

mod held_path;
mod table;

/// The controllers' scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scenario.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The controllers.
    pub controllers: Controllers,
    /// A sentence for each underwater vehicle that does not hold its path.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// The controllers. In JSON an object, by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Controllers {
    /// The planner.
    pub mpc: Controller,
    /// The line-of-sight laws in the order of [`LosLaw::ALL`], the gains of each the best of its grid for this
    /// scenario and seed.
    pub laws: Vec<(LosLaw, Controller)>,
}

impl Controllers {
    /// Names of all controllers, the planner's first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        std::iter::once("mpc").chain(LosLaw::ALL.map(LosLaw::name))
    }

    /// Every controller with its name, in the order of [`Controllers::names`].
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Controller)> {
        let controllers = self.laws.iter().map(|(_, controller)| controller);
        Self::names().zip(std::iter::once(&self.mpc).chain(controllers))
    }

    /// The name of the controller with the least root mean square distance. [`LosLaw::Printed`] is never it.
    #[must_use]
    pub fn nearest(&self) -> &'static str {
        let (name, _) = self
            .named()
            .filter(|(_, controller)| !controller.never_a_winner)
            .min_by(|(_, a), (_, b)| a.scores.rms_m.total_cmp(&b.scores.rms_m))
            .expect("the planner is one of them");
        name
    }
}

impl Serialize for Controllers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.named())
    }
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
    /// True of a law that is shown because it fails.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub never_a_winner: bool,
    /// The record.
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

/// Gains of a line-of-sight law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// Look-ahead distance, m.
    pub look_ahead_m: f64,
    /// Along-track gain, 1/s.
    pub along_track_gain_per_s: f64,
    /// Integral gain, m/s, of the law that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integral_gain_mps: Option<f64>,
}

/// What is being done, for a progress bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// A law's gains are searched for.
    Tuning(LosLaw),
    /// A law's mission runs.
    LineOfSight(LosLaw),
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
    #[error("a line-of-sight law could not be tuned")]
    Tuning(#[from] TuningError),
}

impl Comparison {
    /// Tunes every law and runs its mission, then the planner's. `progress` gets the stage and the fraction of it
    /// done.
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
        let mut laws = Vec::with_capacity(LosLaw::ALL.len());
        for law in LosLaw::ALL {
            laws.push((law, line_of_sight(law, scenario, seed, progress)?));
        }
        let mut mpc = MpcGuide::new(Policy::default());
        let mpc = flown(scenario, &mut mpc, seed, &mut |done| {
            progress(Stage::Planner, done);
        })?;
        Ok(Self {
            scenario: scenario.name.clone(),
            seed,
            // The underwater vehicles do the same under every controller.
            notes: held_path::notes(&mpc.record),
            controllers: Controllers { mpc, laws },
        })
    }
}

fn line_of_sight(
    law: LosLaw,
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(Stage, f64),
) -> Result<Controller, ComparisonError> {
    let (tuning, _) = tune(law, scenario, seed, &mut |done| {
        progress(Stage::Tuning(law), done);
    })?;
    let mut guide = LosGuide::tuned(tuning);
    let controller = flown(scenario, &mut guide, seed, &mut |done| {
        progress(Stage::LineOfSight(law), done);
    })?;
    Ok(Controller {
        gains: Some(Gains::from(tuning)),
        never_a_winner: !law.may_win(),
        information: Information {
            // It looks at the present only, whatever the snapshots call for.
            forecasts: vec![],
            ..controller.information
        },
        ..controller
    })
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
    let received = stopwatch.received;
    Ok(Controller {
        scores: Scores::new(&record, metrics),
        information: Information {
            forecasts: received
                .forecasts
                .iter()
                .copied()
                .map(ForecastModel::name)
                .collect(),
            current_known: received.with_current == received.snapshots,
        },
        gains: None,
        never_a_winner: false,
        record,
    })
}

impl From<LosTuning> for Gains {
    fn from(tuning: LosTuning) -> Self {
        Self {
            look_ahead_m: tuning.gains.look_ahead,
            along_track_gain_per_s: tuning.gains.along_track_gain,
            integral_gain_mps: (tuning.law == LosLaw::Integral).then_some(tuning.integral_gain),
        }
    }
}
