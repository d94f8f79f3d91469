//! The calls that missions answer.

use std::{
    collections::{BTreeMap, HashSet},
    convert::Infallible,
    time::Duration,
};

use axum::{
    Json,
    extract::{FromRef, FromRequestParts, Path, State},
    http::{HeaderValue, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};
use tokio::time::{Instant, timeout_at};
use utoipa::{
    IntoParams, IntoResponses,
    openapi::{self, ContentBuilder, KnownFormat, Object, RefOr, ResponseBuilder, SchemaFormat, Type},
};

use super::{
    actor::{Command, Handle, IdempotencyKey, View},
    check,
    event::{self, Event, json},
    record::{Part, RecordFormat},
    registry::Missions,
    scene, stream,
};
use crate::{
    access::By,
    planners::Planners,
    pool::Lane,
    posted::{Posted, PostedBytes, PostedOrNothing, SHORT},
    problem::{MissionRefusals, Problem},
    store::{EventReader, StoredOrder},
};
use wire::mission::{
    Accepted, CurrentReference, Mission, MissionList, NewMission, Order, OrderList, Reports, Run, Scene,
    Setting, Step,
};
use wire::{FieldError, Origin};

/// Missions in one answer.
const LIST_MAX: usize = 1_000;
const LIST_DEFAULT: usize = 100;
/// Longest wait for a plan, s.
const WAIT_MAX: f64 = 60.0;
/// Longest `Idempotency-Key`, bytes.
const KEY_BYTES_MAX: usize = 200;

/// What stands behind the `?`; whatever is wrong with it is a [`Problem`].
pub(crate) struct Asked<T>(pub(crate) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Asked<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let query = parts.uri.query().unwrap_or_default().as_bytes();
        let mut names = HashSet::new();
        for (name, _) in form_urlencoded::parse(query) {
            if let Some(twice) = names.replace(name) {
                return Err(wrong_parameter(&twice, "duplicate_field", "is given twice"));
            }
        }
        let pairs = serde_urlencoded::Deserializer::new(form_urlencoded::parse(query));
        serde_path_to_error::deserialize(pairs)
            .map(Self)
            .map_err(|error| {
                let name = error.path().to_string();
                wrong_parameter(&name, "query", error.into_inner().to_string())
            })
    }
}

fn wrong_parameter(name: &str, code: &str, detail: impl Into<String>) -> Problem {
    Problem::Invalid(vec![FieldError::of_parameter(name, code, detail)])
}

/// The mission of a path.
#[derive(IntoParams)]
#[into_params(names("id"), parameter_in = Path)]
pub(crate) struct Named(
    /// The mission's `id`.
    String,
);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let named = Path::from_request_parts(parts, state).await;
        named.map(|Path(id)| Self(id)).map_err(|_| Problem::NoMission)
    }
}

/// The `Idempotency-Key` header.
#[derive(IntoParams)]
#[into_params(names("Idempotency-Key"), parameter_in = Header)]
pub(crate) struct IdempotencyKeyHeader(
    /// The client's name for this request, visible ASCII: a request that is sent again with its key is carried out once,
    /// and gets the same answer.
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
    /// The key of a `call` that asks for `asked`.
    pub(crate) fn of<T: Serialize>(
        self,
        by: &By,
        call: &str,
        asked: &T,
    ) -> Result<Option<IdempotencyKey>, Problem> {
        let Some(given) = self.0 else {
            return Ok(None);
        };
        let key = given.to_str().unwrap_or_default();
        if !(1..=KEY_BYTES_MAX).contains(&key.len()) {
            let detail = format!("this header must be 1 to {KEY_BYTES_MAX} visible ASCII characters");
            return Err(wrong_parameter("Idempotency-Key", "idempotency_key", detail));
        }
        let mut request = Sha256::new();
        request.update(call);
        request.update([0]);
        request.update(json(asked));
        Ok(Some(IdempotencyKey {
            key: by.own(key),
            request: request.finalize().into(),
        }))
    }
}

/// The `Last-Event-ID` header.
#[derive(IntoParams)]
#[into_params(names("Last-Event-ID"), parameter_in = Header)]
pub(crate) struct LastEventId(
    /// Number of the last event that the reader has: the stream goes on after it.
    pub(crate) Option<u64>,
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

impl<S: Send + Sync> FromRequestParts<S> for Missions
where
    Option<Missions>: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(_: &mut Parts, state: &S) -> Result<Self, Problem> {
        Option::from_ref(state).ok_or(Problem::NoMissions)
    }
}

