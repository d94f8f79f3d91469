//! The calls that missions answer.

use std::time::Duration;

use axum::{
    Json,
    body::Body,
    extract::{FromRef, FromRequestParts, Path, Query, rejection::QueryRejection},
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use sha2::{Digest as _, Sha256};
use tokio::time::{Instant, timeout_at};
use utoipa::IntoParams;

use super::{
    Missions,
    actor::{Handle, Key, Order, Seen, json},
    check,
    record::RecordFormat,
    stream,
};
use crate::{
    posted::{Posted, PostedOrNothing},
    problem::{FieldError, MissionRefusals, Problem},
    wire::mission::{Accepted, CurrentReference, Mission, MissionList, NewMission, Reports, Run, Step},
};

/// Missions in one answer.
const LIST_MAX: usize = 1_000;
const LIST_DEFAULT: usize = 100;
/// Longest wait for a plan, s.
const WAIT_MAX: f64 = 60.0;
/// Longest `Idempotency-Key`, bytes.
const KEY_BYTES_MAX: usize = 200;

static IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// What stands behind the `?`; whatever is wrong with it is a [`Problem`].
pub(crate) struct Asked<T>(T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Asked<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let asked: Result<Query<T>, QueryRejection> = Query::from_request_parts(parts, state).await;
        let asked = asked.map_err(|rejection| {
            Problem::Invalid(vec![FieldError::new("", "query", rejection.body_text())])
        })?;
        Ok(Self(asked.0))
    }
}

/// The name of a mission in the path.
pub(crate) struct Named(String);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let named = Path::from_request_parts(parts, state).await;
        named.map(|Path(id)| Self(id)).map_err(|_| Problem::NoMission)
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Missions
where
    Option<Missions>: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(_: &mut Parts, state: &S) -> Result<Self, Problem> {
        Option::from_ref(state).ok_or(Problem::NoMissions)
    }
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
pub(crate) struct Page {
    /// `next` of the answer before. Default: from the first one on.
    #[serde(default)]
    after: u64,
    /// How many at most, from 1 to 1000. Default: 100.
    limit: Option<usize>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wait {
    /// How long to wait for a newer plan, s, at most 60. Default: not at all.
    #[serde(default)]
    wait_s: f64,
    /// Number of the event that stored the plan to wait for a newer one than. Default: that of the one there is.
    after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
pub(crate) struct After {
    /// Number of the event before the first one wanted; a `Last-Event-ID` header goes before it. Default: the last one
    /// there is.
    after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
pub(crate) struct In {
    /// Which format.
    #[param(inline)]
    format: RecordFormat,
}

/// Makes a mission: of the simulator, or of real vehicles.
#[utoipa::path(post, path = "/v1/missions", tag = "missions", request_body = NewMission,
    params(("Idempotency-Key" = Option<String>, Header, description = "Sent again, the same answer comes again.")),
    responses((status = 201, description = "It was made; `run` begins it.", body = Mission), MissionRefusals))]
pub(crate) async fn create(
    missions: Missions,
    headers: HeaderMap,
    Posted(new): Posted<NewMission>,
) -> Result<Response, Problem> {
    let key = key(&headers, "create", &new)?;
    let mission = missions.create(new, key).await?;
    let location = HeaderValue::from_str(&format!("/v1/missions/{}", mission.id));
    let location = location.map_err(|_| Problem::Panicked)?;
    Ok((StatusCode::CREATED, [(header::LOCATION, location)], Json(mission)).into_response())
}

/// Lists missions in the order in which they were made.
#[utoipa::path(get, path = "/v1/missions", tag = "missions", params(Page),
    responses((status = 200, description = "Some of them, and where the next ones begin.", body = MissionList), MissionRefusals))]
pub(crate) async fn list(
    missions: Missions,
    Asked(Page { after, limit }): Asked<Page>,
) -> Result<Json<MissionList>, Problem> {
    let most = limit.unwrap_or(LIST_DEFAULT);
    if !(1..=LIST_MAX).contains(&most) {
        let error = FieldError::new("", "out_of_range", format!("limit must be from 1 to {LIST_MAX}"));
        return Err(Problem::Invalid(vec![error.given(most).limit(LIST_MAX)]));
    }
    let mut listed = missions.list(after, most + 1).await?;
    let more = most < listed.len();
    listed.truncate(most);
    Ok(Json(MissionList {
        next: if more {
            listed.last().map(|(number, _)| *number)
        } else {
            None
        },
        missions: listed.into_iter().map(|(_, mission)| mission).collect(),
    }))
}

