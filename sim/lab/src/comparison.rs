//! The planner and every tuned line-of-sight law on the same mission: same scenario, same seed, same snapshots. Where the goal visits,
//! every rule instead, followed by the planner and by line of sight.

use planner::{
    los::{LawGains, LosLaw},
    parameters::Parameters,
    snapshot::ForecastModel,
};
use serde::{Serialize, Serializer};
use sim::{
    guide::{Guide, LosGuide, MpcGuide},
    mission,
    record::Record,
    scenario::{GoalFile, Scenario},
};

use crate::{
    http_guide::{GUIDE, GuideUrl, HttpGuide},
    rules::{Rule, Ruled},
    scores::Scores,
    stopwatch::Stopwatch,
    tuning::{ComparisonError, Setting, grid, tune, tuned},
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

/// Names of the controllers: the planner, a law outside of this program if there is one, then the laws in the order of [`LosLaw::ALL`]
/// or the rules in that of [`Rule::ALL`].
#[must_use]
pub fn names(scenario: &Scenario, guide: Option<&GuideUrl>) -> Vec<&'static str> {
    let others = if visits(scenario) {
        Rule::ALL.into_iter().flat_map(Rule::names).collect()
    } else {
        LosLaw::ALL.map(LosLaw::name).to_vec()
    };
    let guide = guide.map(|_| GUIDE);
    [PLANNER].into_iter().chain(guide).chain(others).collect()
}

fn visits(scenario: &Scenario) -> bool {
    let craft = scenario.surface_craft.as_ref();
    craft.is_some_and(|craft| matches!(craft.goal, GoalFile::Visit { .. }))
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
    /// Gains of a law: the best of its grid for this scenario and seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
    /// A rule's time of a turn, or of a stay beyond the goal's least time, s: the best of its grid for this scenario and seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// The record.
    #[serde(skip)]
    pub record: Record,
}

