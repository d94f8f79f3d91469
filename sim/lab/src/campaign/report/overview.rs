//! Scenarios, craft, parameters, controllers and failures of a campaign.

use serde::Serialize;

use super::data::Data;
use crate::campaign::{design::Campaign, statistics::RunTable};

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
    /// Scenarios and craft whose replicates are all the same missions.
    pub(super) repeated: Vec<String>,
}

/// A scenario with its craft.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct CaseFlown {
    pub(super) scenario: String,
    pub(super) title: String,
    pub(super) craft: Vec<String>,
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
    pub(super) n_runs: usize,
    pub(super) n_failed: usize,
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
                n_runs: rows.len(),
                n_failed: rows.iter().filter(|&&row| self.runs.failed(row)).count(),
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

pub(super) fn repeated(runs: &RunTable) -> Vec<String> {
    let groups = runs.repeated.iter().map(|&group| &runs.groups[group]);
    groups
        .map(|group| format!("{} ({})", group.scenario, group.craft))
        .collect()
}
