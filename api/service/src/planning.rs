//! The calls that plan for one snapshot.

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
    admission::Permit,
    body::JsonBytes,
    deadline::Arrival,
    metrics::PlanFor,
    planners::{Planned, Planners},
    problem::{Problem, Refusals},
    query::ValidQuery,
};
use wire::{Answer, Comparison, Origin, PlanRequest, PlanResponse, Plans};

/// Plans: from a snapshot to speed and heading references.
#[utoipa::path(post, path = "/v1/plan", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "A plan. `outcome` tells whether it is what was asked for.", body = PlanResponse),
    Refusals))]
pub(crate) async fn plan(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    body: JsonBytes,
) -> Result<Response, Problem> {
    let (planned, context) = planned(&planners, arrival, body).await?;
    Ok(written(|| answer(&planned, &context).planned()))
}

#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompareQuery {
    /// Whether to explain the plan, which takes as long as planning. If half of the time left until the deadline is too short,
    /// the answer has no `explanation`. Default: false.
    #[serde(default)]
    explain: bool,
}

/// Plans with the planner and with every line-of-sight law, at the service's gains, for the same snapshot.
#[utoipa::path(post, path = "/v1/plan/compare", tag = "plan", params(CompareQuery), request_body = PlanRequest, responses(
    (status = 200, description = "A plan of each, by name.", body = Comparison),
    Refusals))]
pub(crate) async fn compare(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    ValidQuery(CompareQuery { explain }): ValidQuery<CompareQuery>,
    body: JsonBytes,
) -> Result<Json<Comparison>, Problem> {
    let permit = planners.admit(body.bytes.len())?;
    let read = planners
        .read(&permit, || ValidRequest::new(body.read()?))
        .await??;
    let due = planners.due(arrival, read.deadline_ms);
    let (planned, context) = read.planned(&planners, Arc::clone(&permit), arrival).await?;
    let explanation = if explain {
        planners.explain(&permit, &planned, due).await
    } else {
        None
    };
    let answer = answer(&planned, &context);
    // A rollout for each law costs little beside the program, so they run where the answer is written.
    let law = |law| answer.law(law, &planners.parameters);
    Ok(Json(Comparison {
        plans: Plans {
            mpc: answer.planned(),
            saturated_los: answer.line_of_sight(),
            saturated_los_tracker_frame: law(LosLaw::TrackerFrame),
            integral_los: law(LosLaw::Integral),
            waypoint_box: law(LosLaw::WaypointBox),
        },
        explanation,
    }))
}

async fn planned(
    planners: &Planners,
    arrival: Arrival,
    body: JsonBytes,
) -> Result<(Planned, Context), Problem> {
    let permit = planners.admit(body.bytes.len())?;
    let read = planners.read(&permit, || ValidRequest::new(body.read()?));
    read.await??.planned(planners, permit, arrival).await
}

/// A request to plan, whose snapshot is valid.
#[derive(Debug)]
pub(crate) struct ValidRequest {
    pub(crate) snapshot: Snapshot,
    pub(crate) deadline_ms: Option<f64>,
    pub(crate) context: Context,
}

/// What an answer repeats of its request.
#[derive(Debug, Default)]
pub(crate) struct Context {
    pub(crate) origin: Option<Origin>,
    pub(crate) metadata: Map<String, Value>,
}

impl ValidRequest {
    pub(crate) fn new(request: PlanRequest) -> Result<Self, Problem> {
        let origin = request.origin;
        let snapshot = wire::snapshot(request).map_err(Problem::Invalid)?;
        Ok(Self {
            deadline_ms: snapshot.deadline_ms,
            context: Context {
                origin,
                metadata: snapshot.metadata.clone(),
            },
            snapshot,
        })
    }

    /// Its plan, with its context.
    pub(crate) async fn planned(
        self,
        planners: &Planners,
        permit: Arc<Permit>,
        arrival: Arrival,
    ) -> Result<(Planned, Context), Problem> {
        let Self {
            snapshot,
            deadline_ms,
            context,
        } = self;
        let planned = planners.plan(permit, snapshot, arrival, deadline_ms).await?;
        check_fallback(&planned)?;
        let metrics = &planners.metrics;
        metrics.plan(PlanFor::Request, &planned.plan, planned.solve_time);
        Ok((planned, context))
    }
}

/// Fails if the plan is of a lower fallback level and the request accepts only a solved program.
pub(crate) fn check_fallback(planned: &Planned) -> Result<(), Problem> {
    match planned.plan.degraded {
        Some(_) if planned.snapshot.fallback != Fallback::None => Ok(()),
        Some(Degraded::Deadline) => Err(Problem::TimedOut),
        Some(degraded) => Err(Problem::NoSolution(degraded.to_string())),
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