impl Controller {
    /// What it is compared by: less is better.
    fn value(&self) -> f64 {
        let metrics = &self.scores.metrics;
        metrics.visits.map_or(metrics.rms_m, |visits| visits.mean_cost)
    }
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
    /// Runs the mission of the law at `guide`, if there is one, tunes every other law and runs its mission, then the planner's. `progress` gets what is being done and the fraction of it done.
    pub fn run(
        scenario: &Scenario,
        seed: u64,
        guide: Option<&GuideUrl>,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Result<Self, ComparisonError> {
        let own = guide.map(|url| fly((GUIDE, false), scenario, &mut HttpGuide::new(url), seed, progress));
        let own = own.transpose()?;
        let others = if visits(scenario) {
            all_rules(scenario, seed, progress)?
        } else {
            all_laws(scenario, seed, progress)?
        };
        let mpc = &mut MpcGuide::new(Parameters::default());
        let mpc = fly((PLANNER, true), scenario, mpc, seed, progress)?;
        Ok(Self {
            scenario: scenario.name.clone(),
            seed,
            controllers: [mpc].into_iter().chain(own).chain(others).collect(),
        })
    }

    /// The controller with the least of what is compared: mean cost of AUVs that are visited, or root mean square distance over the
    /// whole mission.
    #[must_use]
    pub fn best(&self) -> &Controller {
        self.least(Controller::value)
    }

    fn least(&self, value: impl Fn(&Controller) -> f64) -> &Controller {
        let all = self.controllers.iter();
        let least = all.min_by(|a, b| value(a).total_cmp(&value(b)));
        least.expect("the planner is one of them")
    }

    /// Whether AUVs are visited.
    fn visits(&self) -> bool {
        self.controllers[0].scores.metrics.visits.is_some()
    }
}

type Progress<'a> = &'a mut dyn FnMut(&str, f64);

fn all_laws(
    scenario: &Scenario,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Controller>, ComparisonError> {
    let mut laws = vec![];
    for law in LosLaw::ALL {
        let stage = format!("tuning {}", law.name());
        let (tuning, _) = tune(law, scenario, seed, &mut |done| progress(&stage, done))?;
        let guide = &mut LosGuide::tuned(tuning);
        laws.push(Controller {
            gains: Some(LawGains::from(tuning)),
            ..fly((law.name(), false), scenario, guide, seed, progress)?
        });
    }
    Ok(laws)
}

fn all_rules(
    scenario: &Scenario,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Controller>, ComparisonError> {
    let mut all = vec![];
    for rule in Rule::ALL {
        for (name, foresees) in rule.names().into_iter().zip([true, false]) {
            let laws = if foresees {
                vec![]
            } else {
                grid(LosLaw::SaturatedLos)
            };
            let mut best: Option<Controller> = None;
            for setting in Setting::grid(&laws, rule.dwells()) {
                let guide: Box<dyn Guide> = match setting.gains {
                    None => Box::new(MpcGuide::new(Parameters::default())),
                    Some(gains) => Box::new(LosGuide::tuned(tuned(LosLaw::SaturatedLos, gains))),
                };
                let mut guide = Ruled::new(guide, rule, setting.dwell_s.unwrap_or(0.0));
                let flown = Controller {
                    gains: setting.gains,
                    dwell_s: setting.dwell_s,
                    ..fly((name, foresees), scenario, &mut guide, seed, progress)?
                };
                if best.as_ref().is_none_or(|best| flown.value() < best.value()) {
                    best = Some(flown);
                }
            }
            all.extend(best);
        }
    }
    Ok(all)
}

/// Flies the controller of that name, and whether it foresees.
fn fly(
    (name, foresees): (&'static str, bool),
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
    let forecasts = if foresees { &received.forecasts[..] } else { &[] };
    Ok(Controller {
        name,
        scores: Scores::of(&record).ok_or_else(|| ComparisonError::no_surface_craft(scenario))?,
        information: Information {
            forecasts: forecasts.iter().copied().map(ForecastModel::name).collect(),
            current_known: received.with_current == received.snapshots,
        },
        gains: None,
        dwell_s: None,
        record,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::metrics::Metrics;

    #[test]
    fn where_the_goal_visits_every_rule_flies_at_its_best_time() {
        let scenario = Scenario::named("visit-near").expect("exists").lasting(70.0);
        let comparison = Comparison::run(&scenario, 1, None, &mut |_, _| {}).expect("flies");
        let found: Vec<_> = comparison
            .controllers
            .iter()
            .map(|controller| controller.name)
            .collect();
        assert_eq!(found, names(&scenario, None));
        assert_eq!(found.len(), 13);
        let clock = &comparison.controllers[1];
        let turn = clock.dwell_s.expect("was tuned");
        for &dwell in Rule::Clock.dwells() {
            let mut guide = Ruled::new(Box::new(MpcGuide::new(Parameters::default())), Rule::Clock, dwell);
            let record = mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("flies");
            let metrics = Metrics::of(&record).surface_craft.expect("has one");
            let cost = metrics.visits.expect("visits").mean_cost;
            assert!(
                clock.value() <= cost && (dwell != turn || clock.value() == cost),
                "{dwell} s: {cost}"
            );
        }
        let best = comparison.best();
        assert!(
            comparison
                .controllers
                .iter()
                .all(|other| best.value() <= other.value())
        );
        let table = comparison.to_string();
        for line in [
            format!("Least mean cost of the AUVs: {}.", best.name),
            format!("clock: {turn} s."),
            "\nmean cost of the AUVs ".to_owned(),
        ] {
            assert!(table.contains(&line), "{line}");
        }
    }

    #[test]
    fn the_table_fits_a_hundred_columns_and_says_where_the_approach_decides() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(200.0);
        let mut comparison = Comparison::run(&scenario, 1, None, &mut |_, _| {}).expect("flies");
        let table = comparison.to_string();
        for line in table.lines() {
            assert!(line.chars().count() <= 100, "{line}");
        }
        let metrics = &comparison.controllers[0].scores.metrics;
        // From 17 m off to some centimetres.
        let whole = format!("{:.3}", metrics.rms_m);
        let settled = format!("{:.3}", metrics.settled_rms_m);
        let lines: Vec<&str> = table.lines().collect();
        let row = |head: &str, value: &str| {
            let found = lines.iter().position(|line| line.starts_with(head));
            let at = found.expect("is a row");
            assert!(lines[at].contains(value), "{head}");
            at
        };
        let at = row("distance, RMS, whole mission, m", &whole);
        assert_eq!(row("distance, RMS, once settled, m", &settled), at + 1);
        assert!(table.contains("The approach makes at least"), "{table}");
        // No key of the JSON is left over.
        assert!(
            !table.contains("_m ") && !table.contains("violations."),
            "{table}"
        );
        // Where all of it is settled, nothing is said of an approach.
        for controller in &mut comparison.controllers {
            controller.record.settled_after = 0.0;
            controller.scores.metrics.settled_rms_m = controller.scores.metrics.rms_m;
        }
        assert!(!comparison.to_string().contains("approach"));
    }
}
