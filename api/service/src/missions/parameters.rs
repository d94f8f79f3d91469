//! Parts of the requests of missions: paths, headers, queries and bodies.

use std::convert::Infallible;

use axum::extract::{FromRef, FromRequest, FromRequestParts, Path, Request};
use axum::http::HeaderValue;
use axum::http::request::Parts;
use http_body::Body as _;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use utoipa::IntoParams;
use wire::FieldError;

use super::actor::IdempotencyKey;
use super::event::{Event, json};
use super::record::RecordFormat;
use super::registry::Missions;
use crate::edge::access::{By, changes_nothing};
use crate::edge::body::{Bodies, BodyBytes};
use crate::edge::problem::Problem;
use crate::edge::query::{out_of_range, wrong_parameter};
use crate::planning::planners::Planners;
use crate::planning::pool::Priority;

/// Missions or orders on one page.
const LIST_MAX: usize = 1_000;
const LIST_DEFAULT: usize = 100;
/// Longest wait for a plan, s.
pub(super) const WAIT_MAX: f64 = 60.0;
const KEY_BYTES_MAX: usize = 200;

/// The mission of a path, which the caller's limit allows.
#[derive(IntoParams)]
#[into_params(names("id"), parameter_in = Path)]
pub(crate) struct MissionId(
    /// The mission's `id`.
    pub(super) String,
);

impl<S: Send + Sync> FromRequestParts<S> for MissionId
where
    Option<Missions>: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let id = Path::<String>::from_request_parts(parts, state).await;
        let Path(id) = id.map_err(|_| Problem::NoMission)?;
        let by = By::from_request_parts(parts, state).await?;
        if let (Some(limit), Some(missions)) = (by.limit(), Option::<Missions>::from_ref(state))
            && !limit.names(&id)
        {
            let mission = missions.known(&id).await?;
            // A caller of one craft of a fleet reports for that one, and gives no orders to all.
            let path = parts.uri.path();
            let is_no_order = changes_nothing(&parts.method, path) || path.ends_with("/reports");
            let may = limit.commands(&mission) || is_no_order && limit.sees(&mission);
            if !may {
                return Err(Problem::Limited(limit.clone()));
            }
        }
        Ok(Self(id))
    }
}

/// The `Idempotency-Key` header.
#[derive(IntoParams)]
#[into_params(names("Idempotency-Key"), parameter_in = Header)]
pub(crate) struct IdempotencyKeyHeader(
    /// The client's name for this request, visible ASCII. A repeated request with the same key is
    /// executed once and gets the same answer.
    #[param(value_type = Option<String>)]
    Option<HeaderValue>,
);

impl<S: Send + Sync> FromRequestParts<S> for IdempotencyKeyHeader {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self(parts.headers.get("idempotency-key").cloned()))
    }
}

impl IdempotencyKeyHeader {
    /// The key of a `call` with that `body`, if the client gave one.
    pub(super) fn of<T: Serialize>(
        self,
        by: &By,
        call: &str,
        body: &T,
    ) -> Result<Option<IdempotencyKey>, Problem> {
        let Some(given) = self.0 else { return Ok(None) };
        let key = given.to_str().unwrap_or_default();
        if !(1..=KEY_BYTES_MAX).contains(&key.len()) {
            let detail = format!("this header must be 1 to {KEY_BYTES_MAX} visible ASCII characters");
            return Err(wrong_parameter("Idempotency-Key", "idempotency_key", detail));
        }
        let mut request = Sha256::new();
        request.update(call);
        request.update([0]);
        request.update(json(body));
        Ok(Some(IdempotencyKey { key: by.own(key), request: request.finalize().into() }))
    }
}

/// The `Last-Event-ID` header.
#[derive(IntoParams)]
#[into_params(names("Last-Event-ID"), parameter_in = Header)]
pub(crate) struct LastEventId(
    /// Number of the last event that the reader has: the stream continues after it.
    pub(super) Option<u64>,
);

impl<S: Send + Sync> FromRequestParts<S> for LastEventId {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let Some(given) = parts.headers.get("last-event-id") else {
            return Ok(Self(None));
        };
        let id = given.to_str().ok().and_then(|text| text.parse().ok());
        id.map(|id| Self(Some(id))).ok_or_else(|| {
            let detail = "this header must be the id of an event of this stream, a number";
            wrong_parameter("Last-Event-ID", "last_event_id", detail)
        })
    }
}

