//! Several snapshots at once, and a snapshot that is only looked at.

use std::sync::Arc;

use axum::{Extension, Json, extract::State};
use planner::snapshot::{AUVS_MAX, REPORTS_MAX};
use serde::{Deserialize, Serialize};
use tokio::task::JoinHandle;
use tracing::Instrument as _;
use utoipa::ToSchema;

use crate::{
    deadline::Arrival,
    edge::RequestId,
    planners::Planners,
    planning::{Context, ValidRequest, answer},
    posted::{BODY_BYTES_MAX, PostedBytes},
    problem::{Problem, ProblemDocument, Refusals},
};
use wire::{DEADLINE_MS, METADATA_BYTES_MAX, PlanRequest, PlanResponse, VALUES_MAX, plan_id};

/// Snapshots in one request.
pub(crate) const BATCH_MAX: usize = 64;

/// Snapshots to plan for, each by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Batch {
    /// The snapshots, from 1 to 64. What is wrong with one spoils no other.
    #[schema(min_items = 1, max_items = 64)]
    pub requests: Vec<PlanRequest>,
}

/// An answer to each snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BatchAnswer {
    /// In the order of the requests.
    pub answers: Vec<BatchItem>,
}

/// A plan, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BatchItem {
    /// The status code that the snapshot would be answered with alone.
    pub status: u16,
    /// The plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanResponse>,
    /// The problem; its pointers lead into the whole body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<ProblemDocument>,
}

/// What a snapshot is taken for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Validation {
    /// `plan_id` of the answer that it would get.
    pub plan_id: String,
    /// The snapshot with every default spelled out.
    pub request: PlanRequest,
}

/// What the service takes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ServiceLimits {
    /// Longest body, bytes.
    pub body_bytes: usize,
    /// Most values in a body, about.
    pub values: usize,
    /// Longest `metadata`, bytes of compact JSON.
    pub metadata_bytes: usize,
    /// Most AUVs in a snapshot or a mission.
    pub auvs: usize,
    /// Most reports of a vehicle.
    pub reports: usize,
    /// Most snapshots in a batch.
    pub batch_requests: usize,
    /// Shortest deadline that a request may ask for, ms.
    pub deadline_least_ms: f64,
    /// Longest time for an answer, ms, whatever a request asks for.
    pub deadline_most_ms: f64,
}

/// Plans for several snapshots. One that is not valid, or cannot be planned for, has its problem instead of a plan.
#[utoipa::path(post, path = "/v1/plan/batch", tag = "plan", request_body = Batch, responses(
    (status = 200, description = "An answer to each, in their order.", body = BatchAnswer), Refusals))]
pub(crate) async fn plan_batch(
    State(planners): State<Planners>,
    Extension(arrival): Extension<Arrival>,
    Extension(id): Extension<RequestId>,
    body: PostedBytes,
) -> Result<Json<BatchAnswer>, Problem> {
    let ticket = planners.admit(body.bytes.len())?;
    let read = planners.read(&ticket, || {
        let requests = body.read_each::<PlanRequest>("requests", BATCH_MAX)?;
        let valid = requests.into_iter().map(|request| ValidRequest::new(request?));
        Ok::<Vec<_>, Problem>(valid.collect())
    });
    // At once, so that none uses up the time of those behind it.
    let mut plans: Vec<JoinHandle<Result<PlanResponse, Problem>>> = vec![];
    for valid in read.await?? {
        let (planners, ticket) = (planners.clone(), Arc::clone(&ticket));
        let plan = async move {
            let (planned, context) = valid?.planned(&planners, ticket, arrival).await?;
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

/// Looks at a snapshot and plans nothing: refuses what a plan would be refused for.
#[utoipa::path(post, path = "/v1/plan/validate", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "It is valid.", body = Validation), Refusals))]
pub(crate) async fn validate_plan(
    State(planners): State<Planners>,
    body: PostedBytes,
) -> Result<Json<Validation>, Problem> {
    let ticket = planners.admit(body.bytes.len())?;
    let read = planners.read(&ticket, || {
        let ValidRequest {
            snapshot,
            deadline_ms,
            context: Context { origin, metadata },
        } = ValidRequest::new(body.read()?)?;
        Ok(Validation {
            plan_id: plan_id(&snapshot),
            request: PlanRequest {
                origin,
                deadline_ms,
                metadata,
                ..PlanRequest::from(&snapshot)
            },
        })
    });
    read.await?.map(Json)
}

/// What the service takes on.
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
        deadline_most_ms: planners.deadline().as_secs_f64() * 1e3,
    })
}
