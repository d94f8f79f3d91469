//! The HTTP calls of missions.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use axum::Json;
use axum::extract::{FromRef, FromRequestParts, State};
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use clock::Clock;
use serde::Serialize;
use utoipa::{
    IntoResponses,
    openapi::{self, ContentBuilder, KnownFormat, Object, RefOr, ResponseBuilder, SchemaFormat, Type},
};

use super::actor::{Command, Handle, LiveMission, NO_REPORTS, View};
use super::if_match::IfMatch;
use super::parameters::{
    AuditQuery, EventsQuery, IdempotencyKeyHeader, JsonBody, LastEventId, MissionId, OptionalJsonBody,
    PageQuery, RecordQuery, ReferenceQuery, WAIT_MAX, kinds_of, page_length,
};
use super::record::{EventFilter, RecordFormat};
use super::registry::{Missions, with_paths_of_now};
use super::{check, scene, stream};
use store::EventReader;

use crate::edge::access::By;
use crate::edge::body::BodyBytes;
use crate::edge::problem::{MissionRefusals, Problem};
use crate::edge::query::{ValidQuery, out_of_range, wrong_parameter};
use crate::planning::admission::Work;
use crate::planning::planners::Planners;
use crate::planning::pool::Priority;
use wire::mission::{
    Accepted, CurrentReference, Mission, MissionList, NewMission, OrderList, Reports, Run, Scene, Setting,
    Step,
};
use wire::{Body, FieldError, Origin};

/// Number of the last orders in the refusal of a call.
const ORDERS_TOLD: usize = 3;

impl<S: Send + Sync> FromRequestParts<S> for Missions
where
    Option<Missions>: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(_: &mut Parts, state: &S) -> Result<Self, Problem> {
        Option::from_ref(state).ok_or(Problem::NoMissions)
    }
}

type OrderCall = (Missions, By, MissionId, IdempotencyKeyHeader, IfMatch);

/// Sends the command of the call `name` with that `body`, and answers with the mission after it.
async fn send(
    (missions, by, MissionId(id), key, if_match): OrderCall,
    name: &str,
    body: &impl Serialize,
    command: Command,
) -> Result<Response, Problem> {
    let key = key.of(&by, name, body)?;
    let order = by.order(match command {
        Command::Change(..) => "change",
        _ => name,
    });
    let mission = missions.send(&id, command, key, if_match, Some(order));
    let body = with_orders(&missions, &id, mission.await).await?;
    let mission = serde_json::from_slice::<Mission>(&body).ok();
    let tag = mission.and_then(|mission| tag(&mission));
    Ok((tag.map(|tag| [(header::ETAG, tag)]), as_json(body)).into_response())
}

fn tag(mission: &Mission) -> Option<HeaderValue> {
    HeaderValue::from_str(&format!("\"{}\"", mission.revision)).ok()
}

/// The same result. If the mission has changed, it has the last orders of the mission.
async fn with_orders<T>(missions: &Missions, id: &str, result: Result<T, Problem>) -> Result<T, Problem> {
    let Err(Problem::Changed { revision, .. }) = result else {
        return result;
    };
    let mission = id.to_owned();
    let read = move |reader: &EventReader| reader.last_orders(&mission, ORDERS_TOLD);
    let since = missions.read(read).await?;
    Err(Problem::Changed { revision, since })
}

/// Creates a mission: of the simulator, or of real vehicles.
///
/// `metadata.bridge` names its craft, for tokens that are limited to craft.
#[utoipa::path(post, path = "/v1/missions", tag = "missions", request_body = NewMission,
    params(IdempotencyKeyHeader),
    responses((status = 201, description = "The mission was created; `run` starts it.", body = Mission), MissionRefusals))]
pub(crate) async fn create_mission(
    missions: Missions,
    by: By,
    key: IdempotencyKeyHeader,
    JsonBody(new): JsonBody<NewMission>,
) -> Result<Response, Problem> {
    if let Some(limit) = by.limit().filter(|limit| !limit.names_craft_of(&new.metadata)) {
        return Err(Problem::Limited(limit.clone()));
    }
    let key = key.of(&by, "create", &new)?;
    let mission = missions.create(new, key, by.order("create")).await?;
    let location = [(header::LOCATION, format!("/v1/missions/{}", mission.id))];
    Ok((StatusCode::CREATED, location, Json(mission)).into_response())
}

