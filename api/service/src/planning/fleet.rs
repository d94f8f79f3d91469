//! The plans of a fleet: who serves whom, then a plan for each craft among those before it.

use std::sync::Arc;

use axum::Json;
use axum::response::{IntoResponse as _, Response};
use planner::stop::Stop;

use crate::edge::arrival::Arrival;
use crate::edge::body::BodyBytes;
use crate::edge::problem::Problem;
use crate::planning::admission::Work;
use crate::planning::deadline::Deadline;
use crate::planning::plan::{Context, ValidRequest, answer};
use crate::planning::planners::{Planned, Planners};
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
    let n = fleet.n_craft();
    let is_spare = |craft: usize| assignment.craft[craft].auvs.is_empty();
    let mut ahead: Vec<Vessel> =
        (0..n).filter(|craft| is_spare(*craft)).map(|craft| fleet.as_vessel(craft, None)).collect();
    let mut of_nobody = Some(());
    let mut surface_craft = Vec::with_capacity(n);
    for (craft, assigned) in assignment.craft.iter().enumerate() {
        let id = assigned.id.clone();
        let Some(snapshot) = fleet.snapshot(craft, &assignment, &ahead) else {
            surface_craft.push(CraftPlan::spare(id, fleet.heading(craft), planners.parameters.validity));
            continue;
        };
        // The first plan keeps the memory of AUVs that nobody serves.
        let is_first = of_nobody.take().is_some();
        let is_served = |id: &VehicleId| assignment.craft.iter().any(|craft| craft.auvs.contains(id));
        let keeps = |id: &VehicleId| assigned.auvs.contains(id) || is_first && !is_served(id);
        let valid = ValidRequest { snapshot, context: Context { origin, ..Context::default() } };
        let share = deadline.share(&planners.clock, n - craft);
        let written = |context: &Context, planned: &Planned, _, _: &Stop| {
            Ok((answer(planned, context).planned(), planned.plan.clone()))
        };
        let (response, plan) = valid.planned(planners, Arc::clone(&permit), share, written).await?;
        ahead.push(fleet.as_vessel(craft, Some(&plan)));
        surface_craft.push(CraftPlan::new(id, response, keeps));
    }
    let plans = || surface_craft.iter().filter_map(|craft| craft.plan.as_ref());
    let is_ok = plans().all(|plan| plan.outcome == Outcome::Ok);
    let response = FleetResponse {
        schema_version: SCHEMA_VERSION.to_owned(),
        outcome: if is_ok { Outcome::Ok } else { Outcome::Degraded },
        slots: fleet.slots(&assignment),
        assignment,
        surface_craft,
        metadata,
    };
    Ok(Json(response).into_response())
}
