//! Means by scenario, the least of each, broken limits, and gains.

use serde::Serialize;

use super::data::Data;
use crate::campaign::{
    controller::Controller,
    statistics::{Measure, Question, compare},
};

/// Columns of violations, and their names.
const BEYOND: [(&str, &str); 7] = [
    ("speed_violations", "speed"),
    ("reference_violations", "reference"),
    ("turn_rate_violations", "turn rate"),
    ("keep_out_violations", "keep-out"),
    ("area_violations", "area"),
    ("range_violations", "range"),
    ("energy_violations", "energy"),
];

/// A controller in a scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Scores {
    pub(super) scenario: String,
    pub(super) controller: String,
    /// Means of the report's metrics, in their order and units.
    pub(super) means: Vec<Option<f64>>,
    /// Half the width of each mean's 95 % interval, Student's.
    pub(super) half_widths: Vec<Option<f64>>,
    /// Whether it has the least mean of each metric, among those that may win.
    pub(super) is_least: Vec<bool>,
    /// Episodes per run beyond each broken limit.
    pub(super) beyond: Vec<(&'static str, f64)>,
    /// Gains of a tuned law with their objectives, if there is one craft.
    pub(super) gains: Vec<String>,
}

/// The controller with the least mean of a metric in a scenario, among those that know no more than the scenario grants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Winner {
    pub(super) scenario: String,
    pub(super) metric: String,
    pub(super) controller: String,
    /// Controllers that a paired 95 % interval does not distinguish from it.
    pub(super) as_good: Vec<String>,
}

impl Data<'_> {
    pub(super) fn winners(&self) -> Vec<Winner> {
        let mut winners = vec![];
        for scenario in &self.scenarios {
            for metric in self.metrics {
                winners.extend(self.winner(scenario, metric));
            }
        }
        winners
    }

    fn winner(&self, scenario: &str, metric: &str) -> Option<Winner> {
        let eligible: Vec<&Controller> = self
            .campaign
            .controllers
            .iter()
            .filter(|controller| controller.may_win())
            .collect();
        let least = self.least(&eligible, scenario, metric)?;
        let is_as_good = |other: &&&Controller| {
            let question = Question {
                reference: &least.name,
                ..self.question(&other.name, metric, Some(scenario))
            };
            let found = compare(self.runs, question);
            let nought = if found.measure == Measure::Ratio { 1.0 } else { 0.0 };
            let holds = match (found.student_95, found.estimate) {
                (Some([low, high]), _) => low <= nought && nought <= high,
                (None, estimate) => estimate == Some(nought),
            };
            other.name != least.name && holds
        };
        Some(Winner {
            scenario: scenario.to_owned(),
            metric: metric.to_owned(),
            controller: least.name.clone(),
            as_good: eligible
                .iter()
                .filter(is_as_good)
                .map(|controller| controller.name.clone())
                .collect(),
        })
    }

    pub(super) fn scores(&self, winners: &[Winner]) -> Vec<Scores> {
        let mut all = vec![];
        for scenario in &self.scenarios {
            for controller in &self.campaign.controllers {
                let found = self.metrics.iter();
                let found: Vec<_> = found
                    .map(|metric| self.mean(&controller.name, metric, scenario))
                    .collect();
                if found.iter().all(Option::is_none) {
                    continue;
                }
                let is_least = |metric: &String| {
                    winners.iter().any(|winner| {
                        winner.scenario == **scenario
                            && winner.metric == *metric
                            && winner.controller == controller.name
                    })
                };
                all.push(Scores {
                    scenario: (*scenario).to_owned(),
                    controller: controller.name.clone(),
                    means: found.iter().map(|found| found.map(|mean| mean.centre)).collect(),
                    half_widths: found
                        .iter()
                        .map(|found| found.and_then(|mean| Some(mean.bounds?[1] - mean.centre)))
                        .collect(),
                    is_least: self.metrics.iter().map(is_least).collect(),
                    beyond: self.beyond(&controller.name, scenario),
                    gains: self.gains(&controller.name, scenario),
                });
            }
        }
        all
    }

    fn beyond(&self, controller: &str, scenario: &str) -> Vec<(&'static str, f64)> {
        let means = BEYOND
            .into_iter()
            .filter_map(|(column, name)| Some((name, self.mean(controller, column, scenario)?.centre)));
        means.filter(|(_, mean)| 0.0 < *mean).collect()
    }

    /// Gains of a tuned law, from the rows of the first replicate.
    fn gains(&self, controller: &str, scenario: &str) -> Vec<String> {
        let runs = self.runs;
        let crafts = runs
            .groups
            .iter()
            .filter(|group| group.scenario == scenario)
            .count();
        if crafts != 1 {
            return vec![];
        }
        let rows = (0..runs.rows.len()).filter(|&row| {
            runs.word("controller", row) == controller
                && runs.word("scenario", row) == scenario
                && runs.value("replicate", row) == Some(0.0)
                && !runs.word("objectives", row).is_empty()
        });
        let named = rows.filter_map(|row| {
            let look_ahead = runs.value("look_ahead_m", row)?;
            let along = runs.value("along_track_gain_per_s", row)?;
            let integral = runs.value("integral_gain_mps", row)?;
            let objectives = runs.word("objectives", row);
            Some(format!("{look_ahead} / {along} / {integral} for {objectives}"))
        });
        named.collect()
    }
}