/// Lists missions in the order of their creation, within the limit of the caller's token.
#[utoipa::path(get, path = "/v1/missions", tag = "missions", params(PageQuery),
    responses((status = 200, description = "One page of missions, and where the next page begins.", body = MissionList), MissionRefusals))]
pub(crate) async fn list_missions(
    missions: Missions,
    by: By,
    ValidQuery(PageQuery { after, limit }): ValidQuery<PageQuery>,
) -> Result<Json<MissionList>, Problem> {
    let most = page_length(limit)?;
    missions.list(after, most, by.limit().cloned()).await.map(Json)
}

/// Lists orders with their callers and missions, in stored order, also of deleted missions.
#[utoipa::path(get, path = "/v1/audit", tag = "service", params(AuditQuery),
    responses((status = 200, description = "One page of orders, and where the next page begins.", body = OrderList), MissionRefusals))]
pub(crate) async fn list_orders(
    missions: Missions,
    ValidQuery(AuditQuery { mission, after, limit }): ValidQuery<AuditQuery>,
) -> Result<Json<OrderList>, Problem> {
    let most = page_length(limit)?;
    let read = move |reader: &EventReader| reader.orders(mission.as_deref(), after, most + 1);
    let mut orders = missions.read(read).await?;
    let more = most < orders.len();
    orders.truncate(most);
    Ok(Json(OrderList { next: orders.last().filter(|_| more).map(|order| order.number), orders }))
}

/// Returns a mission.
#[utoipa::path(get, path = "/v1/missions/{id}", tag = "missions", params(MissionId),
    responses((status = 200, description = "Its status and settings.", body = Mission), MissionRefusals))]
pub(crate) async fn get_mission(missions: Missions, MissionId(id): MissionId) -> Result<Response, Problem> {
    let mission = missions.find_with_plan(&id).await?;
    let tag = tag(&mission).map(|tag| [(header::ETAG, tag)]);
    Ok((tag, Json(mission)).into_response())
}

/// Returns a mission's scene for a map, beside the vehicles, and the knowledge of its controller.
#[utoipa::path(get, path = "/v1/missions/{id}/scene", tag = "missions", params(MissionId),
    responses((status = 200, description = "The mission as it was created, with its paths of now.", body = Scene), MissionRefusals))]
pub(crate) async fn get_scene(
    State(planners): State<Planners>,
    missions: Missions,
    MissionId(id): MissionId,
) -> Result<Json<Scene>, Problem> {
    let (number, mission) = missions.find(&id).await?;
    let created = missions.read(move |reader| with_paths_of_now(reader, number, &mission));
    let created = created.await?;
    // The scene of a simulated mission starts its scenario.
    let permit = planners.admit(Work::Reading, 0)?;
    planners.read(&permit, move |_| scene::scene(&created)).await.map(Json)
}

/// Changes the setting of a live mission, such as its goal, the paths of its AUVs or its datum,
/// before it starts or while it runs. The next plan uses the new setting.
///
/// Each given member replaces the whole member, unlike in a JSON merge patch (RFC 7396). Of
/// `paths`, each given path does: AUVs that are not named keep theirs. To wait for a plan with the
/// new setting, ask for `reference` with `?after=` and the `sequence` of this answer. A change
/// without effect stores no event. With `If-Match` and the mission's `ETag`, this call, `run`,
/// `pause`, `finish`, `step` and `DELETE` are refused with 412 if the mission has changed since.
#[utoipa::path(patch, path = "/v1/missions/{id}", tag = "missions", params(MissionId, IdempotencyKeyHeader),
    request_body(content((Setting = "application/merge-patch+json"), (Setting = "application/json"))),
    responses((status = 200, description = "The change is on the disk.", body = Mission), MissionRefusals))]
