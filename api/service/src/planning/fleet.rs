//! Plans for a fleet: assigns AUVs to craft, then plans for each craft among those before it.

use std::sync::Arc;

use axum::response::Response;
use planner::fleet::Assignment;
use planner::stop::Stop;

use crate::edge::arrival::Arrival;
use crate::edge::body::BodyBytes;
use crate::edge::problem::Problem;
use crate::planning::admission::Work;
use crate::planning::deadline::Deadline;
use crate::planning::planners::{Planned, Planners};
use crate::planning::valid_request::{Context, ValidRequest, answer, written};
use wire::{CraftPlan, FleetRequest, FleetResponse, Outcome, SCHEMA_VERSION, VehicleId, Vessel};

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
    let n = fleet.n_craft();
    let is_spare = |craft: usize| assignment.craft[craft].auvs.is_empty();
    let spare = (0..n).filter(|craft| is_spare(*craft));
    let mut ahead: Vec<Vessel> = spare.map(|craft| fleet.as_vessel(craft, None)).collect();
    let mut is_first = true;
    let mut surface_craft = Vec::with_capacity(n);
    for (craft, assigned) in assignment.craft.iter().enumerate() {
        let id = assigned.id.clone();
        let (of, among, vessels) = (Arc::clone(&fleet), Arc::clone(&assignment), ahead.clone());
        let snapshot = planners.read(&permit, move |_| of.snapshot(craft, &among, &vessels));
        let Some(snapshot) = snapshot.await? else {
            surface_craft.push(CraftPlan::spare(id, fleet.heading(craft), planners.parameters.validity));
            continue;
        };
        // The first plan keeps the memory of AUVs that nobody serves.
        let is_served = |id: &VehicleId| assignment.craft.iter().any(|craft| craft.auvs.contains(id));
        let keeps = |id: &VehicleId| assigned.auvs.contains(id) || is_first && !is_served(id);
        let valid = ValidRequest { snapshot, context: Context { origin, ..Context::default() } };
        let left = (craft..n).filter(|craft| !is_spare(*craft)).count();
        let share = deadline.share(&planners.clock, left);
        let made = |context: &Context, planned: &Planned, _, _: &Stop| {
            Ok((answer(planned, context).planned(), planned.plan.clone()))
        };
        let (response, plan) = valid.planned(planners, Arc::clone(&permit), share, made).await?;
        ahead.push(fleet.as_vessel(craft, Some(&plan)));
        surface_craft.push(CraftPlan::new(id, response, keeps));
        is_first = false;
    }
    let answer = move |_| {
        let plans = || surface_craft.iter().filter_map(|craft| craft.plan.as_ref());
        let is_ok = plans().all(|plan| plan.outcome == Outcome::Ok);
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