/// A mission.
#[utoipa::path(get, path = "/v1/missions/{id}", tag = "missions", params(("id" = String, Path)),
    responses((status = 200, description = "Where it is.", body = Mission), MissionRefusals))]
pub(crate) async fn one(missions: Missions, Named(id): Named) -> Result<Json<Mission>, Problem> {
    Ok(Json(missions.find(&id).await?.1))
}

/// Ends a mission and forgets it, its log too.
#[utoipa::path(delete, path = "/v1/missions/{id}", tag = "missions", params(("id" = String, Path)),
    responses((status = 204, description = "It is gone."), MissionRefusals))]
pub(crate) async fn delete(missions: Missions, Named(id): Named) -> Result<StatusCode, Problem> {
    missions.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Begins a mission, or goes on with it.
#[utoipa::path(post, path = "/v1/missions/{id}/run", tag = "missions", params(("id" = String, Path)),
    request_body = Option<Run>, responses((status = 200, description = "It runs.", body = Mission), MissionRefusals))]
pub(crate) async fn run(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
    PostedOrNothing(run): PostedOrNothing<Run>,
) -> Result<Response, Problem> {
    check::speed_factor(run.speed_factor).map_err(Problem::Invalid)?;
    let key = key(&headers, "run", &run)?;
    Ok(as_json(
        missions.ask(&id, Order::Run(run.speed_factor), key).await?,
    ))
}

/// Holds a mission: no plans are made, reports are taken up.
#[utoipa::path(post, path = "/v1/missions/{id}/pause", tag = "missions", params(("id" = String, Path)),
    responses((status = 200, description = "It is held.", body = Mission), MissionRefusals))]
pub(crate) async fn pause(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let key = key(&headers, "pause", &())?;
    Ok(as_json(missions.ask(&id, Order::Pause, key).await?))
}

/// Ends a mission. What happened in it is kept.
#[utoipa::path(post, path = "/v1/missions/{id}/finish", tag = "missions", params(("id" = String, Path)),
    responses((status = 200, description = "It is over.", body = Mission), MissionRefusals))]
pub(crate) async fn finish(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let key = key(&headers, "finish", &())?;
    Ok(as_json(missions.ask(&id, Order::Finish, key).await?))
}

/// Goes on with a simulated mission for some plans.
#[utoipa::path(post, path = "/v1/missions/{id}/step", tag = "missions", params(("id" = String, Path)),
    request_body = Option<Step>, responses((status = 200, description = "It went on.", body = Mission), MissionRefusals))]
pub(crate) async fn step(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
    PostedOrNothing(step): PostedOrNothing<Step>,
) -> Result<Response, Problem> {
    check::ticks(step.ticks).map_err(Problem::Invalid)?;
    let key = key(&headers, "step", &step)?;
    Ok(as_json(missions.ask(&id, Order::Step(step.ticks), key).await?))
}

/// Takes up what was heard in a live mission. The answer comes when it is on the disk.
#[utoipa::path(post, path = "/v1/missions/{id}/reports", tag = "missions",
    params(("id" = String, Path),
        ("Idempotency-Key" = Option<String>, Header, description = "Sent again, it is stored once.")),
    request_body = Reports,
    responses((status = 200, description = "It is on the disk.", body = Accepted), MissionRefusals))]
pub(crate) async fn reports(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
    Posted(heard): Posted<Reports>,
) -> Result<Response, Problem> {
    let key = key(&headers, "reports", &heard)?;
    Ok(as_json(missions.hear(&id, heard, key).await?))
}

/// The reference that counts now, its age, and how it was come by.
#[utoipa::path(get, path = "/v1/missions/{id}/reference", tag = "missions", params(("id" = String, Path), Wait),
    responses((status = 200, description = "The newest there is.", body = CurrentReference), MissionRefusals))]
