//! Requests to plan for one craft: checked, planned, answered.

use std::sync::Arc;

use axum::Json;
use axum::response::{IntoResponse as _, Response};
use planner::{
    plan::Degraded,
    snapshot::{Fallback, Snapshot},
    stop::Stop,
};
use serde::Serialize;
use serde_json::{Map, Value};
use tracing::info_span;

use crate::edge::problem::Problem;
use crate::metrics::PlanFor;
use crate::planning::admission::Permit;
use crate::planning::deadline::Deadline;
use crate::planning::planners::{Planned, Planners};
use wire::{Answer, Origin, PlanRequest};

/// A request to plan, whose snapshot is valid.
#[derive(Debug)]
pub(crate) struct ValidRequest {
    pub(crate) snapshot: Snapshot,
    pub(crate) context: Context,
}

/// The parts of a request that its answer repeats.
#[derive(Debug, Default)]
pub(crate) struct Context {
    pub(crate) origin: Option<Origin>,
    pub(crate) metadata: Map<String, Value>,
}

impl ValidRequest {
    /// Checks the request, and estimates while there is time.
    pub(crate) fn new(request: PlanRequest, stop: &Stop) -> Result<Self, Problem> {
        let origin = request.origin;
        let snapshot = wire::snapshot_until(request, &|| stop.is_due()).map_err(Problem::Invalid)?;
        Ok(Self { context: Context { origin, metadata: snapshot.metadata.clone() }, snapshot })
    }

    /// The `answer` about its plan.
    pub(crate) async fn planned<T: Send + 'static>(
        self,
        planners: &Planners,
        permit: Arc<Permit>,
        deadline: Deadline,
        answer: impl Fn(&Context, &Planned, Deadline, &Stop) -> Result<T, Problem> + Send + Sync + 'static,
    ) -> Result<T, Problem> {
        let Self { snapshot, context } = self;
        let answered = move |planned: &Planned, stop: &Stop| {
            check_fallback(&planned.snapshot, planned.plan.degraded)?;
            answer(&context, planned, deadline, stop)
        };
        let planned = planners.plan(permit, snapshot, deadline, answered);
        let (Planned { plan, solve_time, .. }, answer) = planned.await?;
        if answer.is_ok() {
            planners.metrics.plan(PlanFor::Request, &plan, solve_time);
        }
        answer
    }
}

/// Fails if an answer is `degraded` and the request does not accept that.
pub(crate) fn check_fallback(snapshot: &Snapshot, degraded: Option<Degraded>) -> Result<(), Problem> {
    match degraded {
        Some(_) if snapshot.fallback != Fallback::None => Ok(()),
        Some(Degraded::Deadline) => Err(Problem::TimedOut),
        Some(degraded) => Err(Problem::NoSolution(degraded.to_string())),
        None => Ok(()),
    }
}

pub(crate) fn answer<'a>(planned: &'a Planned, context: &'a Context) -> Answer<'a> {
    let (snapshot, plan) = (&planned.snapshot, &planned.plan);
    Answer::new(snapshot, plan, planned.solve_time, &context.metadata).on_earth(context.origin)
}

pub(crate) fn written<T: Serialize>(answer: impl FnOnce() -> T) -> Response {
    info_span!("write").in_scope(|| Json(answer()).into_response())
}
