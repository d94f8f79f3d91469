//! All numbers of a report.

use serde::Serialize;

use super::{
    claims::Verdict,
    compared::Worst,
    data::Data,
    learnt::{Alarms, Estimated},
    overview::{About, CaseFlown, ControllerFlown, Failure, cases, failures, repeated},
    pareto::Point,
    scores::{Scores, Winner},
};
use crate::campaign::{
    design::Campaign,
    file::Parameter,
    rows::Rows,
    statistics::{Comparison, Effect, RunTable},
};

/// Version of the JSON's members.
const SCHEMA_VERSION: &str = "4";

/// The numbers of a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Numbers {
    pub(super) schema_version: &'static str,
    pub(super) campaign: About,
    pub(super) metrics: Vec<String>,
    pub(super) cases: Vec<CaseFlown>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) controllers: Vec<ControllerFlown>,
    pub(super) claims: Vec<Verdict>,
    pub(super) winners: Vec<Winner>,
    pub(super) comparisons: Vec<Comparison>,
    pub(super) scores: Vec<Scores>,
    /// The two columns of the Pareto front, if the file asks for one.
    pub(super) pareto_metrics: Option<[String; 2]>,
    pub(super) pareto: Vec<Point>,
    pub(super) effects: Vec<Effect>,
    pub(super) worst: Vec<Worst>,
    pub(super) estimated: Vec<Estimated>,
    pub(super) alarms: Vec<Alarms>,
    pub(super) failures: Vec<Failure>,
}

impl Numbers {
    /// Of `rows`, in any order.
    pub(super) fn of(campaign: &Campaign, rows: &Rows) -> Self {
        let runs = RunTable::of(rows);
        let reference = reference(campaign);
        let cases = cases(campaign);
        let failures = failures(&runs);
        let data = Data {
            campaign,
            runs: &runs,
            metrics: &campaign.file.report.metrics,
            scenarios: cases.iter().map(|case| case.scenario.as_str()).collect(),
            reference,
        };
        let winners = data.winners();
        Self {
            schema_version: SCHEMA_VERSION,
            campaign: About {
                name: campaign.file.name.clone(),
                title: campaign.file.title.clone(),
                seed: campaign.file.seed,
                replicates: campaign.file.replicates,
                duration_s: campaign.file.duration_s,
                n_rows: rows.len(),
                n_runs_at_most: campaign.n_runs(),
                n_failed: failures.len(),
                digest: rows.digest(),
                reference: reference.to_owned(),
                repeated: repeated(&runs),
            },
            controllers: data.controllers(),
            claims: data.claims(),
            scores: data.scores(&winners),
            winners,
            pareto_metrics: campaign.file.report.pareto_front.clone(),
            pareto: data.pareto_points(),
            estimated: data.estimated(),
            alarms: data.alarms(),
            comparisons: data.comparisons(),
            effects: data.effects(),
            worst: data.worst(),
            parameters: campaign.file.parameters.clone(),
            metrics: campaign.file.report.metrics.clone(),
            cases,
            failures,
        }
    }
}

/// The controller that the others are compared with: the one asked for, else the first law, else the first controller.
fn reference(campaign: &Campaign) -> &str {
    let all = &campaign.controllers;
    let first_law = || all.iter().find(|controller| controller.los_law().is_some());
    let chosen = || Some(first_law().or(all.first())?.name.as_str());
    let asked = campaign.file.report.reference.as_deref();
    asked.or_else(chosen).unwrap_or_default()
}