pub(crate) async fn patch_mission(
    State(planners): State<Planners>,
    call: OrderCall,
    body: BodyBytes,
) -> Result<Response, Problem> {
    let (missions, _, MissionId(id), ..) = &call;
    let origin = missions.handle(id).await?.view.borrow().mission.origin;
    let bytes = body.bytes.len();
    let read = move || {
        // For the key: equal for equal requests, wherever the origin is by now.
        let posted = serde_json::to_value(Body::parse(&body.bytes).ok()).unwrap_or_default();
        wire::read_from::<Setting>(&body.bytes, origin).map(|setting| (setting, posted))
    };
    let read = planners.read_body_for_mission(Priority::Mission, bytes, read);
    let (setting, posted) = read.await??;
    check::patch(&setting).map_err(Problem::Invalid)?;
    send(call, "patch", &posted, Command::Change(Box::new(setting), origin)).await
}

/// Ends a mission and deletes it with its events.
#[utoipa::path(delete, path = "/v1/missions/{id}", tag = "missions", params(MissionId),
    responses((status = 204, description = "The mission is deleted."), MissionRefusals))]
pub(crate) async fn delete_mission(
    missions: Missions,
    by: By,
    MissionId(id): MissionId,
    if_match: IfMatch,
) -> Result<StatusCode, Problem> {
    let deleted = missions.delete(&id, &if_match, by.order("delete")).await;
    with_orders(&missions, &id, deleted).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Starts a mission, or resumes it.
#[utoipa::path(post, path = "/v1/missions/{id}/run", tag = "missions", params(MissionId, IdempotencyKeyHeader),
    request_body = Option<Run>, responses((status = 200, description = "The mission is running.", body = Mission), MissionRefusals))]
pub(crate) async fn run_mission(
    call: OrderCall,
    OptionalJsonBody(run): OptionalJsonBody<Run>,
) -> Result<Response, Problem> {
    check::speed_factor(run.speed_factor).map_err(Problem::Invalid)?;
    send(call, "run", &run, Command::Run(run.speed_factor)).await
}

/// Pauses a mission: it makes no plans, and still accepts reports.
#[utoipa::path(post, path = "/v1/missions/{id}/pause", tag = "missions", params(MissionId, IdempotencyKeyHeader),
    responses((status = 200, description = "The mission is paused.", body = Mission), MissionRefusals))]
pub(crate) async fn pause_mission(call: OrderCall) -> Result<Response, Problem> {
    send(call, "pause", &(), Command::Pause).await
}

/// Ends a mission. Its events are kept.
#[utoipa::path(post, path = "/v1/missions/{id}/finish", tag = "missions", params(MissionId, IdempotencyKeyHeader),
    responses((status = 200, description = "The mission is finished.", body = Mission), MissionRefusals))]
pub(crate) async fn finish_mission(call: OrderCall) -> Result<Response, Problem> {
    send(call, "finish", &(), Command::Finish).await
}

/// Advances a simulated mission by a number of plans.
#[utoipa::path(post, path = "/v1/missions/{id}/step", tag = "missions", params(MissionId, IdempotencyKeyHeader),
    request_body = Option<Step>, responses((status = 200, description = "The plans are made.", body = Mission), MissionRefusals))]
pub(crate) async fn step_mission(
    call: OrderCall,
    OptionalJsonBody(step): OptionalJsonBody<Step>,
) -> Result<Response, Problem> {
    check::ticks(step.ticks).map_err(Problem::Invalid)?;
    send(call, "step", &step, Command::Step(step.ticks)).await
}

