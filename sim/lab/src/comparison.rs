//! The planner and every tuned line-of-sight law on the same mission: same scenario, seed and
//! snapshots. For a goal that visits, every rule, followed by planner and line of sight. It is a
//! campaign of one scenario and one replicate, which also tunes the gains.

use std::collections::BTreeMap;

use planner::FixedFigure;
use planner::forecast::{AuvForecast, Intent};
use planner::los::{LawGains, LosLaw, LosTuning};
use planner::snapshot::{FigureKind, Goal, Snapshot};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use sim::{fleet::Assigner, guide::GuideError, mission::Mission, record::Record, scenario::Scenario};

use crate::campaign::controller::ControlLaw;
use crate::campaign::design::Condition;
use crate::campaign::file::Objective;
use crate::campaign::fly::fly_while;
use crate::campaign::grid::{Setting, tuned};
use crate::campaign::{Campaign, tune};
use crate::http_guide::{GUIDE, GuideUrl};
use crate::rules::Rule;
use crate::scores::Scores;

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
    pub controllers: Vec<ComparedController>,
}

fn by_name<S: Serializer>(all: &[ComparedController], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(all.iter().map(|controller| (&controller.name, controller)))
}

/// Compared missions gave no result.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// There is nothing to guide.
    #[error(
        "scenario {0} has no surface craft, so there is nothing to compare; `pilotfish simulate {0}` runs it"
    )]
    NoSurfaceCraft(String),
    /// A mission of a scenario failed.
    #[error("a mission of scenario {0} failed")]
    Mission(String, #[source] GuideError),
}

/// The entries of a campaign file: planner, external law, then the laws, the rules that visit, the
/// figures, or of several craft the rules that assign AUVs.
fn controllers(scenario: &Scenario, guide: Option<&GuideUrl>) -> Vec<Value> {
    let mut all = vec![json!({ "name": PLANNER, "planner": {} })];
    if scenario.has_fleet() {
        let rule = |rule: Assigner| json!({ "name": rule.guide(), "planner": {}, "assign": rule });
        all.extend(Assigner::RULES.map(rule));
        return all;
    }
    all.extend(guide.map(|url| json!({ "name": GUIDE, "guide": url.to_string() })));
    if localises(scenario) {
        all.extend([FigureKind::Circle, FigureKind::ZigzagAstern, FigureKind::Above].map(|kind| {
            let kind = json!(kind);
            json!({ "name": kind, "planner": { "figure": { "kind": kind } } })
        }));
        all.push(json!({ "name": "greedy", "planner": {}, "rule": { "name": Rule::Greedy } }));
    } else if visits(scenario) {
        all.extend(Rule::ALL.into_iter().flat_map(|rule| {
            let [planner, law] = rule.names();
            let with = json!({ "name": rule });
            [
                json!({ "name": planner, "planner": {}, "rule": with }),
                json!({ "name": law, "law": { "name": LosLaw::SaturatedLos.name() }, "rule": with }),
            ]
        }));
    } else {
        all.extend(LosLaw::ALL.map(law_entry));
    }
    all
}

fn law_entry(law: LosLaw) -> Value {
    json!({ "name": law.name(), "law": { "name": law.name() } })
}

/// Names of the controllers, in their order.
pub fn names(scenario: &Scenario, guide: Option<&GuideUrl>) -> Vec<String> {
    let all = controllers(scenario, guide).into_iter();
    all.filter_map(|entry| Some(entry["name"].as_str()?.to_owned())).collect()
}

