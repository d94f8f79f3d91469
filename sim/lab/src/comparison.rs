//! The planner and every tuned line-of-sight law on the same mission: same scenario, same seed, same snapshots.

use planner::{los::LosLaw, parameters::Parameters, snapshot::ForecastModel};
use serde::{Serialize, Serializer};
use sim::{
    guide::{Guide, LosGuide, MpcGuide},
    mission,
    record::Record,
    scenario::Scenario,
};

use crate::{
    scores::Scores,
    stopwatch::Stopwatch,
    tuning::{ComparisonError, LawGains, tune},
};

mod table;

/// Name of the planner among the controllers.
const PLANNER: &str = "mpc";

/// The controllers' scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scenario.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The controllers in the order of [`names`]. In JSON an object, by name.
    #[serde(serialize_with = "by_name")]
    pub controllers: Vec<Controller>,
}

fn by_name<S: Serializer>(all: &[Controller], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(all.iter().map(|controller| (controller.name, controller)))
}

/// Names of the controllers: the planner, then the laws in the order of [`LosLaw::ALL`].
pub fn names() -> impl Iterator<Item = &'static str> {
    std::iter::once(PLANNER).chain(LosLaw::ALL.map(LosLaw::name))
}

/// What one controller knew and achieved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controller {
    /// Its name.
    #[serde(skip)]
    pub name: &'static str,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// What it knew.
    pub information: Information,
    /// A law's gains: the best of its grid for this scenario and seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
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

impl Comparison {
    /// Tunes every law and runs its mission, then the planner's. `progress` gets what is being done and the fraction of it done.
    pub fn run(
        scenario: &Scenario,
        seed: u64,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Result<Self, ComparisonError> {
        let mut laws = vec![];
        for law in LosLaw::ALL {
            let stage = format!("tuning {}", law.name());
            let (tuning, _) = tune(law, scenario, seed, &mut |done| progress(&stage, done))?;
            let guide = &mut LosGuide::tuned(tuning);
            laws.push(Controller {
                gains: Some(LawGains::from(tuning)),
                ..fly(law.name(), scenario, guide, seed, progress)?
            });
        }
        let mpc = fly(
            PLANNER,
            scenario,
            &mut MpcGuide::new(Parameters::default()),
            seed,
            progress,
        )?;
        Ok(Self {
            scenario: scenario.name.clone(),
            seed,
            controllers: std::iter::once(mpc).chain(laws).collect(),
        })
    }

    /// The controller with the least root mean square distance.
    #[must_use]
    pub fn nearest(&self) -> &Controller {
        let all = self.controllers.iter();
        all.min_by(|a, b| a.scores.metrics.rms_m.total_cmp(&b.scores.metrics.rms_m))
            .expect("the planner is one of them")
    }
}

fn fly(
    name: &'static str,
    scenario: &Scenario,
    guide: &mut dyn Guide,
    seed: u64,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Controller, ComparisonError> {
    let mut stopwatch = Stopwatch::new(guide);
    let record = mission::run(scenario, &mut stopwatch, seed, &mut |done| progress(name, done));
    let record = record.map_err(ComparisonError::mission(scenario))?;
    let received = stopwatch.received;
    // A law looks at the present only, whatever the snapshots call for.
    let forecasts = if name == PLANNER {
        &received.forecasts[..]
    } else {
        &[]
    };
    Ok(Controller {
        name,
        scores: Scores::of(&record).ok_or_else(|| ComparisonError::no_surface_craft(scenario))?,
        information: Information {
            forecasts: forecasts.iter().copied().map(ForecastModel::name).collect(),
            current_known: received.with_current == received.snapshots,
        },
        gains: None,
        record,
    })
}
