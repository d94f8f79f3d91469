//! Entry points of the planner.

use crate::{
    choose::select::select_answer,
    problem::parameters::Parameters,
    program::build::Program,
    snapshot::build::Snapshot,
    solve::{
        by_shape::{ByShape, KEPT_BYTES_MAX},
        clarabel::{Solution, Solvers},
        stop::Stop,
    },
};

pub use crate::{
    choose::answer::{
        Baseline, GoalPoint, Method, Plan, PlannedTarget, RouteFit, TargetEstimate, TargetPlace, TargetPoint,
    },
    choose::select::{baseline_from, baselines, scheduled_goal},
    estimate::RepeatedTrack,
    problem::violation::{SoftLimit, Subject, Unit, Violation},
    scp::{
        predicted_cost::{CostTerms, Predicted},
        result::{Degraded, SolverReport},
    },
};

/// Programs and solvers by problem shape, which a caller keeps between plans to save time.
#[derive(Debug, Default)]
pub struct Workspace {
    programs: Programs,
    solvers: Solvers,
}

/// Programs by shape, the part of a [`Workspace`] besides the solvers.
pub type Programs = ByShape<Program>;

impl Workspace {
    /// Approximate size in bytes: programs and solvers of the last used shapes up to
    /// [`KEPT_BYTES_MAX`](crate::solve::KEPT_BYTES_MAX) each, plus the last one of any size.
    pub fn bytes(&self) -> usize {
        self.programs.bytes() + self.solvers.bytes()
    }

    /// Drops a last shape above the limit too, for a workspace that is not in use.
    pub fn shrink(&mut self) {
        self.programs.shrink_to(KEPT_BYTES_MAX);
        self.solvers.shrink_to(KEPT_BYTES_MAX);
    }
}

/// Plans for `snapshot`.
///
/// The answer is always a plan: [`Plan::method`] names the fallback level that gave it.
pub fn plan(snapshot: &Snapshot, parameters: &Parameters, workspace: &mut Workspace) -> Plan {
    plan_until(snapshot, parameters, workspace, &Stop::never())
}

/// [`plan`] that stops when `stop` is due: the last complete SCP iteration answers, or else a
/// fallback level. Without an interruption the answer is [`plan`]'s, to the bit.
pub fn plan_until(
    snapshot: &Snapshot,
    parameters: &Parameters,
    workspace: &mut Workspace,
    stop: &Stop,
) -> Plan {
    let Workspace { programs, solvers } = workspace;
    let solve = &mut |program: &Program| solvers.solve_until(program, stop);
    select_answer(snapshot, parameters, programs, stop, solve)
}

/// [`plan`] with another solver than Clarabel, for comparisons or forced failures.
pub fn plan_with(
    snapshot: &Snapshot,
    parameters: &Parameters,
    programs: &mut Programs,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    select_answer(snapshot, parameters, programs, &Stop::never(), solve)
}
