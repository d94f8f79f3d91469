//! One plan without a server, with the same request, answer and refusals.

use std::{sync::Arc, time::Duration};

use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Programs, plan_with},
    program::Program,
    solve::{Solution, SolverStatus, Solvers},
    stop::Stop,
};

use crate::edge::arrival::Arrival;
use crate::edge::problem::Problem;
use crate::limits::BODY_BYTES_MAX;
use crate::planning::deadline::Deadline;
use crate::planning::planners::Planned;
use crate::planning::pool::Caller;
use crate::planning::valid_request::{ValidRequest, answer, check_fallback};
use wire::{PlanRequest, PlanResponse};

/// No limit: a day.
const LIMIT: Duration = Duration::from_hours(24);

/// The answer to `body`, with programs solved to `tolerance`. `watch` gets every solved program, in
/// order. The only deadline is the request's.
pub fn plan(
    body: &[u8],
    tolerance: f64,
    watch: &mut dyn FnMut(&Program, &Solution),
) -> Result<PlanResponse, Problem> {
    let clock = Clock::machine();
    let arrival = Arrival(clock.now());
    if BODY_BYTES_MAX < body.len() {
        return Err(Problem::TooLarge);
    }
    let request: PlanRequest = wire::read(body)?;
    let stop = match request.deadline_ms {
        Some(wish) => Deadline::new(arrival, Some(wish), LIMIT).stop(&clock, Caller::STAYS),
        None => Stop::never(),
    };
    let ValidRequest { snapshot, context } = ValidRequest::new(request, &stop)?;
    let mut solvers = Solvers::with_tolerance(tolerance);
    let start = clock.now();
    let mut plan = plan_with(&snapshot, &Parameters::default(), &mut Programs::default(), &mut |program| {
        if stop.is_due() {
            return Solution::none(SolverStatus::CallbackTerminated);
        }
        let solution = solvers.solve_until(program, &stop);
        watch(program, &solution);
        solution
    });
    plan.solver.deadline_hit = stop.was_due();
    let planned = Planned { solve_time: clock.since(start), snapshot: Arc::new(snapshot), plan };
    check_fallback(&planned.snapshot, planned.plan.degraded)?;
    Ok(answer(&planned, &context).planned())
}
