//! Plans for a fleet: assigns AUVs to craft, then plans for each craft among those before it.

use std::sync::Arc;

use axum::response::Response;
use planner::fleet::Assignment;
use planner::plan::Plan;
use planner::stop::Stop;

use crate::edge::arrival::Arrival;
use crate::edge::body::BodyBytes;
use crate::edge::problem::Problem;
use crate::planning::admission::Work;
use crate::planning::deadline::Deadline;
use crate::planning::planners::{Planned, Planners};
use crate::planning::valid_request::{Context, ValidRequest, answer, written};
use wire::{CraftPlan, FleetRequest, FleetResponse, Outcome, SCHEMA_VERSION};

/// Share of the time within which AUVs are estimated and assigned: a third.
const ASSIGNED_IN: usize = 3;

/// Plans for the fleet in `body`.
pub(crate) async fn plan_fleet(
    planners: &Planners,
    arrival: Arrival,
    body: BodyBytes,
) -> Result<Response, Problem> {
    let permit = planners.admit(Work::Fleet, body.bytes.len())?;
    let (clock, limit) = (planners.clock.clone(), planners.deadline);
    let parameters = Arc::clone(&planners.parameters);
    let read = planners.read(&permit, move |caller| {
        let request = FleetRequest::read(&body.bytes)?;
        let shared = request.shared();
        let deadline = Deadline::new(arrival, shared.deadline_ms, limit);
        let context = Context { origin: shared.origin, metadata: shared.metadata.clone() };
        let stop = deadline.share(&clock, ASSIGNED_IN).stop(&clock, caller);
        let fleet = request.fleet(&|| stop.is_due()).map_err(Problem::Invalid)?;
        let assignment = fleet.assign(&parameters, &stop);
        Ok::<_, Problem>((fleet, assignment, deadline, context))
    });
    let (fleet, assignment, deadline, Context { origin, metadata }) = read.await??;
    let (fleet, assignment) = (Arc::new(fleet), Arc::new(assignment));
    let (mut plans, mut surface_craft) = (Vec::<Plan>::new(), Vec::new());
    for (craft, left) in (1..=fleet.n_craft()).rev().enumerate() {
        let (of, among) = (Arc::clone(&fleet), Arc::clone(&assignment));
        let read = planners.read(&permit, move |_| (of.next(&among, &plans), plans));
        let (snapshot, ahead) = read.await?;
        let valid = ValidRequest { snapshot, context: Context { origin, ..Context::default() } };
        let share = deadline.share(&planners.clock, left);
        let made = |context: &Context, planned: &Planned, _, _: &Stop| {
            Ok((answer(planned, context).planned(), planned.plan.clone()))
        };
        let (response, plan) = valid.planned(planners, Arc::clone(&permit), share, made).await?;
        plans = ahead;
        plans.push(plan);
        surface_craft.push(CraftPlan::new(craft, &assignment, response));
    }
    let answer = move |_| {
        let is_ok = surface_craft.iter().all(|craft| craft.plan.outcome == Outcome::Ok);
        written(|| FleetResponse {
            schema_version: SCHEMA_VERSION.to_owned(),
            outcome: if is_ok { Outcome::Ok } else { Outcome::Degraded },
            slots: fleet.slots(&assignment),
            assignment: Assignment::clone(&assignment),
            surface_craft,
            metadata,
        })
    };
    planners.read(&permit, answer).await
}