/// What each parameter that has limits may be, in the words of JSON Schema.
pub(crate) fn parameter_limits() -> [(&'static str, Map<String, Value>); 4] {
    let kind = Event::KINDS.join("|");
    let limits = [
        (
            "limit",
            json!({ "minimum": 1, "maximum": LIST_MAX, "default": LIST_DEFAULT }),
        ),
        (
            "wait_s",
            json!({ "minimum": 0, "maximum": WAIT_MAX, "default": 0 }),
        ),
        (
            "Idempotency-Key",
            json!({ "minLength": 1, "maxLength": KEY_BYTES_MAX, "pattern": "^[!-~]([\\t -~]*[!-~])?$" }),
        ),
        ("kinds", json!({ "pattern": format!("^({kind})(,({kind}))*$") })),
    ];
    limits.map(|(name, limits)| (name, limits.as_object().cloned().unwrap_or_default()))
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct Page {
    /// `next` of the answer before. Default: from the first one on.
    #[serde(default)]
    pub(crate) after: u64,
    /// How many at most, from 1 to 1000. Default: 100.
    pub(crate) limit: Option<usize>,
}

/// How many are listed at once, where so many are asked for.
pub(crate) fn page_length(limit: Option<usize>) -> Result<usize, Problem> {
    let most = limit.unwrap_or(LIST_DEFAULT);
    if !(1..=LIST_MAX).contains(&most) {
        let error =
            FieldError::of_parameter("limit", "out_of_range", format!("must be from 1 to {LIST_MAX}"));
        let error = error.given(most).limit(json!({ "least": 1, "most": LIST_MAX }));
        return Err(Problem::Invalid(vec![error]));
    }
    Ok(most)
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct OrdersPage {
    /// Of which mission. Default: of all.
    mission: Option<String>,
    /// `next` of the answer before. Default: from the first one on.
    #[serde(default)]
    after: u64,
    /// How many at most, from 1 to 1000. Default: 100.
    limit: Option<usize>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wait {
    /// How long to wait for a newer plan, s, at most 60. Default: not at all.
    #[serde(default)]
    wait_s: f64,
    /// Number of the event that stored the plan to wait for a newer one than. Default: that of the one there is.
    after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct After {
    /// Number of the event before the first one wanted; a `Last-Event-ID` header goes before it. Default: the last one
    /// there is.
    after: Option<u64>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct In {
    /// Which format.
    #[param(inline, required, value_type = RecordFormat)]
    format: Option<RecordFormat>,
    /// Number of the event before the first one wanted. Default: from the first one on.
    #[serde(default)]
    after: u64,
    /// How many events at most. Default: all.
    max_events: Option<u64>,
    /// Kinds of events that are wanted, with commas between them, such as `planned,changed`. Default: every kind.
    #[param(example = "planned")]
    kinds: Option<String>,
}

/// The kinds of events as a query gives them.
fn kinds_of(query: Option<&str>) -> Result<Vec<String>, Problem> {
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

/// A record, by the format that was asked for.
struct Record;

impl IntoResponses for Record {
    fn responses() -> BTreeMap<String, RefOr<openapi::Response>> {
        let mut response = ResponseBuilder::new().description("The record, to be saved as a file.");
        for format in RecordFormat::ALL {
            let essence = format.media_type().split(';').next().unwrap_or_default();
            let schema = match format {
                RecordFormat::Geojson => Object::with_type(Type::Object),
                RecordFormat::Ndjson | RecordFormat::EventsNdjson | RecordFormat::Csv => {
                    Object::with_type(Type::String)
                }
                RecordFormat::Parquet | RecordFormat::Mcap => binary(),
            };
            response = response.content(essence, ContentBuilder::new().schema(Some(schema)).build());
        }
        [("200".to_owned(), RefOr::T(response.build()))].into()
    }
}

pub(crate) fn binary() -> Object {
    let binary = SchemaFormat::KnownFormat(KnownFormat::Binary);
    Object::builder()
        .schema_type(Type::String)
        .format(Some(binary))
        .build()
}

/// Makes a mission: of the simulator, or of real vehicles.
#[utoipa::path(post, path = "/v1/missions", tag = "missions", request_body = NewMission,
    params(IdempotencyKeyHeader),
    responses((status = 201, description = "It was made; `run` begins it.", body = Mission), MissionRefusals))]
pub(crate) async fn create_mission(
    missions: Missions,
    by: By,
    key: IdempotencyKeyHeader,
    Posted(new): Posted<NewMission>,
) -> Result<Response, Problem> {
    let key = key.of(&by, "create", &new)?;
    let mission = missions.create(new, key, by.order("create")).await?;
    let location = [(header::LOCATION, format!("/v1/missions/{}", mission.id))];
    Ok((StatusCode::CREATED, location, Json(mission)).into_response())
}

/// Lists missions in the order in which they were made.
#[utoipa::path(get, path = "/v1/missions", tag = "missions", params(Page),
    responses((status = 200, description = "Some of them, and where the next ones begin.", body = MissionList), MissionRefusals))]
pub(crate) async fn list_missions(
    missions: Missions,
    Asked(Page { after, limit }): Asked<Page>,
) -> Result<Json<MissionList>, Problem> {
    let most = page_length(limit)?;
    let mut listed = missions.list(after, most + 1).await?;
    let more = most < listed.len();
    listed.truncate(most);
    for (_, mission) in &mut listed {
        mission.plan = missions.last_plan(&mission.id);
    }
    Ok(Json(MissionList {
        next: if more {
            listed.last().map(|(number, _)| *number)
        } else {
            None
        },
        missions: listed.into_iter().map(|(_, mission)| mission).collect(),
    }))
}

/// Lists who ordered what of which mission, deleted ones included, in the order in which it was stored.
#[utoipa::path(get, path = "/v1/audit", tag = "service", params(OrdersPage),
    responses((status = 200, description = "Some orders, and where the next ones begin.", body = OrderList), MissionRefusals))]
pub(crate) async fn list_orders(
    missions: Missions,
    Asked(OrdersPage {
        mission,
        after,
        limit,
    }): Asked<OrdersPage>,
) -> Result<Json<OrderList>, Problem> {
    let most = page_length(limit)?;
    let read = move |reader: &EventReader| reader.orders(mission.as_deref(), after, most + 1);
    let mut stored = missions.read(read).await?;
    let more = most < stored.len();
    stored.truncate(most);
    let orders = stored.into_iter().map(
        |StoredOrder {
             number,
             mission,
             order,
         }| Order {
            number,
            at_s: order.at_s,
            caller: order.caller,
            request_id: order.request,
            mission,
            action: order.action,
        },
    );
    let orders: Vec<_> = orders.collect();
    Ok(Json(OrderList {
        next: orders.last().filter(|_| more).map(|order| order.number),
        orders,
    }))
}

/// A mission.
#[utoipa::path(get, path = "/v1/missions/{id}", tag = "missions", params(Named),
    responses((status = 200, description = "Where it is.", body = Mission), MissionRefusals))]