/// The acceptable reports of a body for a mission with that `origin`, in metres and degrees, and
/// the faults of the others. Without an origin, the first accepted position on Earth becomes it.
fn read_reports(
    body: Body<'_>,
    (live, mission): (&LiveMission, &Mission),
    origin: Option<Origin>,
    clock: &Clock,
) -> Result<Reports, Problem> {
    let now = live.clock.now(clock);
    let faults = |one: &Reports| check::report(&live.config, one, now);
    let (mut reports, rejected) = wire::read_reports(body, origin, faults)?;
    check::received(reports.received_s, now).map_err(Problem::Invalid)?;
    if let Some((code, detail)) = check::craft(mission, reports.craft.as_deref())
        && (reports.craft.is_some() || reports.are_of_a_craft())
    {
        return Err(Problem::Invalid(vec![FieldError::new("/craft", code, detail)]));
    }
    if reports.is_empty() && !rejected.is_empty() {
        return Err(Problem::Invalid(rejected.concat()));
    }
    if let Some(origin) = origin.or(reports.origin) {
        reports.complete(origin);
    }
    let first = |faults: Vec<FieldError>| faults.into_iter().next();
    reports.rejected = rejected.into_iter().filter_map(first).collect();
    Ok(reports)
}

/// Adds reports to a live mission. The answer comes when the accepted ones are on the disk.
///
/// `rejected` names the others. If all are rejected, or the body has another shape, the answer is
/// 422, and nothing is stored.
#[utoipa::path(post, path = "/v1/missions/{id}/reports", tag = "missions",
    params(MissionId, IdempotencyKeyHeader),
    request_body = Reports,
    responses((status = 200, description = "The reports that are not `rejected` are on the disk.", body = Accepted), MissionRefusals))]
pub(crate) async fn post_reports(
    State(planners): State<Planners>,
    missions: Missions,
    by: By,
    MissionId(id): MissionId,
    key: IdempotencyKeyHeader,
    body: BodyBytes,
) -> Result<Response, Problem> {
    // Looked up first: bodies of existing missions only are read at a mission's priority.
    let handle = missions.handle(&id).await?;
    let live = handle.live.ok_or_else(|| Problem::conflict(NO_REPORTS))?;
    let mission = Arc::clone(&handle.view.borrow().mission);
    let origin = mission.origin;
    let bytes = body.bytes.len();
    let clock = missions.clock().clone();
    let limit = by.limit().filter(|limit| !limit.commands(&mission)).cloned();
    let read = move || {
        let posted = Body::parse(&body.bytes);
        // Equal for equal requests, even if fewer reports are acceptable by now.
        let key = key.of(&by, "reports", &posted.as_ref().ok())?;
        let reports = posted.map_err(Problem::from);
        let reports = reports.and_then(|posted| read_reports(posted, (&live, &mission), origin, &clock));
        Ok::<_, Problem>((reports, key))
    };
    let read = planners.read_body_for_mission(Priority::Mission, bytes, read);
    let (reports, key) = read.await??;
    if let (Some(limit), Ok(reports)) = (limit, &reports)
        && !reports.craft.as_ref().is_some_and(|craft| limit.names_craft(craft))
    {
        return Err(Problem::Limited(limit));
    }
    Ok(as_json(missions.report(&id, reports, origin, key).await?))
}

/// Returns the current reference, its age, and its method.
#[utoipa::path(get, path = "/v1/missions/{id}/reference", tag = "missions", params(MissionId, ReferenceQuery),
    responses((status = 200, description = "The newest reference.", body = CurrentReference), MissionRefusals))]
