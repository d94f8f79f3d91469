//! Results of SCP iterations, and their order.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::craft::response::{Rollout, Stage};
use crate::problem::horizon::Horizon;
use crate::scp::predicted_cost::{CostTerms, Predicted, Violations, predict};
use crate::solve::certificate::Residuals;
use crate::solve::clarabel::SolverStatus;

/// Relative difference of costs below which two results tie; the first, to starboard, wins.
const TIE: f64 = 1e-6;

/// Result of the iterations from one guess: a candidate trajectory, or the reason for none.
pub(crate) struct ScpResult {
    pub(crate) candidate: Option<CandidateTrajectory>,
    /// `true` if the last iteration kept the directions of its linearisation almost unchanged.
    pub(crate) converged: bool,
    pub(crate) degraded: Option<Degraded>,
    pub(crate) report: SolverReport,
    /// Limits of motion that the program's stages violate.
    pub(crate) violations: Violations<2>,
}

/// A candidate trajectory with the prediction of following it.
#[derive(Clone, Debug)]
pub(crate) struct CandidateTrajectory {
    /// Its stages, craft frame.
    pub(crate) stages: Vec<Stage>,
    pub(crate) predicted: Predicted,
    pub(crate) terms: CostTerms,
    /// Limits of position that the craft violates on it.
    pub(crate) violations: Violations<6>,
}

impl CandidateTrajectory {
    /// `stages` with the prediction of `rollout`.
    pub(crate) fn new(horizon: &Horizon<'_>, stages: Vec<Stage>, rollout: &Rollout) -> Self {
        let (predicted, terms, violations) = predict(horizon, rollout);
        Self { stages, predicted, terms, violations }
    }
}

impl ScpResult {
    /// No candidate, with the reason.
    pub(crate) fn none(reason: Degraded) -> Self {
        Self {
            candidate: None,
            converged: false,
            degraded: Some(reason),
            report: SolverReport::default(),
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
        // The cost of a candidate that time did not suffice for is unknown.
        let stopped = [self.degraded, other.degraded].contains(&Some(Degraded::Deadline));
        // Infinite costs: keep the first, with its reason.
        let mut better = if other_cost < cost - TIE * cost.abs().min(f64::MAX) { other } else { self };
        if better.candidate.is_none() && stopped {
            better.degraded = Some(Degraded::Deadline);
        }
        better.report = SolverReport { scp_iterations, iterations, ..better.report };
        better
    }
}

/// Reason of a degraded answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degraded {
    /// The solver ended in a status without a result.
    Solver(SolverStatus),
    /// The solver succeeded or almost, and the certificate failed.
    Certificate,
    /// The goal depends on a report that is too old.
    StaleReport,
    /// The deadline passed before any program was solved, after any failures.
    Deadline,
}

/// The reason as one word.
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

/// Work of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Solver)]
pub struct SolverReport {
    /// Status of the SCP iteration that led to the answer, else of the failed one, in snake case.
    #[schema(value_type = String)]
    pub status: SolverStatus,
    /// SCP iterations: convex subproblems solved.
    #[serde(alias = "passes")]
    pub scp_iterations: usize,
    /// Interior-point iterations over all subproblems.
    pub iterations: u32,
    /// `true` if the deadline cut the work short. With the outcome `ok`, a program had been solved
    /// by then, and the best available candidate answered, of any `method`.
    pub deadline_hit: bool,
    /// Time for the whole plan, ms; the only member that differs between equal requests.
    // The planner has no clock: its caller measures.
    #[schema(value_type = f64, required)]
    pub solve_time_ms: Option<f64>,
    /// Residuals of that iteration's subproblem, independent of the solver.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
}