pub(crate) async fn get_mission(missions: Missions, Named(id): Named) -> Result<Json<Mission>, Problem> {
    let (_, mut mission) = missions.find(&id).await?;
    mission.plan = missions.last_plan(&id);
    Ok(Json(mission))
}

/// What a map of a mission shows beside vehicles, and what its controller is told.
#[utoipa::path(get, path = "/v1/missions/{id}/scene", tag = "missions", params(Named),
    responses((status = 200, description = "As the mission was made.", body = Scene), MissionRefusals))]
pub(crate) async fn get_scene(
    State(planners): State<Planners>,
    missions: Missions,
    Named(id): Named,
) -> Result<Json<Scene>, Problem> {
    let (number, mission) = missions.find(&id).await?;
    let made_as = missions
        .read(move |reader| event::created(reader, number))
        .await?;
    // A simulated one starts its scenario for that.
    let made = planners
        .read_for_mission(Lane::Long, move || scene::scene(&made_as))
        .await?;
    Ok(Json(Scene {
        origin: mission.origin.or(made.origin),
        ..made
    }))
}

/// Changes what a live mission does, before or while it runs: the next plan is made by it.
///
/// Members are replaced as a whole and not merged, unlike those inside a JSON merge patch (RFC 7396). Of `reference`,
/// `?after=` with the `sequence` of the answer waits for a plan made by the new setting. What is so already is no event.
#[utoipa::path(patch, path = "/v1/missions/{id}", tag = "missions", params(Named, IdempotencyKeyHeader),
    request_body(content((Setting = "application/merge-patch+json"), (Setting = "application/json"))),
    responses((status = 200, description = "It is on the disk.", body = Mission), MissionRefusals))]
