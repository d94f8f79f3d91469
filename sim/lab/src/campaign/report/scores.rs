//! Means by scenario, who has the least of each, limits that were broken, and gains.

use serde::Serialize;

use super::gather::Gather;
use crate::campaign::{
    contender::Contender,
    statistics::{Measure, Question, compare, student::mean},
};

/// Counts of episodes beyond a limit or bound, and what that is.
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
    /// Means of the report's metrics, in their order and units; none where it has no value.
    pub(super) means: Vec<Option<f64>>,
    /// Half the width of each mean's 95 % interval, Student's.
    pub(super) half_widths: Vec<Option<f64>>,
    /// Of the metrics in which it has the least mean of those that may win.
    pub(super) is_least: Vec<bool>,
    /// Episodes a run beyond each limit that was broken.
    pub(super) beyond: Vec<(&'static str, f64)>,
    /// A tuned law's gains, and the objectives that they are for; of one craft alone.
    pub(super) gains: Vec<String>,
}

/// Who has the least mean of a metric in a scenario, of those that know no more than the scenario grants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Winner {
    pub(super) scenario: String,
    pub(super) metric: String,
    pub(super) controller: String,
    /// Those that its 95 % interval does not tell from it.
    pub(super) as_good: Vec<String>,
}

impl Gather<'_> {
    pub(super) fn winners(&self) -> Vec<Winner> {
        let mut winners = vec![];
        for scenario in &self.scenarios {
            for metric in &self.metrics {
                winners.extend(self.winner(scenario, metric));
            }
        }
        winners
    }

    fn winner(&self, scenario: &str, metric: &str) -> Option<Winner> {
        let eligible: Vec<&Contender> = self
            .campaign
            .controllers
            .iter()
            .filter(|contender| contender.may_win())
            .collect();
        let least = self.least(&eligible, scenario, metric)?;
        let is_as_good = |other: &&&Contender| {
            let question = Question {
                controller: &other.name,
                reference: &least.name,
                metric,
                scenario: Some(scenario),
                objective: None,
            };
            let found = compare(self.flights, question, self.campaign.file.seed);
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
                .map(|contender| contender.name.clone())
                .collect(),
        })
    }

    /// Of equals the first.
    fn least<'c>(&self, all: &[&'c Contender], scenario: &str, metric: &str) -> Option<&'c Contender> {
        let flown = all.iter().filter_map(|contender| {
            let values = self.flights.observations(&contender.name, metric, scenario);
            (!values.is_empty()).then(|| (*contender, mean(&values).centre))
        });
        flown
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(contender, _)| contender)
    }

    pub(super) fn scores(&self, winners: &[Winner]) -> Vec<Scores> {
        let mut all = vec![];
        for scenario in &self.scenarios {
            for contender in &self.campaign.controllers {
                let found: Vec<_> = self
                    .metrics
                    .iter()
                    .map(|metric| {
                        let values = self.flights.observations(&contender.name, metric, scenario);
                        (!values.is_empty()).then(|| mean(&values))
                    })
                    .collect();
                if found.iter().all(Option::is_none) {
                    continue;
                }
                let is_least = |metric: &&str| {
                    winners.iter().any(|winner| {
                        winner.scenario == **scenario
                            && winner.metric == **metric
                            && winner.controller == contender.name
                    })
                };
                all.push(Scores {
                    scenario: (*scenario).to_owned(),
                    controller: contender.name.clone(),
                    means: found.iter().map(|found| found.map(|mean| mean.centre)).collect(),
                    half_widths: found
                        .iter()
                        .map(|found| found.and_then(|mean| Some(mean.bounds?.1 - mean.centre)))
                        .collect(),
                    is_least: self.metrics.iter().map(is_least).collect(),
                    beyond: self.beyond(&contender.name, scenario),
                    gains: self.gains(&contender.name, scenario),
                });
            }
        }
        all
    }

    fn beyond(&self, controller: &str, scenario: &str) -> Vec<(&'static str, f64)> {
        let means = BEYOND.into_iter().filter_map(|(column, name)| {
            let values = self.flights.observations(controller, column, scenario);
            (!values.is_empty()).then(|| (name, mean(&values).centre))
        });
        means.filter(|(_, mean)| 0.0 < *mean).collect()
    }

    /// Gains of a law that was tuned, as rows of the first replicate have them.
    fn gains(&self, controller: &str, scenario: &str) -> Vec<String> {
        let flights = self.flights;
        let crafts = flights
            .groups
            .iter()
            .filter(|group| group.scenario == scenario)
            .count();
        if crafts != 1 {
            return vec![];
        }
        let rows = (0..flights.rows.len()).filter(|&row| {
            flights.word("controller", row) == controller
                && flights.word("scenario", row) == scenario
                && flights.value("replicate", row) == Some(0.0)
                && !flights.word("objectives", row).is_empty()
        });
        let named = rows.filter_map(|row| {
            let look_ahead = flights.value("look_ahead_m", row)?;
            let along = flights.value("along_track_gain_per_s", row)?;
            let integral = flights.value("integral_gain_mps", row)?;
            let objectives = flights.word("objectives", row);
            Some(format!("{look_ahead} / {along} / {integral} for {objectives}"))
        });
        named.collect()
    }
}
