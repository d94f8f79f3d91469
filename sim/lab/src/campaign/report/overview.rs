//! Scenarios, craft, parameters, controllers and failures of a campaign.

use serde::Serialize;

use super::data::Data;
use crate::campaign::{
    controller::ControlLaw,
    design::Campaign,
    statistics::{RunTable, student::median},
};

/// Columns that count answers by method.
const ANSWERS: [&str; 4] = [
    "answers_mpc",
    "answers_previous_plan",
    "answers_saturated_los",
    "answers_hold",
];

/// The campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct About {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) seed: u64,
    pub(super) replicates: u64,
    pub(super) duration_s: Option<f64>,
    pub(super) n_rows: usize,
    pub(super) n_runs_at_most: u64,
    pub(super) n_failed: usize,
    /// SHA-256 of the rows without measured times.
    pub(super) digest: String,
    pub(super) reference: String,
}

/// A compared column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct MetricUnit {
    pub(super) name: String,
    pub(super) unit: &'static str,
    /// Whether the rows have the column.
    pub(super) known: bool,
}

/// A scenario with its craft.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct CaseFlown {
    pub(super) scenario: String,
    pub(super) title: String,
    pub(super) craft: Vec<String>,
}

/// A parameter and its distribution.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Drawn {
    pub(super) key: String,
    pub(super) uniform: Option<[f64; 2]>,
    pub(super) choice: Option<Vec<f64>>,
}

/// The role of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Part {
    /// The others are compared with it.
    Reference,
    Compared,
    /// Compared, and knows more than the scenario grants.
    KnowsMore,
}

/// A controller and its runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ControllerFlown {
    pub(super) name: String,
    pub(super) information: String,
    pub(super) part: Part,
    pub(super) is_planner: bool,
    pub(super) n_runs: usize,
    pub(super) n_failed: usize,
    /// Number of answers, and their shares by method.
    pub(super) n_answers: f64,
    pub(super) answers_mpc: Option<f64>,
    pub(super) answers_previous_plan: Option<f64>,
    pub(super) answers_saturated_los: Option<f64>,
    pub(super) answers_hold: Option<f64>,
    /// Median over runs of a run's median, ms.
    pub(super) solve_ms_p50_median: Option<f64>,
    /// Largest over runs of a run's 99th percentile, ms.
    pub(super) solve_ms_p99_worst: Option<f64>,
}

/// A mission that failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Failure {
    pub(super) run: u64,
    pub(super) controller: String,
    pub(super) scenario: String,
    pub(super) craft: String,
    pub(super) reason: String,
}

impl Data<'_> {
    pub(super) fn controllers(&self) -> Vec<ControllerFlown> {
        let all = self.campaign.controllers.iter();
        all.map(|controller| {
            let rows: Vec<usize> = (0..self.runs.rows.len())
                .filter(|&row| self.runs.word("controller", row) == controller.name)
                .collect();
            let values = |name: &str| -> Vec<f64> {
                rows.iter()
                    .filter_map(|&row| self.runs.value(name, row))
                    .collect()
            };
            let counts = ANSWERS.map(|name| values(name).iter().sum::<f64>());
            let n_answers: f64 = counts.iter().sum();
            let [mpc, previous_plan, saturated_los, hold] =
                counts.map(|count| (0.0 < n_answers).then(|| count / n_answers));
            ControllerFlown {
                name: controller.name.clone(),
                information: controller.information(),
                part: if controller.name == self.reference {
                    Part::Reference
                } else if controller.may_win() {
                    Part::Compared
                } else {
                    Part::KnowsMore
                },
                is_planner: matches!(controller.law, ControlLaw::Planner { .. }),
                n_runs: rows.len(),
                n_failed: rows.iter().filter(|&&row| self.runs.failed(row)).count(),
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
}

pub(super) fn cases(campaign: &Campaign) -> Vec<CaseFlown> {
    let mut cases: Vec<CaseFlown> = vec![];
    for case in &campaign.cases {
        let known = cases
            .iter_mut()
            .find(|known| known.scenario == case.scenario.name);
        match known {
            Some(known) => known.craft.push(case.craft.clone()),
            None => cases.push(CaseFlown {
                scenario: case.scenario.name.clone(),
                title: case.scenario.title.clone(),
                craft: vec![case.craft.clone()],
            }),
        }
    }
    cases
}

pub(super) fn parameters(campaign: &Campaign) -> Vec<Drawn> {
    let all = campaign.file.parameters.iter();
    all.map(|parameter| Drawn {
        key: parameter.key.clone(),
        uniform: parameter.uniform,
        choice: parameter.choice.clone(),
    })
    .collect()
}

pub(super) fn failures(runs: &RunTable) -> Vec<Failure> {
    let failed = (0..runs.rows.len()).filter(|&row| runs.failed(row));
    failed
        .map(|row| Failure {
            run: runs.run(row),
            controller: runs.word("controller", row).to_owned(),
            scenario: runs.word("scenario", row).to_owned(),
            craft: runs.word("craft", row).to_owned(),
            reason: runs.word("failure", row).to_owned(),
        })
        .collect()
}
