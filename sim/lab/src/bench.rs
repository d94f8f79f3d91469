//! The scoreboard: every contender in every scenario from the same starts, the laws at gains found on other seeds.
//!
//! ```text
//! scenarios × laws × grid × tuning seeds → the best gains for each family of metrics
//! scenarios × contenders × families × seeds → scores;    scenarios × seeds → the clairvoyant's bound
//! ```
//! No clock, and seeds for everything: the same board on any number of threads.

use std::num::NonZeroUsize;

use planner::los::LosTuning;

mod contender;
mod jobs;
mod queue;
mod roster;
mod score;
pub(crate) mod statistics;
pub mod strangers;
#[cfg(test)]
mod tests;
mod variation;

pub(crate) use contender::{AUTO, CONSTANT_VELOCITY, PATH};
pub use contender::{Contender, Paths, Pilot};
pub(crate) use queue::in_parallel;
pub use roster::{TRANSIENTS, ablations, other_plant, pareto_front, sensitivity};
pub use score::{Family, Metric, Score};
pub use variation::Variation;

use sim::{guide::GuideError, mission::run_from, record::Record, scenario::Scenario};

/// The first seed that gains are found on: far from those that are scored.
pub const TUNING_SEED: u64 = 1_001;

/// What is to be run.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The scenarios, each with a surface craft.
    pub scenarios: Vec<Scenario>,
    /// The contenders.
    pub contenders: Vec<Contender>,
    /// How many seeds are scored, from 1 on; fewer than [`TUNING_SEED`].
    pub seeds: u64,
    /// How many seeds gains are found on, from [`TUNING_SEED`] on, at least one.
    pub tuning_seeds: u64,
    /// Runs at once.
    pub threads: NonZeroUsize,
}

/// All that came of it, scenario by scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// The seeds that were scored.
    pub seeds: Vec<u64>,
    /// One a scenario.
    pub matches: Vec<Match>,
}

/// What came of one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Match {
    /// The scenario's name.
    pub scenario: String,
    /// What happens in it.
    pub title: String,
    /// Whether every controller knows the paths.
    pub paths_known: bool,
    /// Those that took part, in the order of [`Bench::contenders`].
    pub entries: Vec<Entry>,
    /// Root mean square distance below which no craft could have stayed, m, seed by seed; none where that is unknown.
    pub bound_rms_m: Option<Vec<f64>>,
}

/// What came of one contender in one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Who.
    pub contender: Contender,
    /// Its runs by family, in the order of [`Family::ALL`].
    pub flown: [Flown; 3],
}

/// The runs by which a contender is judged in one family of metrics.
#[derive(Clone, Debug, PartialEq)]
pub struct Flown {
    /// A law's gains.
    pub tuning: Option<LosTuning>,
    /// Scores, seed by seed.
    pub scores: Vec<Score>,
}

/// Why there is no board.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// There is no surface craft to score.
    #[error("scenario {scenario} has no surface craft to score")]
    NoSurfaceCraft {
        /// The scenario.
        scenario: String,
    },
    /// A mission failed.
    #[error("the mission of {contender} in {scenario} with seed {seed} failed")]
    Mission {
        /// The scenario.
        scenario: String,
        /// Who steered.
        contender: String,
        /// The seed.
        seed: u64,
        /// Why.
        source: GuideError,
    },
}

impl Entry {
    /// The runs of a family.
    #[must_use]
    pub fn of(&self, family: Family) -> &Flown {
        let [nearness, economy, steering] = &self.flown;
        match family {
            Family::Nearness => nearness,
            Family::Economy => economy,
            Family::Steering => steering,
        }
    }

    /// A metric's values, seed by seed, from the runs at the gains for its family.
    #[must_use]
    pub fn values(&self, metric: Metric) -> Vec<f64> {
        self.values_at(metric, metric.family())
    }

    /// The mean of [`Self::values`].
    #[must_use]
    pub fn mean(&self, metric: Metric) -> f64 {
        statistics::mean(&self.values(metric)).centre
    }

    /// A metric's values, seed by seed, from the runs at the gains for `family`.
    #[must_use]
    pub(crate) fn values_at(&self, metric: Metric, family: Family) -> Vec<f64> {
        self.of(family)
            .scores
            .iter()
            .map(|score| metric.of(score))
            .collect()
    }
}

impl Match {
    /// The entry of the contender of that name, where it took part.
    #[must_use]
    pub fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.contender.name == name)
    }

    /// Of the entries that `may`, the one with the least mean of `metric`; of equals the first.
    #[must_use]
    pub fn least(&self, metric: Metric, may: impl Fn(&Contender) -> bool) -> Option<&Entry> {
        let eligible = self.entries.iter().filter(|entry| may(&entry.contender));
        eligible.min_by(|a, b| a.mean(metric).total_cmp(&b.mean(metric)))
    }
}

/// One mission of a contender.
pub fn fly(
    contender: &Contender,
    tuning: Option<LosTuning>,
    scenario: &Scenario,
    seed: u64,
) -> Result<Record, BenchError> {
    let mut guide = contender.guide(tuning);
    let varied = contender.scenario(scenario);
    let failed = |source| BenchError::Mission {
        scenario: scenario.name.clone(),
        contender: contender.name.clone(),
        seed,
        source,
    };
    let mut start = varied.start(seed).map_err(|error| failed(error.into()))?;
    if let Some(variation) = contender.variation {
        variation.vary_start(&mut start);
    }
    run_from(start, &varied, guide.as_mut(), seed, &mut |_| {}).map_err(failed)
}
