//! Controllers beside the reference, and their worst runs.

use serde::Serialize;

use super::data::Data;
use crate::campaign::controller::ControlLaw;
use crate::campaign::statistics::{Comparison, Effect, Measure, compare, effect, holm};

/// Worst runs of each controller.
const WORST: usize = 10;

/// A bad run of a controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Worst {
    pub(super) controller: String,
    pub(super) metric: String,
    pub(super) run: u64,
    pub(super) scenario: String,
    pub(super) craft: String,
    pub(super) replicate: f64,
    pub(super) value: f64,
    /// The reference's run in the same condition; none for the reference itself.
    pub(super) reference_run: Option<u64>,
    pub(super) reference_value: Option<f64>,
    pub(super) measure: Option<Measure>,
    /// Ratio to, or difference from, the reference's value.
    pub(super) by: Option<f64>,
}

impl Data<'_> {
    /// All controllers beside the reference in every metric: overall, then by scenario.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let mut all: Vec<Comparison> = vec![];
        for metric in self.metrics {
            for controller in self.compared() {
                let found = self.places().map(|scenario| {
                    let question = self.question(controller, metric, scenario);
                    compare(self.runs, question)
                });
                // Neither flew there.
                all.extend(found.filter(|found| {
                    0 < found.n_pairs + found.n_failed + found.n_reference_failed + found.n_missing
                }));
            }
        }
        let p: Vec<Option<f64>> = all.iter().map(|comparison| comparison.p).collect();
        for (comparison, adjusted) in all.iter_mut().zip(holm(&p)) {
            comparison.p_holm = adjusted;
        }
        all
    }

    pub(super) fn effects(&self) -> Vec<Effect> {
        let mut all: Vec<Effect> = vec![];
        for parameter in self.runs.parameters() {
            for metric in self.metrics {
                for controller in self.compared() {
                    let question = self.question(controller, metric, None);
                    all.extend(effect(self.runs, question, parameter));
                }
            }
        }
        let p: Vec<Option<f64>> = all.iter().map(|effect| effect.p).collect();
        for (effect, adjusted) in all.iter_mut().zip(holm(&p)) {
            effect.p_holm = adjusted;
        }
        all
    }

    /// The worst runs of each planner in the first metric, by the ratio to the reference; of the reference itself, by value.
    pub(super) fn worst(&self) -> Vec<Worst> {
        let Some(metric) = self.metrics.first() else {
            return vec![];
        };
        let planners = self.campaign.controllers.iter();
        let planners = planners.filter(|controller| matches!(controller.law, ControlLaw::Planner { .. }));
        planners
            .flat_map(|controller| self.worst_of(&controller.name, metric))
            .collect()
    }

    fn worst_of(&self, controller: &str, metric: &str) -> Vec<Worst> {
        let of = |row: usize, value: f64| Worst {
            controller: controller.to_owned(),
            metric: metric.to_owned(),
            run: self.runs.run(row),
            scenario: self.runs.word("scenario", row).to_owned(),
            craft: self.runs.word("craft", row).to_owned(),
            replicate: self.runs.value("replicate", row).unwrap_or_default(),
            value,
            reference_run: None,
            reference_value: None,
            measure: None,
            by: None,
        };
        let mut all: Vec<Worst> = if controller == self.reference {
            let flown = self.runs.of_controller(controller, metric).into_iter();
            flown
                .filter_map(|(_, row)| Some(of(row, self.runs.value(metric, row)?)))
                .collect()
        } else {
            let pairing = self.runs.pairing([controller, self.reference], metric, None);
            let measure = pairing.measure();
            let beside = pairing.pairs.iter().map(|pair| Worst {
                reference_run: Some(self.runs.run(pair.rows.1)),
                reference_value: Some(pair.values.1),
                measure: Some(measure),
                by: Some(measure.between(pair.values)),
                ..of(pair.rows.0, pair.values.0)
            });
            beside.collect()
        };
        let badness = |run: &Worst| run.by.unwrap_or(run.value);
        all.sort_by(|a, b| badness(b).total_cmp(&badness(a)));
        all.truncate(WORST);
        all
    }
}
