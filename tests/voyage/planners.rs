//! The planners of the service: the real one, mostly without time for a program, and a lying one.

use std::cell::Cell;

use planner::angle::Heading;
use planner::parameters::Parameters;
use planner::plan::{Plan, Workspace, plan_until};
use planner::snapshot::Snapshot;
use planner::stop::Stop;

/// One plan in this many solves its program in a voyage with faults; lower levels need a tenth.
const SOLVED: u64 = 10;
/// Speed of a lying planner, m/s, and the time for which it wants each plan to be followed, s.
const SPEED: f64 = 40.0;
const FOR_EVER_S: f64 = 1e6;

thread_local! {
    static LIES: Cell<bool> = const { Cell::new(false) };
    static HAS_LIED: Cell<bool> = const { Cell::new(false) };
    static PLANS: Cell<u64> = const { Cell::new(0) };
    static SOLVES_ALL: Cell<bool> = const { Cell::new(false) };
}

/// Begins a voyage on this thread. No plan is degraded without faults.
pub(super) fn begin(is_nominal: bool) {
    SOLVES_ALL.set(is_nominal);
    LIES.set(false);
    HAS_LIED.set(false);
    PLANS.set(0);
}

/// Makes the planner lie, or stop lying.
pub(super) fn lie(lies: bool) {
    LIES.set(lies);
}

/// `true` if it has lied in this voyage.
pub(super) fn has_lied() -> bool {
    HAS_LIED.get()
}

/// The plan of the current planner.
pub(super) fn plan(
    snapshot: &Snapshot,
    parameters: &Parameters,
    workspace: &mut Workspace,
    stop: &Stop,
) -> Plan {
    let number = PLANS.get();
    PLANS.set(number + 1);
    let mut plan = if SOLVES_ALL.get() || number.is_multiple_of(SOLVED) {
        plan_until(snapshot, parameters, workspace, stop)
    } else {
        plan_until(snapshot, parameters, workspace, &Stop::at_once())
    };
    if LIES.get() {
        let heading = Heading::new(if number.is_multiple_of(2) { 1.5 } else { -1.5 });
        HAS_LIED.set(true);
        (plan.reference.speed, plan.reference.heading) = (SPEED, heading);
        plan.valid_until += FOR_EVER_S;
        for point in &mut plan.trajectory {
            (point.speed_mps, point.heading_rad) = (SPEED, heading.radians());
        }
    }
    plan
}