pub(crate) async fn patch_mission(
    State(planners): State<Planners>,
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
    body: PostedBytes,
) -> Result<Response, Problem> {
    let is_short = body.bytes.len() <= SHORT;
    let origin = missions.handle(&id).await?.view.borrow().mission.origin;
    let read = move || wire::read_from::<Setting>(&body.bytes, origin);
    let setting = if is_short {
        read()?
    } else {
        planners.read_for_mission(Lane::Mission, read).await??
    };
    check::patch(&setting).map_err(Problem::Invalid)?;
    let key = key.of(&by, "patch", &setting)?;
    let change = Command::Change(Box::new(setting));
    Ok(as_json(
        missions.send(&id, change, key, Some(by.order("change"))).await?,
    ))
}

/// Ends a mission and forgets it, its log too.
#[utoipa::path(delete, path = "/v1/missions/{id}", tag = "missions", params(Named),
    responses((status = 204, description = "It is gone."), MissionRefusals))]
pub(crate) async fn delete_mission(
    missions: Missions,
    by: By,
    Named(id): Named,
) -> Result<StatusCode, Problem> {
    missions.delete(&id, by.order("delete")).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Begins a mission, or goes on with it.
#[utoipa::path(post, path = "/v1/missions/{id}/run", tag = "missions", params(Named, IdempotencyKeyHeader),
    request_body = Option<Run>, responses((status = 200, description = "It runs.", body = Mission), MissionRefusals))]
pub(crate) async fn run_mission(
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
    PostedOrNothing(run): PostedOrNothing<Run>,
) -> Result<Response, Problem> {
    check::speed_factor(run.speed_factor).map_err(Problem::Invalid)?;
    let key = key.of(&by, "run", &run)?;
    Ok(as_json(
        missions
            .send(&id, Command::Run(run.speed_factor), key, Some(by.order("run")))
            .await?,
    ))
}

/// Holds a mission: no plans are made, reports are taken up.
#[utoipa::path(post, path = "/v1/missions/{id}/pause", tag = "missions", params(Named, IdempotencyKeyHeader),
    responses((status = 200, description = "It is held.", body = Mission), MissionRefusals))]
pub(crate) async fn pause_mission(
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
) -> Result<Response, Problem> {
    let key = key.of(&by, "pause", &())?;
    Ok(as_json(
        missions
            .send(&id, Command::Pause, key, Some(by.order("pause")))
            .await?,
    ))
}

/// Ends a mission. Its events are kept.
#[utoipa::path(post, path = "/v1/missions/{id}/finish", tag = "missions", params(Named, IdempotencyKeyHeader),
    responses((status = 200, description = "It is over.", body = Mission), MissionRefusals))]
pub(crate) async fn finish_mission(
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
) -> Result<Response, Problem> {
    let key = key.of(&by, "finish", &())?;
    Ok(as_json(
        missions
            .send(&id, Command::Finish, key, Some(by.order("finish")))
            .await?,
    ))
}

/// Goes on with a simulated mission for some plans.
#[utoipa::path(post, path = "/v1/missions/{id}/step", tag = "missions", params(Named, IdempotencyKeyHeader),
    request_body = Option<Step>, responses((status = 200, description = "It went on.", body = Mission), MissionRefusals))]
pub(crate) async fn step_mission(
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
    PostedOrNothing(step): PostedOrNothing<Step>,
) -> Result<Response, Problem> {
    check::ticks(step.ticks).map_err(Problem::Invalid)?;
    let key = key.of(&by, "step", &step)?;
    Ok(as_json(
        missions
            .send(&id, Command::Step(step.ticks), key, Some(by.order("step")))
            .await?,
    ))
}

/// Reports with their positions in metres from `origin`, or from the first of them in latitude and longitude.
fn read_reports(body: &PostedBytes, origin: Option<Origin>) -> Result<Reports, Problem> {
    let (mut heard, counted_from) = wire::read_reports::<Reports>(&body.bytes, origin)?;
    if heard.origin.is_some() {
        let detail = "the service writes it, from the mission or from the first fix";
        return Err(Problem::Invalid(vec![FieldError::new(
            "/origin",
            "unexpected",
            detail,
        )]));
    }
    heard.origin = counted_from.filter(|_| origin.is_none());
    if heard.origin.is_some() && !heard.is_complete() {
        let detail = "the first position in latitude and longitude becomes the mission's origin: give all of this post so";
        return Err(Problem::Invalid(vec![FieldError::new("", "mixed", detail)]));
    }
    Ok(heard)
}

/// Takes up what was heard in a live mission. The answer comes when it is on the disk.
#[utoipa::path(post, path = "/v1/missions/{id}/reports", tag = "missions",
    params(Named, IdempotencyKeyHeader),
    request_body = Reports,
    responses((status = 200, description = "It is on the disk.", body = Accepted), MissionRefusals))]