/// The law's best gains (least `rms_m` or visit cost). `progress` gets the fraction done.
pub fn best_gains(
    law: LosLaw,
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<LosTuning, ComparisonError> {
    let campaign = campaign(scenario, seed, &[law_entry(law)])?;
    let gains = best(&campaign, 0, progress).gains.expect("a law has gains");
    Ok(tuned(law, gains))
}

fn campaign(scenario: &Scenario, seed: u64, controllers: &[Value]) -> Result<Campaign, ComparisonError> {
    if !scenario.has_surface_craft() {
        return Err(ComparisonError::NoSurfaceCraft(scenario.name.clone()));
    }
    let objective = if localises(scenario) {
        Objective::NavigationRmsM
    } else if visits(scenario) {
        Objective::VisitMeanCost
    } else {
        Objective::RmsM
    };
    Ok(Campaign::of_mission(scenario, seed, objective, controllers))
}

/// The best point of a controller's grid; the first if every mission fails.
fn best(campaign: &Campaign, controller: usize, progress: &mut dyn FnMut(f64)) -> Setting {
    let grid = campaign.controllers[controller].grid();
    if grid.len() == 1 {
        return grid[0];
    }
    let found = tune::tune(campaign, 0, controller, progress);
    found.best.first().map_or(grid[0], |best| best.setting)
}

fn visits(scenario: &Scenario) -> bool {
    let craft = scenario.surface_craft.first();
    craft.is_some_and(|craft| matches!(craft.goal, Goal::Visit(_)))
}

fn localises(scenario: &Scenario) -> bool {
    let craft = scenario.surface_craft.first();
    craft.is_some_and(|craft| matches!(craft.goal, Goal::Localise(_)))
}

/// A controller's knowledge and scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedController {
    /// Its name.
    #[serde(skip)]
    pub name: String,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// Its knowledge.
    pub information: Information,
    /// Gains of a law: the best of its grid for this scenario and seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
    /// A rule's turn, or stay beyond the goal's least time, s: the grid's best for this mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// A figure that the planner did not choose: the grid's best for this mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<FixedFigure>,
    /// The record.
    #[serde(skip)]
    pub record: Record,
}

impl ComparedController {
    /// The compared value; less is better.
    fn value(&self) -> f64 {
        let metrics = &self.scores.metrics;
        let visits = metrics.visits.map(|visits| visits.mean_cost);
        visits.or(metrics.localisation.map(|localised| localised.rms_m)).unwrap_or(metrics.rms_m)
    }
}

/// A controller's knowledge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Information {
    /// Forecast models that it used for AUVs; none if it uses the present only.
    pub forecasts: Vec<&'static str>,
    /// `true` if every snapshot had the current.
    pub current_known: bool,
}

impl Information {
    /// Adds what `snapshot` told a controller that forecasts, or one that does not.
    fn add(&mut self, snapshot: &Snapshot, foresees: bool) {
        self.current_known &= snapshot.current.is_some();
        let current = snapshot.current();
        let known = snapshot.auvs.iter().zip(snapshot.paths()).filter(|_| foresees);
        for ((auv, path), estimate) in known.zip(snapshot.estimates()) {
            let is_followed = estimate.route.is_none_or(|route| route.is_followed());
            let intent = Intent {
                path: path.as_ref().filter(|_| is_followed),
                fit: None,
                doubt: 0.0,
                dive: auv.dive,
                forgets_after: estimate.forgets_after,
                tuned: &snapshot.tuned().forecast,
            };
            let model = AuvForecast::new(&estimate.state, intent, snapshot.forecast, &current).model;
            if !self.forecasts.contains(&model.name()) {
                self.forecasts.push(model.name());
            }
        }
    }
}

