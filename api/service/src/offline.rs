//! One plan without a server: the same request, the same answer, the same refusals.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use planner::{
    plan::{Programs, plan_with},
    policy::Policy,
    program::Program,
    snapshot::Snapshot,
    solve::{Solution, SolverStatus, Solvers},
    stop::Stop,
};

use crate::{
    deadline::{Arrival, Deadline},
    planners::Planned,
    planning::{Context, answer, refuse_a_lower_level},
    posted::{BODY_BYTES_MAX, read},
    problem::Problem,
};
use wire::{PlanRequest, PlanResponse};

/// The answer to `body`, with programs solved to `tolerance`. `watch` is shown every program that was solved, in
/// order. There is no deadline but the request's own.
pub fn plan(
    body: &[u8],
    tolerance: f64,
    watch: &mut dyn FnMut(&Program, &Solution),
) -> Result<PlanResponse, Problem> {
    let arrival = Arrival(Instant::now());
    if BODY_BYTES_MAX < body.len() {
        return Err(Problem::TooLarge);
    }
    let request: PlanRequest = read(body)?;
    let snapshot = Snapshot::try_from(&request).map_err(Problem::Invalid)?;
    let stop = match request.deadline_ms {
        Some(wish) => Deadline::new(arrival, Some(wish), Duration::MAX).stop(),
        None => Stop::never(),
    };
    let mut solvers = Solvers::with_tolerance(tolerance);
    let start = Instant::now();
    let mut plan = plan_with(
        &snapshot,
        &Policy::default(),
        &mut Programs::default(),
        &mut |program| {
            if stop.is_due() {
                return Solution::none(SolverStatus::CallbackTerminated);
            }
            let solution = solvers.solve_until(program, &stop);
            watch(program, &solution);
            solution
        },
    );
    plan.solver.deadline_hit = stop.was_due();
    let planned = Planned {
        solve_time: start.elapsed(),
        snapshot: Arc::new(snapshot),
        plan,
    };
    refuse_a_lower_level(&planned)?;
    let PlanRequest { origin, metadata, .. } = request;
    Ok(answer(&planned, &Context { origin, metadata }).planned())
}