/// The limits of parameters, in JSON Schema, by their names.
pub(crate) fn parameter_limits() -> Value {
    let kind = Event::KINDS.join("|");
    json!({
        "limit": { "minimum": 1, "maximum": LIST_MAX, "default": LIST_DEFAULT },
        "wait_s": { "minimum": 0, "maximum": WAIT_MAX, "default": 0 },
        "Idempotency-Key":
            { "minLength": 1, "maxLength": KEY_BYTES_MAX, "pattern": "^[!-~]([\\t -~]*[!-~])?$" },
        "kinds": { "pattern": format!("^({kind})(,({kind}))*$") },
    })
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct PageQuery {
    /// `next` of the previous page. Default: the first page.
    #[serde(default)]
    pub(crate) after: u64,
    /// Most entries on a page, from 1 to 1000; a page of long entries ends earlier. Default: 100.
    pub(crate) limit: Option<usize>,
}

/// The length of a page, of which the client requested `limit`.
pub(super) fn page_length(limit: Option<usize>) -> Result<usize, Problem> {
    let most = limit.unwrap_or(LIST_DEFAULT);
    if !(1..=LIST_MAX).contains(&most) {
        return Err(out_of_range("limit", most, 1, LIST_MAX));
    }
    Ok(most)
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct AuditQuery {
    /// The mission. Default: all missions.
    pub(super) mission: Option<String>,
    /// `next` of the previous page. Default: the first page.
    #[serde(default)]
    pub(super) after: u64,
    /// Most entries on a page, from 1 to 1000; a page of long entries ends earlier. Default: 100.
    pub(super) limit: Option<usize>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReferenceQuery {
    /// The craft of a fleet. Missions of one craft take none.
    pub(super) craft: Option<String>,
    /// Longest wait for a newer plan, s, at most 60. Default: 0.
    #[serde(default)]
    pub(super) wait_s: f64,
    /// Wait for a plan newer than that of the event with this number. Default: the current plan.
    pub(super) after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct EventsQuery {
    /// Begin after the event with this number. `Last-Event-ID` overrides it. Default: the newest.
    pub(super) after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct RecordQuery {
    /// The format.
    #[param(inline, required, value_type = RecordFormat)]
    pub(super) format: Option<RecordFormat>,
    /// Number of the event after which the record begins. Default: the first event is included.
    #[serde(default)]
    pub(super) after: u64,
    /// Most events in the record. Default: all.
    pub(super) max_events: Option<u64>,
    /// Kinds of events, separated by commas, such as `planned,changed`. Default: every kind.
    #[param(example = "planned")]
    pub(super) kinds: Option<String>,
}

pub(super) fn kinds_of(query: Option<&str>) -> Result<Vec<String>, Problem> {
    let kinds: Vec<String> =
        query.map_or_else(Vec::new, |kinds| kinds.split(',').map(str::to_owned).collect());
    match kinds.iter().find(|kind| !Event::KINDS.contains(&kind.as_str())) {
        None => Ok(kinds),
        Some(wrong) => {
            let detail = format!("must be kinds of events: {}", Event::KINDS.join(", "));
            let error = FieldError::of_parameter("kinds", "unknown", detail).given(wrong.as_str());
            Err(Problem::Invalid(vec![error]))
        }
    }
}

/// A JSON body of the shape `T`, of a call about a mission.
#[derive(Debug)]
pub(crate) struct JsonBody<T>(pub(crate) T);

impl<T, S> FromRequest<S> for JsonBody<T>
where
    T: DeserializeOwned + Send + 'static,
    S: Send + Sync,
    Bodies: FromRef<S>,
    Planners: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let body = BodyBytes::from_request(request, state).await?;
        let (planners, bytes) = (Planners::from_ref(state), body.bytes.len());
        let read = planners.read_body_for_mission(Priority::Long, bytes, || body.read());
        read.await?.map(Self)
    }
}

/// A JSON body of the shape `T`; without a body, the default.
#[derive(Debug)]
pub(crate) struct OptionalJsonBody<T>(pub(crate) T);

impl<T, S> FromRequest<S> for OptionalJsonBody<T>
where
    T: DeserializeOwned + Default + Send + 'static,
    S: Send + Sync,
    Bodies: FromRef<S>,
    Planners: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        if request.body().is_end_stream() {
            return Ok(Self(T::default()));
        }
        let JsonBody(body) = JsonBody::from_request(request, state).await?;
        Ok(Self(body))
    }
}