pub(crate) async fn get_reference(
    missions: Missions,
    MissionId(id): MissionId,
    ValidQuery(ReferenceQuery { craft, wait_s, after }): ValidQuery<ReferenceQuery>,
) -> Result<Json<CurrentReference>, Problem> {
    if !(0.0..=WAIT_MAX).contains(&wait_s) {
        return Err(out_of_range("wait_s", wait_s, 0, WAIT_MAX));
    }
    // The rest of the handle is dropped at once: its way to the actor would keep that from
    // stopping.
    let Handle { mut view, mut live, .. } = missions.handle(&id).await?;
    if let Some((code, detail)) = check::craft(&view.borrow().mission, craft.as_deref()) {
        return Err(wrong_parameter("craft", code, detail));
    }
    if 0.0 < wait_s {
        let newest = |view: &View| view.plan(craft.as_deref()).map_or(0, |plan| plan.sequence);
        let after = after.unwrap_or_else(|| newest(&view.borrow()));
        let end = missions.clock().now() + Duration::from_secs_f64(wait_s);
        // After a newer plan, the time limit or the mission's end, the newest plan is the answer.
        let newer = view.wait_for(|view| after < newest(view) || view.mission.status.is_over());
        let _ = missions.clock().timeout_at(end, newer).await.map(drop);
        if missions.are_shared() && !view.borrow().mission.status.is_over() {
            // Another service may have the mission by now.
            Handle { view, live, .. } = missions.handle(&id).await?;
        }
    }
    let view = view.borrow().clone();
    let Some(plan) = view.plan(craft.as_deref()).cloned() else {
        let own = craft.filter(|_| view.waits_for.is_empty());
        return Err(Problem::NoPlanYet(view.waits_for.into_iter().chain(own).collect()));
    };
    Ok(Json(CurrentReference {
        mission: id,
        craft,
        status: view.mission.status,
        sequence: plan.sequence,
        t_s: plan.time,
        late_s: plan.late,
        age_s: plan.age(live.as_deref(), view.mission.t_s, missions.clock()),
        outcome: plan.answer.answer.outcome,
        method: plan.answer.answer.method,
        heard_s: plan.heard.clone(),
        waits_for: view.waits_for,
        slots: view.slots,
        missed: view.missed,
        plan: plan.answer.answer.clone(),
    }))
}

/// Streams a mission's events as they happen: server-sent events, whose `id` is their number.
///
/// After a break, `Last-Event-ID` resumes after the reader's last event. A slow reader gets a `gap`
/// with the numbers `from` and `to` of missed events, and then the newest event. Comments between
/// events keep the connection alive.
#[utoipa::path(get, path = "/v1/missions/{id}/events", tag = "missions", params(MissionId, LastEventId, EventsQuery),
    responses((status = 200, description = "Events until the mission is over.", content_type = "text/event-stream",
            body = super::event::Event),
        (status = 204, description = "The mission is over, and no more events follow."), MissionRefusals))]
pub(crate) async fn stream_events(
    missions: Missions,
    by: By,
    MissionId(id): MissionId,
    ValidQuery(EventsQuery { after }): ValidQuery<EventsQuery>,
    LastEventId(last): LastEventId,
) -> Result<Response, Problem> {
    stream::events(missions, &by, &id, last.or(after)).await
}

/// Exports all or some events of a mission as a file for other programs, of any length.
#[utoipa::path(
    get,
    path = "/v1/missions/{id}/record",
    tag = "missions",
    params(MissionId, RecordQuery),
    responses(Record, MissionRefusals)
)]
pub(crate) async fn get_record(
    missions: Missions,
    by: By,
    MissionId(id): MissionId,
    ValidQuery(RecordQuery { format, after, max_events, kinds }): ValidQuery<RecordQuery>,
) -> Result<Response, Problem> {
    let format = format.ok_or_else(|| wrong_parameter("format", "missing", "name a format"))?;
    let filter = EventFilter { after, limit: max_events, kinds: kinds_of(kinds.as_deref())? };
    stream::record(missions, &by, &id, format, filter).await
}

fn as_json(body: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], body).into_response()
}

struct Record;

impl IntoResponses for Record {
    fn responses() -> BTreeMap<String, RefOr<openapi::Response>> {
        let mut response = ResponseBuilder::new().description("The record, as a file.");
        for format in RecordFormat::ALL {
            let essence = format.media_type().split(';').next().unwrap_or_default();
            let schema = match format {
                RecordFormat::Geojson => Object::with_type(Type::Object),
                RecordFormat::Ndjson | RecordFormat::EventsNdjson | RecordFormat::Csv => {
                    Object::with_type(Type::String)
                }
                RecordFormat::Parquet | RecordFormat::Mcap => {
                    let binary = SchemaFormat::KnownFormat(KnownFormat::Binary);
                    Object::builder().schema_type(Type::String).format(Some(binary)).build()
                }
            };
            response = response.content(essence, ContentBuilder::new().schema(Some(schema)).build());
        }
        [("200".to_owned(), RefOr::T(response.build()))].into()
    }
}
