//! Numbers of a report, out of the rows.

use super::numbers::{ControllerFlown, Part, Regret, Worst};
use crate::campaign::{
    contender::Pilot,
    design::Campaign,
    statistics::{
        Comparison, Effect, Flights, Question, compare, effect, holm,
        student::{mean, median},
        worst,
    },
};

/// Worst runs of each controller.
const WORST: usize = 10;
/// The column that the bound is for.
const BOUNDED: &str = "rms_m";
/// Where answers come from, as columns say.
const ANSWERS: [&str; 4] = [
    "answers_mpc",
    "answers_previous_plan",
    "answers_saturated_los",
    "answers_hold",
];

/// What numbers are made of.
pub(super) struct Gather<'a> {
    pub(super) campaign: &'a Campaign,
    pub(super) flights: &'a Flights,
    pub(super) metrics: Vec<&'a str>,
    pub(super) scenarios: Vec<&'a str>,
    pub(super) reference: &'a str,
}

impl Gather<'_> {
    pub(super) fn controllers(&self) -> Vec<ControllerFlown> {
        let all = self.campaign.controllers.iter();
        all.map(|contender| {
            let rows: Vec<usize> = (0..self.flights.rows.len())
                .filter(|&row| self.flights.word("controller", row) == contender.name)
                .collect();
            let values = |name: &str| -> Vec<f64> {
                rows.iter()
                    .filter_map(|&row| self.flights.value(name, row))
                    .collect()
            };
            let counts = ANSWERS.map(|name| values(name).iter().sum::<f64>());
            let n_answers: f64 = counts.iter().sum();
            let [mpc, previous_plan, saturated_los, hold] =
                counts.map(|count| (0.0 < n_answers).then(|| count / n_answers));
            let may_not_win = contender.law_flown().is_some_and(|law| !law.may_win());
            ControllerFlown {
                name: contender.name.clone(),
                information: contender.information(),
                part: if contender.name == self.reference {
                    Part::Reference
                } else if may_not_win {
                    Part::Shown
                } else if contender.may_win() {
                    Part::Compared
                } else {
                    Part::KnowsMore
                },
                is_planner: matches!(contender.pilot, Pilot::Planner { .. }),
                n_runs: rows.len(),
                n_failed: rows.iter().filter(|&&row| self.flights.failed(row)).count(),
                n_answers,
                answers_mpc: mpc,
                answers_previous_plan: previous_plan,
                answers_saturated_los: saturated_los,
                answers_hold: hold,
                solve_ms_p50_median: median(&values("solve_ms_p50")),
                solve_ms_p99_worst: values("solve_ms_p99").into_iter().reduce(f64::max),
            }
        })
        .collect()
    }

    /// Everyone beside the reference in every metric: overall, then by scenario.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let mut all: Vec<Comparison> = vec![];
        for metric in &self.metrics {
            for controller in self.compared() {
                let places = std::iter::once(None).chain(self.scenarios.iter().copied().map(Some));
                let found = places.map(|scenario| {
                    let question = Question {
                        controller,
                        reference: self.reference,
                        metric,
                        scenario,
                        objective: None,
                    };
                    compare(self.flights, question, self.campaign.file.seed)
                });
                // Neither flew there: there is nothing to say.
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
        for parameter in self.flights.parameters() {
            for metric in &self.metrics {
                for controller in self.compared() {
                    let question = Question {
                        controller,
                        reference: self.reference,
                        metric,
                        scenario: None,
                        objective: None,
                    };
                    all.extend(effect(self.flights, question, parameter));
                }
            }
        }
        let p: Vec<Option<f64>> = all.iter().map(|effect| effect.p).collect();
        for (effect, adjusted) in all.iter_mut().zip(holm(&p)) {
            effect.p_holm = adjusted;
        }
        all
    }

    /// The planner's worst runs in the first metric: beside the reference, and those of the reference itself by their values.
    pub(super) fn worst(&self) -> Vec<Worst> {
        let Some(metric) = self.metrics.first() else {
            return vec![];
        };
        let planners = self.campaign.controllers.iter();
        let planners = planners.filter(|contender| matches!(contender.pilot, Pilot::Planner { .. }));
        planners
            .flat_map(|contender| self.worst_of(&contender.name, metric))
            .collect()
    }

    fn worst_of(&self, controller: &str, metric: &str) -> Vec<Worst> {
        let of = |row: usize, value: f64| Worst {
            controller: controller.to_owned(),
            metric: metric.to_owned(),
            run: self.flights.run(row),
            scenario: self.flights.word("scenario", row).to_owned(),
            craft: self.flights.word("craft", row).to_owned(),
            replicate: self.flights.value("replicate", row).unwrap_or_default(),
            value,
            reference_run: None,
            reference_value: None,
            measure: None,
            by: None,
        };
        if controller != self.reference {
            let pairing = self.flights.pairing([controller, self.reference], metric, None);
            let beside = worst(&pairing, WORST).into_iter().map(|worst| Worst {
                reference_run: Some(self.flights.run(worst.pair.rows.1)),
                reference_value: Some(worst.pair.values.1),
                measure: Some(pairing.measure()),
                by: Some(worst.by),
                ..of(worst.pair.rows.0, worst.pair.values.0)
            });
            return beside.collect();
        }
        let flown = self.flights.of_controller(controller, metric).into_iter();
        let mut flown: Vec<(f64, usize)> = flown
            .filter_map(|(_, row)| Some((self.flights.value(metric, row)?, row)))
            .collect();
        flown.sort_by(|a, b| b.0.total_cmp(&a.0));
        flown.truncate(WORST);
        flown.into_iter().map(|(value, row)| of(row, value)).collect()
    }

    pub(super) fn regret(&self) -> Vec<Regret> {
        let all = self.campaign.controllers.iter();
        all.flat_map(|contender| {
            let rows = self.flights.of_controller(&contender.name, BOUNDED);
            let places = std::iter::once(None).chain(self.scenarios.iter().copied().map(Some));
            places
                .filter_map(|scenario| self.regret_of(&contender.name, &rows, scenario))
                .collect::<Vec<_>>()
        })
        .collect()
    }

    fn regret_of(&self, controller: &str, rows: &[(usize, usize)], scenario: Option<&str>) -> Option<Regret> {
        let here = rows.iter().filter(|(group, _)| {
            scenario.is_none_or(|scenario| self.flights.groups[*group].scenario == scenario)
        });
        let known: Vec<(usize, f64, f64)> = here
            .filter_map(|&(_, row)| {
                let value = self.flights.value(BOUNDED, row)?;
                Some((row, value, self.flights.value("bound_rms_m", row)?))
            })
            .collect();
        let beyond = |(_, value, bound): &(usize, f64, f64)| value - bound;
        let worst = known.iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b)))?;
        let average =
            |of: &dyn Fn(&(usize, f64, f64)) -> f64| mean(&known.iter().map(of).collect::<Vec<_>>()).centre;
        Some(Regret {
            controller: controller.to_owned(),
            scenario: scenario.map(str::to_owned),
            n_runs: known.len(),
            rms_m: average(&|found| found.1),
            bound_rms_m: average(&|found| found.2),
            beyond_bound_m: average(&beyond),
            beyond_bound_worst_m: beyond(worst),
            worst_run: self.flights.run(worst.0),
        })
    }

    /// Names of all controllers but the reference.
    fn compared(&self) -> impl Iterator<Item = &str> {
        let names = self
            .campaign
            .controllers
            .iter()
            .map(|contender| contender.name.as_str());
        names.filter(|name| *name != self.reference)
    }
}
