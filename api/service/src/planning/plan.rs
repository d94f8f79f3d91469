//! The calls that plan for one snapshot.

use std::sync::Arc;

use axum::extract::State;
use axum::response::{IntoResponse as _, Response};
use axum::{Extension, Json};
use planner::{
    explain::explain as explain_plan,
    los::LosLaw,
    plan::{Degraded, baselines},
    snapshot::{Fallback, Snapshot},
    stop::Stop,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use tracing::info_span;
use utoipa::IntoParams;

use crate::edge::arrival::Arrival;
use crate::edge::body::BodyBytes;
use crate::edge::problem::{Problem, Refusals};
use crate::edge::query::ValidQuery;
use crate::metrics::PlanFor;
use crate::planning::admission::{Permit, Work};
use crate::planning::deadline::Deadline;
use crate::planning::fleet::plan_fleet;
use crate::planning::planners::{Planned, Planners};
use wire::{Answer, Comparison, Origin, PlanRequest, PlanResponse, Plans};

/// Plans: from a snapshot to speed and heading references.
#[utoipa::path(post, path = "/v1/plan", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "A plan. `outcome` tells whether it is what was asked for.", body = PlanResponse),
    Refusals))]
pub(crate) async fn plan(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    body: BodyBytes,
) -> Result<Response, Problem> {
    if wire::is_of_fleet(&body.bytes) {
        return plan_fleet(&planners, arrival, body).await;
    }
    let answer = |context: &Context, planned: &Planned, _, _: &Stop| {
        Ok(written(|| answer(planned, context).planned()))
    };
    planned(&planners, (Work::Plan, arrival), body, answer).await
}

#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompareQuery {
    /// Explain the plan, which takes as long as planning. If half of the time left until the
    /// deadline is too short, the answer has no `explanation`. Default: false.
    #[serde(default)]
    explain: bool,
}

/// Plans the same snapshot with the planner and each line-of-sight law, at the service's gains.
#[utoipa::path(post, path = "/v1/plan/compare", tag = "plan", params(CompareQuery), request_body = PlanRequest, responses(
    (status = 200, description = "A plan of each, by name.", body = Comparison),
    Refusals))]
pub(crate) async fn compare(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    ValidQuery(CompareQuery { explain }): ValidQuery<CompareQuery>,
    body: BodyBytes,
) -> Result<Response, Problem> {
    let (parameters, clock) = (Arc::clone(&planners.parameters), planners.clock.clone());
    let compared = move |context: &Context, planned: &Planned, deadline: Deadline, stop: &Stop| {
        let snapshot = &planned.snapshot;
        let laws = baselines(snapshot, &parameters, stop);
        let cut_short = laws.iter().find_map(|law| law.degraded);
        check_fallback(snapshot, cut_short)?;
        let explained = || {
            let (half, stop, clock) = (deadline.share(&clock, 2).instant(), stop.clone(), clock.clone());
            let stop = Stop::when(move || stop.is_due() || half <= clock.now());
            let explanation = explain_plan(snapshot, planned.plan.cost_terms, &parameters, &stop);
            // An explanation that was cut short belongs to a different plan.
            (!stop.was_due()).then_some(explanation)
        };
        let wanted = explain && !stop.is_due();
        let explanation = wanted.then(explained).flatten();
        let answer = answer(planned, context);
        let law = |law: usize| answer.law(LosLaw::ALL[law], &laws[law]);
        let plans = Plans {
            mpc: answer.planned(),
            saturated_los: law(0),
            saturated_los_tracker_frame: law(1),
            integral_los: law(2),
            waypoint_box: law(3),
        };
        Ok(written(|| Comparison { plans, explanation }))
    };
    planned(&planners, (Work::Comparison, arrival), body, compared).await
}

/// The `answer` about the plan for the snapshot in `body`.
async fn planned<T: Send + 'static>(
    planners: &Planners,
    (work, arrival): (Work, Arrival),
    body: BodyBytes,
    answer: impl Fn(&Context, &Planned, Deadline, &Stop) -> Result<T, Problem> + Send + Sync + 'static,
) -> Result<T, Problem> {
    let permit = planners.admit(work, body.bytes.len())?;
    let (clock, limit) = (planners.clock.clone(), planners.deadline);
    let read = planners.read(&permit, move |caller| {
        let request: PlanRequest = body.read()?;
        let deadline = Deadline::new(arrival, request.deadline_ms, limit);
        let valid = ValidRequest::new(request, &deadline.stop(&clock, caller))?;
        Ok::<_, Problem>((valid, deadline))
    });
    let (valid, deadline) = read.await??;
    valid.planned(planners, permit, deadline, answer).await
}

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
