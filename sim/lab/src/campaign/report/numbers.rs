//! All numbers of a report.

use serde::Serialize;

use super::{
    claims::Verdict,
    gather::Gather,
    learnt::{Alarms, Estimated},
    pareto::Point,
    scores::{Scores, Winner},
};
use crate::campaign::{
    design::Campaign,
    rows::Rows,
    statistics::{Comparison, Effect, Flights, Measure, RESAMPLES, unit},
};

/// Version of the JSON's members.
const SCHEMA_VERSION: &str = "2";

/// What a report says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Numbers {
    pub(super) schema_version: &'static str,
    pub(super) campaign: About,
    pub(super) metrics: Vec<MetricUnit>,
    pub(super) arenas: Vec<ArenaFlown>,
    pub(super) parameters: Vec<Drawn>,
    pub(super) controllers: Vec<ControllerFlown>,
    pub(super) claims: Vec<Verdict>,
    pub(super) winners: Vec<Winner>,
    pub(super) comparisons: Vec<Comparison>,
    pub(super) scores: Vec<Scores>,
    /// The two columns of the Pareto front, and all means in them; none where the file asks for none.
    pub(super) pareto_metrics: Option<[String; 2]>,
    pub(super) pareto: Vec<Point>,
    pub(super) effects: Vec<Effect>,
    pub(super) worst: Vec<Worst>,
    pub(super) regret: Vec<Regret>,
    pub(super) estimated: Vec<Estimated>,
    pub(super) alarms: Vec<Alarms>,
    pub(super) failures: Vec<Failure>,
}

/// What it is of.
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
    /// SHA-256 of the rows but for what is measured.
    pub(super) digest: String,
    pub(super) reference: String,
    /// Whether the reference is another than the file asks for: that one never is.
    pub(super) reference_replaced: bool,
    pub(super) bootstrap_resamples: u32,
}

/// A column that is compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct MetricUnit {
    pub(super) name: String,
    pub(super) unit: &'static str,
    /// Whether the rows have it.
    pub(super) known: bool,
}

/// A scenario with the craft that flew there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ArenaFlown {
    pub(super) scenario: String,
    pub(super) title: String,
    pub(super) craft: Vec<String>,
}

/// A parameter, and what it is drawn from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Drawn {
    pub(super) key: String,
    pub(super) uniform: Option<[f64; 2]>,
    pub(super) choice: Option<Vec<f64>>,
}

/// What a controller's part in the comparison is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Part {
    /// The others are compared with it.
    Reference,
    Compared,
    /// Compared, and knows more than the scenario grants.
    KnowsMore,
    /// The law as printed, which is shown and never wins.
    Shown,
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
    /// Answers, and shares of them.
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

/// A run in which a controller did badly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Worst {
    pub(super) controller: String,
    pub(super) metric: String,
    pub(super) run: u64,
    pub(super) scenario: String,
    pub(super) craft: String,
    pub(super) replicate: f64,
    pub(super) value: f64,
    /// The reference's run in the same world; none of the reference itself.
    pub(super) reference_run: Option<u64>,
    pub(super) reference_value: Option<f64>,
    pub(super) measure: Option<Measure>,
    /// Value beside the reference's, as the measure says.
    pub(super) by: Option<f64>,
}

/// A controller beside what no craft of that hull could have come below.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Regret {
    pub(super) controller: String,
    /// None for all.
    pub(super) scenario: Option<String>,
    /// Runs whose bound is known.
    pub(super) n_runs: usize,
    /// Means over these runs, m.
    pub(super) rms_m: f64,
    pub(super) bound_rms_m: f64,
    pub(super) beyond_bound_m: f64,
    /// The largest distance beyond the bound, m, and its run.
    pub(super) beyond_bound_worst_m: f64,
    pub(super) worst_run: u64,
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

impl Numbers {
    /// Of `rows`, in any order.
    pub(super) fn of(campaign: &Campaign, rows: &Rows) -> Self {
        let flights = Flights::of(rows);
        let reference = reference(campaign);
        let metrics: Vec<MetricUnit> = campaign
            .file
            .report
            .metrics
            .iter()
            .map(|name| MetricUnit {
                name: name.clone(),
                unit: unit(name),
                known: rows.numbers(name).is_some(),
            })
            .collect();
        let arenas = arenas(campaign);
        let failures = failures(&flights);
        let asked = &campaign.file.report.reference;
        let gather = Gather {
            campaign,
            flights: &flights,
            metrics: metrics
                .iter()
                .filter(|metric| metric.known)
                .map(|metric| metric.name.as_str())
                .collect(),
            scenarios: arenas.iter().map(|arena| arena.scenario.as_str()).collect(),
            reference,
        };
        let winners = gather.winners();
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
                reference_replaced: asked.as_ref().is_some_and(|asked| asked != reference),
                bootstrap_resamples: RESAMPLES,
            },
            controllers: gather.controllers(),
            claims: gather.claims(),
            scores: gather.scores(&winners),
            winners,
            pareto_metrics: campaign.file.report.pareto_front.clone(),
            pareto: gather.pareto_points(),
            estimated: gather.estimated(),
            alarms: gather.alarms(),
            comparisons: gather.comparisons(),
            effects: gather.effects(),
            worst: gather.worst(),
            regret: gather.regret(),
            parameters: parameters(campaign),
            metrics,
            arenas,
            failures,
        }
    }
}

/// Who the others are compared with: the one asked for, else the first law, else the first controller; never the law as printed.
fn reference(campaign: &Campaign) -> &str {
    let all = || campaign.controllers.iter();
    let is_shown = |name: &str| {
        all().any(|contender| {
            contender.name == name && contender.law_flown().is_some_and(|law| !law.may_win())
        })
    };
    let asked = campaign.file.report.reference.as_deref();
    let first_law = || all().find(|contender| contender.is_baseline());
    let first = || {
        all()
            .find(|contender| !is_shown(&contender.name))
            .or(all().next())
    };
    asked
        .filter(|asked| !is_shown(asked))
        .or_else(|| Some(first_law().or_else(first)?.name.as_str()))
        .unwrap_or_default()
}

fn arenas(campaign: &Campaign) -> Vec<ArenaFlown> {
    let mut arenas: Vec<ArenaFlown> = vec![];
    for arena in &campaign.arenas {
        let known = arenas
            .iter_mut()
            .find(|known| known.scenario == arena.scenario.name);
        match known {
            Some(known) => known.craft.push(arena.craft.clone()),
            None => arenas.push(ArenaFlown {
                scenario: arena.scenario.name.clone(),
                title: arena.scenario.title.clone(),
                craft: vec![arena.craft.clone()],
            }),
        }
    }
    arenas
}

fn parameters(campaign: &Campaign) -> Vec<Drawn> {
    let all = campaign.file.parameters.iter();
    all.map(|parameter| Drawn {
        key: parameter.key.clone(),
        uniform: parameter.uniform,
        choice: parameter.choice.clone(),
    })
    .collect()
}

fn failures(flights: &Flights) -> Vec<Failure> {
    let failed = (0..flights.rows.len()).filter(|&row| flights.failed(row));
    failed
        .map(|row| Failure {
            run: flights.run(row),
            controller: flights.word("controller", row).to_owned(),
            scenario: flights.word("scenario", row).to_owned(),
            craft: flights.word("craft", row).to_owned(),
            reason: flights.word("failure", row).to_owned(),
        })
        .collect()
}
