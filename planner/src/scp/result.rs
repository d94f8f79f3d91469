//! What SCP iterations lead to, and which of two results is better.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    craft::response::Stage,
    scp::predicted_cost::{CostTerms, Predicted, Violations},
    solve::{certificate::Residuals, clarabel::SolverStatus},
};

/// By how much the predicted cost of one result must be below that of another to be better, as a share of it: ties go to
/// the first, which is the one to starboard.
const TIE: f64 = 1e-6;

/// What the iterations from one initial guess led to: a candidate trajectory, or the reason why there is none.
pub(crate) struct ScpResult {
    pub(crate) candidate: Option<Candidate>,
    /// Whether the last iteration left the directions that it was linearised about almost as they were.
    pub(crate) converged: bool,
    pub(crate) degraded: Option<Degraded>,
    pub(crate) report: SolverReport,
    /// Limits of motion that the program's own stages do not keep.
    pub(crate) violations: Violations<2>,
}

/// A candidate trajectory, and what following it is predicted to lead to.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Its stages, craft frame.
    pub(crate) stages: Vec<Stage>,
    pub(crate) predicted: Predicted,
    pub(crate) terms: CostTerms,
    /// Limits of position that the craft breaks on it.
    pub(crate) violations: Violations<4>,
}

impl ScpResult {
    /// No candidate, and why.
    pub(crate) fn none(reason: Degraded) -> Self {
        Self {
            candidate: None,
            converged: false,
            degraded: Some(reason),
            report: SolverReport::nothing_done(),
            violations: [None; 2],
        }
    }

    /// Predicted cost of the candidate; infinite without one.
    pub(crate) fn cost(&self) -> f64 {
        let candidate = self.candidate.as_ref();
        candidate.map_or(f64::INFINITY, |candidate| candidate.predicted.cost)
    }

    /// The better of both, with the work of both.
    pub(crate) fn or(self, other: Self) -> Self {
        let scp_iterations = self.report.scp_iterations + other.report.scp_iterations;
        let iterations = self.report.iterations + other.report.iterations;
        let (cost, other_cost) = (self.cost(), other.cost());
        // What a candidate that there was no time for would have cost is not known.
        let stopped = [self.degraded, other.degraded].contains(&Some(Degraded::Deadline));
        // Infinite costs: keep the first, and its reason.
        let mut better = if other_cost < cost - TIE * cost.abs().min(f64::MAX) {
            other
        } else {
            self
        };
        if better.candidate.is_none() && stopped {
            better.degraded = Some(Degraded::Deadline);
        }
        better.report = SolverReport {
            scp_iterations,
            iterations,
            ..better.report
        };
        better
    }
}

/// Why an answer is degraded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degraded {
    /// The solver ended in a status that proves nothing.
    Solver(SolverStatus),
    /// The solver was satisfied or almost, the certificate was not.
    Certificate,
    /// The goal rests on a report too old to be forecast.
    StaleReport,
    /// The deadline came before any program was solved, whatever failed before it.
    Deadline,
}

/// Why an answer is degraded, as one word for programs.
impl fmt::Display for Degraded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(status) => write!(f, "solver_{status}"),
            Self::Certificate => f.write_str("certificate"),
            Self::StaleReport => f.write_str("stale_report"),
            Self::Deadline => f.write_str("deadline"),
        }
    }
}

/// What the solver did.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Solver)]
pub struct SolverReport {
    /// Status of the SCP iteration that led to the answer, else of the one that failed, in snake case.
    #[schema(value_type = String)]
    pub status: SolverStatus,
    /// Iterations of the sequential convex programming: convex subproblems solved.
    #[serde(alias = "passes")]
    pub scp_iterations: usize,
    /// Interior-point iterations over all subproblems.
    pub iterations: u32,
    /// Whether the deadline cut the work short. With the outcome `ok`, a program had been solved by then, and further
    /// ones were not tried or not finished: the best of what there was answered, whatever its `method`.
    pub deadline_hit: bool,
    /// Time for the whole plan, ms: the one member that differs between two equal requests.
    // The planner has no clock: its caller measures.
    #[schema(value_type = f64, required)]
    pub solve_time_ms: Option<f64>,
    /// Residuals of that iteration's subproblem, recomputed outside the solver.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
}

impl SolverReport {
    /// No program was tried.
    pub(crate) fn nothing_done() -> Self {
        Self {
            status: SolverStatus::Unsolved,
            scp_iterations: 0,
            iterations: 0,
            deadline_hit: false,
            solve_time_ms: None,
            residuals: None,
        }
    }
}
