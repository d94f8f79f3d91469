//! From a snapshot to a plan.

pub use crate::answer::{
    Baseline, Degraded, Method, Plan, Predicted, SoftLimit, SolverReport, TargetForecast, Violation,
};
pub use crate::passes::Programs;
use crate::{
    ladder,
    los::LosLaw,
    policy::Policy,
    program::Program,
    snapshot::Snapshot,
    solve::{Solution, Solvers},
    stop::Stop,
};

/// Memory that a caller keeps between plans: programs and solvers by problem shape. It saves time and
/// has no effect on any answer.
#[derive(Debug, Default)]
pub struct Workspace {
    programs: Programs,
    solvers: Solvers,
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
    let Workspace { programs, solvers } = workspace;
    ladder::descend(snapshot, policy, programs, stop, &mut |program| {
        solvers.solve_until(program, stop)
    })
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
    programs: &mut Programs,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    ladder::descend(snapshot, policy, programs, &Stop::never(), solve)
}