impl Comparison {
    /// Runs the mission of the law at `guide` first, if there is one: it may be away. Then tunes
    /// the others and runs their missions. `progress` gets the activity and its fraction done.
    pub fn run(
        scenario: &Scenario,
        seed: u64,
        guide: Option<&GuideUrl>,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Result<Self, ComparisonError> {
        let campaign = campaign(scenario, seed, &controllers(scenario, guide))?;
        let mut order: Vec<usize> = (0..campaign.controllers.len()).collect();
        order.sort_by_key(|&number| campaign.controllers[number].name != GUIDE);
        let flown = order.into_iter();
        let flown = flown.map(|number| Ok((number, fly(&campaign, number, progress)?)));
        let flown: BTreeMap<usize, ComparedController> = flown.collect::<Result<_, _>>()?;
        Ok(Self { scenario: scenario.name.clone(), seed, controllers: flown.into_values().collect() })
    }

    /// The controller with the least cost of visited AUVs, error of localised ones, or `rms_m`.
    pub fn best(&self) -> &ComparedController {
        self.least(ComparedController::value)
    }

    fn least(&self, value: impl Fn(&ComparedController) -> f64) -> &ComparedController {
        let all = self.controllers.iter();
        let least = all.min_by(|a, b| value(a).total_cmp(&value(b)));
        least.expect("the planner is one of them")
    }

    fn visits(&self) -> bool {
        self.controllers[0].scores.metrics.visits.is_some()
    }

    fn localises(&self) -> bool {
        self.controllers[0].scores.metrics.localisation.is_some()
    }
}

/// Finds the gains of a controller, and flies it.
fn fly(
    campaign: &Campaign,
    number: usize,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<ComparedController, ComparisonError> {
    let (controller, scenario) = (&campaign.controllers[number], &campaign.cases[0].scenario);
    let stage = format!("tuning {}", controller.name);
    let setting = best(campaign, number, &mut |done| progress(&stage, done));
    // A law uses the present only, independent of the snapshots' forecast models.
    let foresees = matches!(controller.law, ControlLaw::Planner { .. });
    let mut information = Information { forecasts: vec![], current_known: true };
    let mut watch = |mission: &Mission, snapshot: Option<&Snapshot>| {
        snapshot.inspect(|snapshot| information.add(snapshot, foresees));
        progress(&controller.name, mission.done());
        true
    };
    let flown = fly_while(campaign, Condition::default(), controller, setting, &mut watch);
    let flown = flown.map_err(|error| ComparisonError::Mission(scenario.name.clone(), error))?;
    let record = flown.expect("nothing stops it").record;
    Ok(ComparedController {
        name: controller.name.clone(),
        scores: Scores::of(&record).ok_or_else(|| ComparisonError::NoSurfaceCraft(scenario.name.clone()))?,
        information,
        gains: setting.gains,
        dwell_s: setting.dwell_s,
        figure: setting.figure,
        record,
    })
}

#[cfg(test)]
mod tests {
    use sim::{guide::LosGuide, metrics::Metrics, mission};

    use super::*;

    #[test]
    fn every_rule_flies_for_a_goal_that_visits() {
        let scenario = Scenario::named("visit-near").expect("exists").lasting(70.0);
        let comparison = Comparison::run(&scenario, 1, None, &mut |_, _| {}).expect("flies");
        let controllers = comparison.controllers.iter();
        let found: Vec<_> = controllers.map(|controller| controller.name.clone()).collect();
        assert_eq!(found, names(&scenario, None));
        assert_eq!(found.len(), 13);
        let turn = comparison.controllers[1].dwell_s.expect("was tuned");
        let best = comparison.best();
        let mut controllers = comparison.controllers.iter();
        assert!(controllers.all(|other| best.value() <= other.value()));
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
    fn rules_that_assign_auvs_fly_for_several_craft() {
        let scenario = Scenario::named("fleet-survey").expect("exists").lasting(20.0);
        let comparison = Comparison::run(&scenario, 1, None, &mut |_, _| {}).expect("flies");
        let names: Vec<_> = comparison.controllers.iter().map(|controller| &controller.name).collect();
        assert_eq!(names, ["mpc", "one", "nearest", "auction", "territories"]);
        let sailed = |i: usize| comparison.controllers[i].scores.fleet.as_ref().expect("are two");
        let energies = |i| sailed(i).craft.values().map(|craft| craft.energy_j).collect::<Vec<_>>();
        assert!(energies(1)[1] < 0.1 * energies(1)[0], "{:?}", energies(1));
        assert!(0.5 * energies(0)[0] < energies(0)[1], "{:?}", energies(0));
        assert!(comparison.controllers[0].scores.metrics.solve_ms_p50.is_some());
        let table = comparison.to_string();
        for line in ["least distance between craft, m", "the rules assign AUVs to craft"] {
            assert!(table.contains(line), "{table}");
        }
    }

    #[test]
    fn the_table_fits_a_hundred_columns_and_says_if_the_approach_decides() {
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
        assert!(!table.contains("_m ") && !table.contains("violations."), "{table}");
        // Where all of it is settled, nothing is said of an approach.
        for controller in &mut comparison.controllers {
            controller.record.settled_after = 0.0;
            controller.scores.metrics.settled_rms_m = controller.scores.metrics.rms_m;
        }
        assert!(!comparison.to_string().contains("approach"));
    }

    #[test]
    fn every_tuned_law_follows_its_target() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(600.0);
        let worst = |law| {
            let tuning = best_gains(law, &scenario, 1, &mut |_| {}).expect("tunes");
            let record = mission::run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("runs");
            Metrics::of(&record).surface_craft.expect("has one").rms_m
        };
        for law in [LosLaw::SaturatedLos, LosLaw::TrackerFrame, LosLaw::Integral] {
            // Most of it is the approach from 17 m off.
            assert!(worst(law) < 2.5, "{law:?}: {}", worst(law));
        }
        // Half the box's diagonal, and the target's motion, which is as long.
        let round_the_box = worst(LosLaw::WaypointBox);
        assert!((15.0..70.0).contains(&round_the_box), "{round_the_box}");
    }

    #[test]
    fn a_scenario_without_a_surface_craft_is_refused() {
        let scenario = Scenario::named("paper-path-following").expect("exists");
        let refused = Comparison::run(&scenario, 0, None, &mut |_, _| {});
        assert!(matches!(refused, Err(ComparisonError::NoSurfaceCraft(_))));
    }
}
