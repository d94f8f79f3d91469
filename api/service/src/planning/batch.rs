//! Several snapshots in one request, the validation of a snapshot, and the limits of the service.

use std::sync::Arc;

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use axum::{Extension, Json};
use planner::snapshot::{AUVS_MAX, REPORTS_MAX};
use planner::stop::Stop;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::edge::arrival::Arrival;
use crate::edge::body::BodyBytes;
use crate::edge::problem::{Problem, ProblemDocument, Refusals};
use crate::edge::request_id::RequestId;
use crate::limits::{BATCH_MAX, BODY_BYTES_MAX};
use crate::planning::admission::Work;
use crate::planning::deadline::Deadline;
use crate::planning::planners::{Planned, Planners};
use crate::planning::valid_request::{Context, ValidRequest, answer, written};
use wire::{DEADLINE_MS, FleetRequest, METADATA_BYTES_MAX, PlanRequest, PlanResponse, VALUES_MAX, plan_id};

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

/// The service's reading of a snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Validation {
    /// The `plan_id` of its answer.
    pub plan_id: String,
    /// The snapshot with every default filled in.
    pub request: PlanRequest,
}

/// The service's reading of a fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FleetValidation {
    /// The request with every default filled in.
    #[schema(value_type = Object)]
    pub request: Map<String, Value>,
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
    body: BodyBytes,
) -> Result<Response, Problem> {
    let permit = planners.admit(Work::Batch, body.bytes.len())?;
    let (clock, limit) = (planners.clock.clone(), planners.deadline);
    let read = planners.read(&permit, move |caller| {
        let requests = wire::read_each::<PlanRequest>(&body.bytes, "requests", BATCH_MAX)?;
        let n = requests.len();
        let valid = requests.into_iter().enumerate().map(|(i, request)| {
            let request = request?;
            let deadline = Deadline::new(arrival, request.deadline_ms, limit);
            // Plans get half of the time.
            let share = deadline.share(&clock, 2 * n - i);
            let valid = ValidRequest::new(request, &share.stop(&clock, caller.clone()))?;
            Ok((valid, deadline))
        });
        Ok::<Vec<Result<_, Problem>>, Problem>(valid.collect())
    });
    let read = read.await??;
    let n = read.len();
    let mut answers = b"{\"answers\":[".to_vec();
    // One at a time: a batch takes the threads of one request, and each plan its share of the time.
    for (i, valid) in read.into_iter().enumerate() {
        let planned = async {
            let (valid, deadline) = valid?;
            let share = deadline.share(&planners.clock, n - i);
            let permit = Arc::clone(&permit);
            let item = |context: &Context, planned: &Planned, _, _: &Stop| {
                let plan = Some(answer(planned, context).planned());
                Ok(as_json(200, plan, None))
            };
            valid.planned(&planners, permit, share, item).await
        };
        let item = planned.await.unwrap_or_else(|problem| {
            let problem = problem.within(&format!("/requests/{i}"));
            let document = problem.document("/v1/plan/batch", &id.0);
            as_json(document.status, None, Some(document))
        });
        answers.extend_from_slice(if 0 < i { b"," } else { b"" });
        answers.extend_from_slice(&item);
    }
    answers.extend_from_slice(b"]}");
    Ok(([(header::CONTENT_TYPE, "application/json")], answers).into_response())
}

fn as_json(status: u16, plan: Option<PlanResponse>, problem: Option<ProblemDocument>) -> Vec<u8> {
    let item = BatchItem { status, plan, problem };
    serde_json::to_vec(&item).expect("strings, numbers and lists only")
}

/// Validates a snapshot, or a fleet, without planning, by the same rules as a plan.
#[utoipa::path(post, path = "/v1/plan/validate", tag = "plan", request_body = PlanRequest, responses(
    (status = 200, description = "The snapshot is valid.", body = Validation), Refusals))]
pub(crate) async fn validate_plan(
    State(planners): State<Planners>,
    body: BodyBytes,
) -> Result<Response, Problem> {
    let permit = planners.admit(Work::Reading, body.bytes.len())?;
    let read = planners.read(&permit, |_| {
        // No estimate is needed.
        if wire::is_of_fleet(&body.bytes) {
            let request = FleetRequest::read(&body.bytes)?;
            let fleet = request.clone().fleet(&|| true).map_err(Problem::Invalid)?;
            return Ok(written(|| FleetValidation { request: request.with_defaults(&fleet) }));
        }
        let request: PlanRequest = body.read()?;
        let ValidRequest { snapshot, .. } = ValidRequest::new(request.clone(), &Stop::at_once())?;
        Ok(written(|| Validation {
            plan_id: plan_id(&snapshot),
            request: wire::with_defaults(request, &snapshot),
        }))
    });
    read.await?
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
