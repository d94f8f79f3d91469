//! Several snapshots in one request, the validation of a snapshot, and the limits of the service.

use std::sync::Arc;

use axum::{Extension, Json, extract::State};
use planner::snapshot::{AUVS_MAX, REPORTS_MAX};
use serde::{Deserialize, Serialize};
use tokio::task::JoinHandle;
use tracing::Instrument as _;
use utoipa::ToSchema;

use crate::{
    body::JsonBytes,
    body_size::BODY_BYTES_MAX,
    deadline::Arrival,
    planners::Planners,
    planning::{ValidRequest, answer},
    problem::{Problem, ProblemDocument, Refusals},
    request_id::RequestId,
};
use wire::{DEADLINE_MS, METADATA_BYTES_MAX, PlanRequest, PlanResponse, VALUES_MAX, plan_id};

/// Most snapshots in one request.
pub(crate) const BATCH_MAX: usize = 64;

/// Snapshots to plan for, independently of each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Batch {
    /// The snapshots, from 1 to 64. An invalid one does not affect the others.
    #[schema(min_items = 1, max_items = 64)]
    pub requests: Vec<PlanRequest>,
}

/// Answers to a batch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BatchAnswer {
    /// The answers, in the order of the requests.
    pub answers: Vec<BatchItem>,
}

/// A plan, or the reason why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BatchItem {
    /// The status code that the snapshot alone would get.
    pub status: u16,
    /// The plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanResponse>,
    /// The problem. Its pointers refer to the whole body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<ProblemDocument>,
}

/// How the service reads a snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Validation {
    /// The `plan_id` of its answer.
    pub plan_id: String,
    /// The snapshot with every default filled in.
    pub request: PlanRequest,
}

/// The limits of the service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ServiceLimits {
    /// Longest body, bytes.
    pub body_bytes: usize,
    /// Most values in a body, approximately.
    pub values: usize,
    /// Longest `metadata`, bytes of compact JSON.
    pub metadata_bytes: usize,
    /// Most AUVs in a snapshot or a mission.
    pub auvs: usize,
    /// Most reports of a vehicle.
    pub reports: usize,
    /// Most snapshots in a batch.
    pub batch_requests: usize,
    /// Shortest deadline of a request, ms.
    pub deadline_least_ms: f64,
    /// Longest time for an answer, ms, even if a request allows more.
    pub deadline_most_ms: f64,
}

/// Plans for several snapshots. The answer to one that fails is its problem document.
#[utoipa::path(post, path = "/v1/plan/batch", tag = "plan", request_body = Batch, responses(
    (status = 200, description = "An answer to each snapshot, in their order.", body = BatchAnswer), Refusals))]
pub(crate) async fn plan_batch(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    Extension(id): Extension<RequestId>,
    body: JsonBytes,
) -> Result<Json<BatchAnswer>, Problem> {
    let permit = planners.admit(body.bytes.len())?;
    let read = planners.read(&permit, || {
        let requests = body.read_each::<PlanRequest>("requests", BATCH_MAX)?;
        let valid = requests.into_iter().map(|request| ValidRequest::new(request?));
        Ok::<Vec<_>, Problem>(valid.collect())
    });
    // Concurrently, so that none uses the time of the others.
    let mut plans: Vec<JoinHandle<Result<PlanResponse, Problem>>> = vec![];
    for valid in read.await?? {
        let (planners, permit) = (planners.clone(), Arc::clone(&permit));
        let plan = async move {
            let (planned, context) = valid?.planned(&planners, permit, arrival).await?;
            Ok(answer(&planned, &context).planned())
        };
        plans.push(tokio::spawn(plan.in_current_span()));
    }
    let mut answers = Vec::with_capacity(plans.len());
    for (i, plan) in plans.into_iter().enumerate() {
        answers.push(match plan.await.map_err(|_| Problem::Panicked).flatten() {
            Ok(plan) => BatchItem {
                status: 200,
                plan: Some(plan),
                problem: None,
            },
            Err(problem) => {
                let problem = problem.within(&format!("/requests/{i}"));
                let document = problem.document("/v1/plan/batch", &id.0);
                BatchItem {
                    status: document.status,
                    plan: None,
                    problem: Some(document),
                }
            }
        });
    }
    Ok(Json(BatchAnswer { answers }))
}

/// Validates a snapshot without planning: it refuses what a plan would be refused for.
#[utoipa::path(post, path = "/v1/plan/validate", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "The snapshot is valid.", body = Validation), Refusals))]
pub(crate) async fn validate_plan(
    State(planners): State<Planners>,
    body: JsonBytes,
) -> Result<Json<Validation>, Problem> {
    let permit = planners.admit(body.bytes.len())?;
    let read = planners.read(&permit, || {
        let request: PlanRequest = body.read()?;
        let ValidRequest { snapshot, .. } = ValidRequest::new(request.clone())?;
        Ok(Validation {
            plan_id: plan_id(&snapshot),
            request: wire::with_defaults(request, &snapshot),
        })
    });
    read.await?.map(Json)
}

/// Returns the limits of the service.
#[utoipa::path(get, path = "/v1/limits", tag = "service",
    responses((status = 200, description = "Lengths, counts and times.", body = ServiceLimits)))]
pub(crate) async fn get_limits(State(planners): State<Planners>) -> Json<ServiceLimits> {
    Json(ServiceLimits {
        body_bytes: BODY_BYTES_MAX,
        values: VALUES_MAX,
        metadata_bytes: METADATA_BYTES_MAX,
        auvs: AUVS_MAX,
        reports: REPORTS_MAX,
        batch_requests: BATCH_MAX,
        deadline_least_ms: *DEADLINE_MS.start(),
        deadline_most_ms: planners.deadline.as_secs_f64() * 1e3,
    })
}
