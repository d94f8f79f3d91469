//! From a snapshot to a plan.

pub use crate::answer::{
    Baseline, Degraded, Method, Plan, Predicted, SoftLimit, SolverReport, Subject, TargetForecast, Violation,
};
use crate::{
    ladder::{self, Sheets},
    los::LosLaw,
    policy::Policy,
    program::Program,
    snapshot::Snapshot,
    solve::{Solution, Solvers},
    stop::Stop,
};

/// Memory that a caller keeps between plans: programs and solvers by problem shape, and room to work in. It saves time
/// and has no effect on any answer.
#[derive(Debug, Default)]
pub struct Workspace {
    drafts: Drafts,
    solvers: Solvers,
}

/// The part of a [`Workspace`] that is no solver's.
#[derive(Debug, Default)]
pub struct Drafts {
    sheets: Sheets,
}

impl Drafts {
    /// How many programs are remembered: one for each of the shapes used last, no more than
    /// [`SHAPES_MAX`](crate::solve::SHAPES_MAX).
    #[must_use]
    pub fn n_programs(&self) -> usize {
        self.sheets.passes.programs.len()
    }
}

/// Plans for `snapshot`.
///
/// The answer is always a plan: [`Plan::method`] names the rung of the ladder that gave it.
#[must_use]
pub fn plan(snapshot: &Snapshot, policy: &Policy, workspace: &mut Workspace) -> Plan {
    plan_until(snapshot, policy, workspace, &Stop::never())
}

/// [`plan`] that stops when told to: the last pass that was finished answers, or else a lower rung of the ladder.
/// An answer that was not stopped is the one of [`plan`], to the bit.
#[must_use]
pub fn plan_until(snapshot: &Snapshot, policy: &Policy, workspace: &mut Workspace, stop: &Stop) -> Plan {
    let mut answer = Plan::empty();
    plan_into(snapshot, policy, workspace, stop, &mut answer);
    answer
}

/// [`plan_until`] in the memory of an earlier answer, which is lost. Of snapshots like those that the workspace and the
/// answer have seen, nothing is allocated but by the solver.
pub fn plan_into(
    snapshot: &Snapshot,
    policy: &Policy,
    workspace: &mut Workspace,
    stop: &Stop,
    answer: &mut Plan,
) {
    let Workspace { drafts, solvers } = workspace;
    let solve = &mut |program: &Program, solution: &mut Solution| solvers.solve_into(program, stop, solution);
    plan_into_with(snapshot, policy, drafts, stop, solve, answer);
}

/// What a line-of-sight law would do with `snapshot`, at the policy's gains: [`Plan::baseline`] for each law.
///
/// The law starts here, whatever was answered before: an integral at zero, a box from one fix.
#[must_use]
pub fn baseline(snapshot: &Snapshot, policy: &Policy, law: LosLaw) -> Baseline {
    ladder::baseline(snapshot, policy, law)
}

/// [`plan`] with another solver in Clarabel's place: a peer to compare with, or a failure to force.
#[must_use]
pub fn plan_with(
    snapshot: &Snapshot,
    policy: &Policy,
    drafts: &mut Drafts,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    let mut answer = Plan::empty();
    let solve = &mut |program: &Program, solution: &mut Solution| *solution = solve(program);
    plan_into_with(snapshot, policy, drafts, &Stop::never(), solve, &mut answer);
    answer
}

/// [`plan_into`] with another solver in Clarabel's place, or with Clarabel watched. It is given its last solution, to
/// write the next in its memory.
pub fn plan_into_with(
    snapshot: &Snapshot,
    policy: &Policy,
    drafts: &mut Drafts,
    stop: &Stop,
    solve: &mut dyn FnMut(&Program, &mut Solution),
    answer: &mut Plan,
) {
    let memory = std::mem::replace(answer, Plan::empty());
    *answer = ladder::descend(snapshot, policy, &mut drafts.sheets, stop, solve, memory);
}
