//! Explanation of a plan: size of its program, all subproblems, and soft rows that gave way.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    choose::select::{baselines, select_answer},
    los::law::LosLaw,
    problem::{parameters::Parameters, violation::Unit},
    program::{
        build::{Cone, Program},
        layout::Slack,
        units::SLACK_UNIT,
    },
    scp::predicted_cost::CostTerms,
    snapshot::build::Snapshot,
    solve::{
        by_shape::ByShape,
        certificate::Residuals,
        clarabel::{Solution, SolverStatus, Solvers},
        stop::Stop,
    },
};

/// Largest slack within the solver's tolerance, m, m/s or m/s².
const NOTICEABLE: f64 = 1e-3;

/// Explanation of a plan. Equal requests have equal explanations; one cut short is omitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Explanation {
    /// Size of the last convex subproblem.
    // Zeros without a subproblem.
    pub program: ProgramSize,
    /// Terms of each predicted cost, by controller and term, m² s; their sum is the cost.
    #[schema(value_type = BTreeMap<String, BTreeMap<String, f64>>)]
    pub cost_terms: BTreeMap<String, CostTerms>,
    /// Soft limits that the last subproblem violated at the price of its slacks.
    pub slack: Vec<UsedSlack>,
    /// All convex subproblems, in the order of solving.
    pub log: Vec<SubproblemReport>,
}

/// Size of a cone program `minimise ½ xᵀPx + qᵀx, Ax + s = b, s ∈ K`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ProgramSize {
    /// Stages of the horizon.
    pub stages: usize,
    /// Length of x.
    pub variables: usize,
    /// Rows in all.
    pub rows: usize,
    /// Rows with s = 0.
    pub equalities: usize,
    /// Rows with s ≥ 0.
    pub inequalities: usize,
    /// Second-order cones.
    pub second_order_cones: usize,
    /// Stored entries of A.
    pub constraint_entries: usize,
    /// Stored entries of the upper triangle of P.
    pub quadratic_entries: usize,
}

/// A solved convex subproblem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Subproblem)]
pub struct SubproblemReport {
    /// Final status of the solver, in snake case.
    #[schema(value_type = String)]
    pub status: SolverStatus,
    /// Interior-point iterations.
    pub iterations: u32,
    /// Residuals of its optimality conditions; absent without a solution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
}

/// A soft limit that gave way at a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UsedSlack {
    /// Limits that share the slack: `motion`, `acoustic_range`, `other_range` (of AUVs that the
    /// goal does not name), `area` or `keep_out`.
    #[schema(value_type = String)]
    pub limit: Slack,
    /// Time after the request's, s.
    pub after_s: f64,
    /// Amount of the slack, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    #[schema(value_type = String)]
    pub unit: Unit,
}

/// Repeats [`crate::plan::plan_until`] for `snapshot` and keeps the subproblems. `planned` has the
/// cost terms of the plan to explain. If a deadline cut that plan short, this one differs.
pub fn explain(snapshot: &Snapshot, planned: CostTerms, parameters: &Parameters, stop: &Stop) -> Explanation {
    let mut solvers = Solvers::default();
    let mut explanation = Explanation::default();
    let times = parameters.of(snapshot).times();
    let mut programs = ByShape::default();
    let _plan = select_answer(snapshot, parameters, &mut programs, stop, &mut |program| {
        let solution = solvers.solve_until(program, stop);
        let is_whole = solution.primal.len() == program.layout.n_variables();
        explanation.log.push(SubproblemReport {
            status: solution.status,
            iterations: solution.iterations,
            residuals: is_whole.then(|| Residuals::of(program, &solution)),
        });
        explanation.program = size(program);
        explanation.slack = if is_whole { slacks(program, &solution, &times[1..]) } else { vec![] };
        solution
    });
    let laws = LosLaw::ALL
        .iter()
        .zip(baselines(snapshot, parameters, stop))
        .map(|(law, baseline)| (law.name().to_owned(), baseline.cost_terms));
    let mpc = ("mpc".to_owned(), planned);
    explanation.cost_terms = [mpc].into_iter().chain(laws).collect();
    explanation
}

fn size(program: &Program) -> ProgramSize {
    let mut size = ProgramSize {
        stages: program.layout.n_stages,
        variables: program.layout.n_variables(),
        rows: program.layout.n_rows(),
        constraint_entries: program.constraints.values.len(),
        quadratic_entries: program.quadratic.values.len(),
        ..ProgramSize::default()
    };
    for cone in &program.cones {
        match *cone {
            Cone::Zero(rows) => size.equalities += rows,
            Cone::Nonnegative(rows) => size.inequalities += rows,
            Cone::SecondOrder(_) => size.second_order_cones += 1,
        }
    }
    size
}

fn slacks(program: &Program, solution: &Solution, times: &[f64]) -> Vec<UsedSlack> {
    let layout = program.layout;
    let stages = (1..=layout.n_stages).zip(times);
    let used = stages.flat_map(|(stage, after)| {
        layout.slacks().map(move |limit| UsedSlack {
            limit,
            after_s: *after,
            amount: solution.primal[layout.slack(stage, limit)] * SLACK_UNIT,
            unit: match limit {
                Slack::Motion => Unit::OfMotion,
                Slack::AcousticRange | Slack::OtherRange | Slack::Area | Slack::KeepOut => Unit::Metres,
            },
        })
    });
    used.filter(|slack| NOTICEABLE < slack.amount).collect()
}