pub(crate) async fn post_reports(
    State(planners): State<Planners>,
    missions: Missions,
    by: By,
    Named(id): Named,
    key: IdempotencyKeyHeader,
    body: PostedBytes,
) -> Result<Response, Problem> {
    // A client without a mission does not use a mission's right of way.
    let handle = missions.handle(&id).await?;
    let origin = handle.view.borrow().mission.origin;
    let heard = if body.bytes.len() <= SHORT {
        read_reports(&body, origin)?
    } else {
        let read = move || read_reports(&body, origin);
        planners.read_for_mission(Lane::Mission, read).await??
    };
    let key = key.of(&by, "reports", &heard.as_posted())?;
    Ok(as_json(missions.report(&id, heard, key).await?))
}

/// The reference that counts now, its age, and how it was come by.
#[utoipa::path(get, path = "/v1/missions/{id}/reference", tag = "missions", params(Named, Wait),
    responses((status = 200, description = "The newest there is.", body = CurrentReference), MissionRefusals))]
pub(crate) async fn get_reference(
    missions: Missions,
    Named(id): Named,
    Asked(Wait { wait_s, after }): Asked<Wait>,
) -> Result<Json<CurrentReference>, Problem> {
    if !(0.0..=WAIT_MAX).contains(&wait_s) {
        let error =
            FieldError::of_parameter("wait_s", "out_of_range", format!("must be from 0 to {WAIT_MAX}"));
        let error = error.given(wait_s).limit(json!({ "least": 0, "most": WAIT_MAX }));
        return Err(Problem::Invalid(vec![error]));
    }
    let Handle { mut view, live, .. } = missions.handle(&id).await?;
    if 0.0 < wait_s {
        let newest = |view: &View| view.plan.as_ref().map_or(0, |plan| plan.sequence);
        let after = after.unwrap_or_else(|| newest(&view.borrow()));
        let end = Instant::now() + Duration::from_secs_f64(wait_s);
        // Whether one came, the time was over or the mission ended: what there is then is the answer.
        let newer = view.wait_for(|view| after < newest(view) || view.mission.status.is_over());
        let _ = timeout_at(end, newer).await.map(drop);
    }
    let view = view.borrow().clone();
    let Some(plan) = view.plan else {
        return Err(Problem::NoPlanYet(view.waits_for));
    };
    let age_s = match live {
        Some(live) => plan.age(&live.clock),
        None => view.mission.t_s - plan.time,
    };
    Ok(Json(CurrentReference {
        mission: id,
        status: view.mission.status,
        sequence: plan.sequence,
        t_s: plan.time,
        late_s: plan.late,
        age_s,
        outcome: plan.answer.answer.outcome,
        method: plan.answer.answer.method,
        heard_s: plan.heard.clone(),
        waits_for: view.waits_for,
        missed: view.missed,
        plan: plan.answer.answer.clone(),
    }))
}

/// What happens, as it happens: server-sent events, whose `id` is the event's number in the mission.
///
/// After a break, `Last-Event-ID` resumes where the reader was. Who reads too slowly gets a `gap` with the numbers
/// `from` and `to` of the events that it missed, and then the newest. Comments in between say that the stream lives.
#[utoipa::path(get, path = "/v1/missions/{id}/events", tag = "missions", params(Named, LastEventId, After),
    responses((status = 200, description = "Until the mission is over.", content_type = "text/event-stream",
            body = super::event::Event),
        (status = 204, description = "The mission is over, and there is nothing more to come."), MissionRefusals))]
pub(crate) async fn stream_events(
    missions: Missions,
    by: By,
    Named(id): Named,
    Asked(After { after }): Asked<After>,
    LastEventId(last): LastEventId,
) -> Result<Response, Problem> {
    stream::events(missions, &by, &id, last.or(after)).await
}

/// The events of a mission, all or some, in a format for other programs, streamed at any length.
#[utoipa::path(
    get,
    path = "/v1/missions/{id}/record",
    tag = "missions",
    params(Named, In),
    responses(Record, MissionRefusals)
)]
pub(crate) async fn get_record(
    missions: Missions,
    by: By,
    Named(id): Named,
    Asked(In {
        format,
        after,
        max_events,
        kinds,
    }): Asked<In>,
) -> Result<Response, Problem> {
    let format = format.ok_or_else(|| wrong_parameter("format", "missing", "say which"))?;
    let part = Part {
        after,
        limit: max_events,
        kinds: kinds_of(kinds.as_deref())?,
    };
    stream::record(missions, &by, &id, format, part).await
}

fn as_json(body: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], body).into_response()
}