pub(crate) async fn reference(
    missions: Missions,
    Named(id): Named,
    Asked(Wait { wait_s, after }): Asked<Wait>,
) -> Result<Json<CurrentReference>, Problem> {
    if !(0.0..=WAIT_MAX).contains(&wait_s) {
        let error = FieldError::new("", "out_of_range", format!("wait_s must be from 0 to {WAIT_MAX}"));
        return Err(Problem::Invalid(vec![error.limit(WAIT_MAX)]));
    }
    let Handle { mut seen, live, .. } = missions.handle(&id).await?;
    if 0.0 < wait_s {
        let there = |seen: &Seen| seen.plan.as_ref().map_or(0, |plan| plan.sequence);
        let after = after.unwrap_or_else(|| there(&seen.borrow()));
        let end = Instant::now() + Duration::from_secs_f64(wait_s);
        // Whether one came, the time was over or the mission ended: what there is then is the answer.
        let newer = seen.wait_for(|seen| after < there(seen) || seen.mission.status.is_over());
        let _ = timeout_at(end, newer).await.map(drop);
    }
    let seen = seen.borrow().clone();
    let Some(plan) = seen.plan else {
        return Err(Problem::NoPlanYet {
            waits_for: seen.waits_for,
        });
    };
    let now = live.map_or(seen.mission.t_s, |live| live.clock.now());
    Ok(Json(CurrentReference {
        mission: id,
        status: seen.mission.status,
        sequence: plan.sequence,
        t_s: plan.time,
        late_s: plan.late,
        age_s: (now - plan.time).max(0.0),
        outcome: plan.answer.outcome,
        method: plan.answer.method,
        heard_s: plan.heard.clone(),
        waits_for: seen.waits_for,
        missed: seen.missed,
        plan: plan.answer.clone(),
    }))
}

/// What happens, as it happens: server-sent events, whose `id` is the event's number in the mission.
///
/// After a break, `Last-Event-ID` resumes where the reader was. Who reads too slowly gets a `gap` with the numbers
/// `from` and `to` of the events that it missed, and then the newest. Comments in between say that the stream lives.
#[utoipa::path(get, path = "/v1/missions/{id}/events", tag = "missions", params(("id" = String, Path), After),
    responses((status = 200, description = "Until the mission is over.", content_type = "text/event-stream",
            body = super::event::Event),
        (status = 204, description = "The mission is over, and there is nothing more to come."), MissionRefusals))]
pub(crate) async fn events(
    missions: Missions,
    Named(id): Named,
    headers: HeaderMap,
    Asked(After { after }): Asked<After>,
) -> Result<Response, Problem> {
    stream::events(missions, &id, last_event_id(&headers)?.or(after)).await
}

/// Everything that happened, in a format for other programs. Written as it is read, at any length.
#[utoipa::path(get, path = "/v1/missions/{id}/record", tag = "missions", params(("id" = String, Path), In),
    responses((status = 200, description = "The record.", content_type = "application/octet-stream"), MissionRefusals))]
pub(crate) async fn record(
    missions: Missions,
    Named(id): Named,
    Asked(In { format }): Asked<In>,
) -> Result<Response, Problem> {
    stream::record(missions, &id, format).await
}

fn as_json(body: Vec<u8>) -> Response {
    let json = HeaderValue::from_static("application/json");
    ([(header::CONTENT_TYPE, json)], Body::from(body)).into_response()
}

/// The client's key for this request.
fn key<T: Serialize>(headers: &HeaderMap, call: &str, asked: &T) -> Result<Option<Key>, Problem> {
    let Some(given) = headers.get(&IDEMPOTENCY_KEY) else {
        return Ok(None);
    };
    let key = given.to_str().unwrap_or_default();
    if !(1..=KEY_BYTES_MAX).contains(&key.len()) {
        let detail =
            format!("the Idempotency-Key header must be 1 to {KEY_BYTES_MAX} visible ASCII characters");
        return Err(Problem::Invalid(vec![FieldError::new(
            "",
            "idempotency_key",
            detail,
        )]));
    }
    let mut request = Sha256::new();
    request.update(call);
    request.update([0]);
    request.update(json(asked));
    Ok(Some(Key {
        key: key.to_owned(),
        request: request.finalize().into(),
    }))
}

fn last_event_id(headers: &HeaderMap) -> Result<Option<u64>, Problem> {
    let Some(given) = headers.get("last-event-id") else {
        return Ok(None);
    };
    let id = given.to_str().ok().and_then(|text| text.parse().ok());
    id.map(Some).ok_or_else(|| {
        let detail = "the Last-Event-ID header must be the id of an event of this mission, a number";
        Problem::Invalid(vec![FieldError::new("", "last_event_id", detail)])
    })
}
