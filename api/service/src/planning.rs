//! The calls that plan.

use std::sync::Arc;

use axum::{
    Extension, Json,
    extract::State,
    response::{IntoResponse as _, Response},
};
use planner::{
    los::LosLaw,
    plan::Degraded,
    snapshot::{Fallback, Snapshot},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use tracing::info_span;
use utoipa::IntoParams;

use crate::{
    admission::Ticket,
    deadline::Arrival,
    metrics::PlanFor,
    missions::routes::Asked,
    planners::{Planned, Planners},
    posted::PostedBytes,
    problem::{Problem, Refusals},
};
use wire::{Answer, Comparison, Origin, PlanRequest, PlanResponse, Plans, degraded_reason};

/// Plans: a snapshot in, speed and heading references out.
#[utoipa::path(post, path = "/v1/plan", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "A plan; `outcome` says whether it is what was asked for.", body = PlanResponse),
    Refusals))]
pub(crate) async fn plan(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    body: PostedBytes,
) -> Result<Response, Problem> {
    let (planned, context) = planned(&planners, arrival, body).await?;
    Ok(written(|| answer(&planned, &context).planned()))
}

#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct Explain {
    /// Whether to say how the planner came to its plan, which takes as long again as planning: the answer has no `explanation` where
    /// half of the time left until its deadline is too short for that. Default: no.
    #[serde(default)]
    explain: bool,
}

/// The same snapshot through the planner and through every line-of-sight law, whose gains are the service's own.
#[utoipa::path(post, path = "/v1/plan/compare", tag = "plan", params(Explain), request_body = PlanRequest, responses(
    (status = 200, description = "A plan from each, by name.", body = Comparison),
    Refusals))]
pub(crate) async fn compare(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    Asked(Explain { explain }): Asked<Explain>,
    body: PostedBytes,
) -> Result<Json<Comparison>, Problem> {
    let ticket = planners.admit(body.bytes.len())?;
    let read = planners
        .read(&ticket, || ValidRequest::new(body.read()?))
        .await??;
    let due = planners.due(arrival, read.deadline_ms);
    let (planned, context) = read.planned(&planners, Arc::clone(&ticket), arrival).await?;
    let found = if explain {
        planners.explain(&ticket, &planned.snapshot, due).await
    } else {
        None
    };
    let answer = answer(&planned, &context);
    // A rollout each: little beside the program, so they run where the answer is written.
    let law = |law| answer.law(law, planners.policy());
    Ok(Json(Comparison {
        plans: Plans {
            mpc: answer.planned(),
            saturated_los: answer.line_of_sight(),
            saturated_los_tracker_frame: law(LosLaw::TrackerFrame),
            integral_los: law(LosLaw::Integral),
            waypoint_box: law(LosLaw::WaypointBox),
            printed_los: law(LosLaw::Printed),
        },
        explanation: found.map(|found| answer.explained(&found, planners.policy())),
    }))
}

async fn planned(
    planners: &Planners,
    arrival: Arrival,
    body: PostedBytes,
) -> Result<(Planned, Context), Problem> {
    let ticket = planners.admit(body.bytes.len())?;
    let read = planners.read(&ticket, || ValidRequest::new(body.read()?));
    read.await??.planned(planners, ticket, arrival).await
}

/// A request to plan, whose snapshot is valid.
#[derive(Debug)]
pub(crate) struct ValidRequest {
    pub(crate) snapshot: Snapshot,
    pub(crate) deadline_ms: Option<f64>,
    pub(crate) context: Context,
}

/// What an answer tells of its request beside the plan.
#[derive(Debug, Default)]
pub(crate) struct Context {
    pub(crate) origin: Option<Origin>,
    pub(crate) metadata: Map<String, Value>,
}

impl ValidRequest {
    pub(crate) fn new(request: PlanRequest) -> Result<Self, Problem> {
        Ok(Self {
            snapshot: Snapshot::try_from(&request).map_err(Problem::Invalid)?,
            deadline_ms: request.deadline_ms,
            context: Context {
                origin: request.origin,
                metadata: request.metadata,
            },
        })
    }

    /// Its plan, and its context again.
    pub(crate) async fn planned(
        self,
        planners: &Planners,
        ticket: Arc<Ticket>,
        arrival: Arrival,
    ) -> Result<(Planned, Context), Problem> {
        let Self {
            snapshot,
            deadline_ms,
            context,
        } = self;
        let planned = planners.plan(ticket, snapshot, arrival, deadline_ms).await?;
        refuse_a_lower_level(&planned)?;
        let metrics = planners.metrics();
        metrics.plan(PlanFor::Request, &planned.plan, planned.solve_time);
        Ok((planned, context))
    }
}

/// Where nothing but a solved program will do.
pub(crate) fn refuse_a_lower_level(planned: &Planned) -> Result<(), Problem> {
    match planned.plan.degraded {
        Some(_) if planned.snapshot.fallback != Fallback::None => Ok(()),
        Some(Degraded::Deadline) => Err(Problem::TimedOut),
        Some(degraded) => Err(Problem::NoSolution(degraded_reason(degraded))),
        None => Ok(()),
    }
}

pub(crate) fn answer<'a>(planned: &'a Planned, context: &'a Context) -> Answer<'a> {
    let Planned {
        snapshot,
        plan,
        solve_time,
        ..
    } = planned;
    Answer::new(snapshot, plan, *solve_time, &context.metadata).on_earth(context.origin)
}

/// The answer's JSON.
fn written<T: Serialize>(answer: impl FnOnce() -> T) -> Response {
    info_span!("write").in_scope(|| Json(answer()).into_response())
}
