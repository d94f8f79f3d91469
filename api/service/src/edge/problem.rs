//! Problems of requests, as RFC 9457 problem documents.
//!
//! Only this module chooses status codes. Handlers return a [`Problem`]; the middleware, which
//! knows the request's path and id, writes the document.

use std::{collections::BTreeMap, time::Duration};

use axum::{
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use utoipa::{
    IntoResponses, ToSchema,
    openapi::{ContentBuilder, Ref, RefOr, Response as Documented, ResponseBuilder},
};

use wire::{FieldError, mission::Order, shortened};

use store::StoreError;

use crate::{
    edge::role::{Role, TokenLimit},
    limits::{BODY_BYTES_MAX, FIELD_ERRORS_MAX},
};

/// Time after which to repeat a request to a busy service, s. Plans take milliseconds: a full queue
/// is no longer full a second later.
const RETRY_AFTER: HeaderValue = HeaderValue::from_static("1");

/// The reason of a refusal, with its remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// The body is not JSON.
    #[error("{}", located(.0))]
    Syntax(Box<FieldError>),
    /// The body is JSON but not a valid request.
    #[error("{}", first_of(.0))]
    Invalid(Vec<FieldError>),
    /// The content type is not JSON, or missing.
    #[error("send content-type: application/json{}", .0.as_ref().map(|given| format!(", not {given}")).unwrap_or_default())]
    NotJson(Option<String>),
    /// The content type names a character set other than UTF-8.
    #[error("send UTF-8, not {0}")]
    NotUtf8(String),
    /// The body has a content encoding.
    #[error("send the body without content-encoding, not as {0}")]
    Coded(String),
    /// The body is too long.
    #[error("at most {BODY_BYTES_MAX} bytes are accepted")]
    TooLarge,
    /// The body ended early.
    #[error("the connection ended before the body did")]
    BodyUnreadable,
    /// The body came in more pieces than this.
    #[error("send the body in at most {0} chunks")]
    InPieces(usize),
    /// The body took longer than this to arrive.
    #[error("the whole body must arrive within {0:?}")]
    BodyTimedOut(Duration),
    /// The request does not name exactly one valid host.
    #[error("send exactly one Host header, as HTTP/1.1 requires")]
    HostHeader,
    /// The request is for another host, with this name.
    #[error("{0} is not a name of this service: call it by its address, or start it with --allow-host {0}")]
    UnknownHost(String),
    /// A page of another site sent the request.
    #[error("call it from its own page, or without a browser")]
    CrossSite,
    /// The request has no valid token.
    #[error("send Authorization: Bearer and a valid token; pilotfish token add creates one")]
    Unauthenticated,
    /// The role of the token does not allow this call.
    #[error("the call needs the role {needed}, and the token has the role {role}")]
    Forbidden {
        /// The least role that the call needs.
        needed: Role,
        /// The token's role.
        role: Role,
    },
    /// The token is limited to other missions.
    #[error("the token is limited to {0}; a new mission has the name of its craft in metadata.bridge")]
    Limited(TokenLimit),
    /// The route does not exist.
    #[error("GET /openapi.json lists every route")]
    NoRoute,
    /// The example does not exist.
    #[error("GET /v1/examples lists them")]
    NoExample,
    /// The route does not have the method.
    #[error("the Allow header names the methods of this route")]
    MethodNotAllowed,
    /// Every planner is busy and the queue is full.
    #[error("the queue is full; try again after the time in Retry-After")]
    Overloaded,
    /// The plan took too long.
    #[error(
        "no program was solved by the deadline; try again after the time in Retry-After, or set \"fallback\":\"los\" to \
         accept a lower fallback level"
    )]
    TimedOut,
    /// The file was not read within this time.
    #[error(
        "the file was not read within the service's deadline, {0:?}; make it shorter, or try again after the time in Retry-After"
    )]
    FileTimedOut(Duration),
    /// No program was solved, for this reason, and the client accepts nothing else.
    #[error("{0}; with \"fallback\":\"los\" a lower fallback level would have answered")]
    NoSolution(String),
    /// The service cannot plan, for this reason.
    #[error("{0}")]
    NotReady(String),
    /// The mission does not exist.
    #[error("GET /v1/missions lists them")]
    NoMission,
    /// The mission's state does not allow the command, for this reason.
    #[error("{0}")]
    Conflict(String),
    /// The mission is no longer as the caller saw it.
    #[error("{}", changed(*revision, since))]
    Changed {
        /// Its revision now.
        revision: u64,
        /// The last orders of the mission, the newest first.
        since: Vec<Order>,
    },
    /// There is no plan yet. Reports of these vehicles are missing.
    #[error("{}", no_plan_yet(.0))]
    NoPlanYet(Vec<String>),
    /// The idempotency key belongs to another request.
    #[error("choose a new key for each new request; repeat a key only to repeat its request")]
    KeyTaken,
    /// The mission has too many requests waiting, or continues from the store.
    #[error(
        "too many requests wait for the mission, or it is changing its service; try again after the time in Retry-After"
    )]
    Behind,
    /// The service at this URL has the mission.
    #[error("another service has the mission; try again after the time in Retry-After")]
    Elsewhere(String),
    /// The mission has not answered in time.
    #[error(
        "the command may still be carried out: send it again with the same Idempotency-Key, or check the mission first"
    )]
    Unanswered,
    /// The service has reached a limit for all clients.
    #[error("the service accepts {limit} {what} at once; try again after the time in Retry-After")]
    Crowded {
        /// The limited things.
        what: &'static str,
        /// Greatest number of them.
        limit: usize,
    },
    /// The client has reached its share of a limit.
    #[error("one client may have {limit} {what}: end some, or try again after the time in Retry-After")]
    Share {
        /// The limited things.
        what: &'static str,
        /// Greatest number of them for one client.
        limit: usize,
    },
    /// The missions of one client fill that client's share of the disk.
    #[error(
        "the missions of the client that created this one fill that client's share of the disk: delete finished ones"
    )]
    DiskShare,
    /// The service was started without a data directory.
    #[error("start the service with --data DIRECTORY")]
    NoMissions,
    /// The mission log failed.
    #[error("{0}")]
    Log(StoreError),
    /// The service has a bug.
    #[error("the service logged the error; quote the request id")]
    Panicked,
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Gone => Self::NoMission,
            error => Self::Log(error),
        }
    }
}

/// A problem document, `application/problem+json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ProblemDocument {
    /// The kind of problem, as a URI.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind of problem, for people.
    pub title: String,
    /// The HTTP status code.
    pub status: u16,
    /// The fault and its remedy.
    pub detail: String,
    /// Path of the request.
    pub instance: String,
    /// The kind of problem, for programs.
    pub code: String,
    /// Id of the request. The `x-request-id` header and the service's log have it too.
    pub request_id: String,
    /// The invalid fields.
    pub errors: Vec<FieldError>,
}

impl Problem {
    pub(crate) fn conflict(why: &str) -> Self {
        Self::Conflict(why.to_owned())
    }

    /// The same problem, with pointers that begin at `place` of the body.
    pub(crate) fn within(mut self, place: &str) -> Self {
        if let Self::Invalid(errors) = &mut self {
            for error in errors {
                error.pointer.insert_str(0, place);
            }
        }
        self
    }

    /// Status, code and title.
    fn kind(&self) -> (u16, &'static str, &'static str) {
        match self {
            Self::Syntax(_) => (400, "syntax", "The body is not JSON"),
            Self::BodyUnreadable => (400, "body_unreadable", "The body ended early"),
            Self::InPieces(_) => (400, "body_in_pieces", "The body has too many chunks"),
            Self::HostHeader => (400, "host_header", "The request does not name one host"),
            Self::Unauthenticated => (401, "unauthenticated", "The service requires a token"),
            Self::Forbidden { .. } => (403, "forbidden", "The token does not allow this call"),
            Self::Limited(_) => (403, "mission_forbidden", "The token is limited to other missions"),
            Self::CrossSite => (403, "cross_site", "Pages of other sites may not call the service"),
            Self::NoRoute => (404, "no_route", "There is no such route"),
            Self::NoExample => (404, "no_example", "There is no such example"),
            Self::NoMission => (404, "no_mission", "There is no such mission"),
            Self::MethodNotAllowed => (405, "method_not_allowed", "The method is not allowed"),
            Self::BodyTimedOut(_) => (408, "body_timed_out", "The body came too slowly"),
            Self::Conflict(_) => (409, "conflict", "The mission's state does not allow this"),
            Self::NoPlanYet(_) => (409, "no_plan_yet", "There is no plan yet"),
            Self::Changed { .. } => (412, "mission_changed", "The mission has changed"),
            Self::TooLarge => (413, "body_too_large", "The body is too large"),
            Self::NotJson(_) => (415, "unsupported_media_type", "JSON is the only format"),
            Self::NotUtf8(_) => (415, "unsupported_charset", "UTF-8 is the only character set"),
            Self::Coded(_) => (
                415,
                "unsupported_content_encoding",
                "Compressed bodies are not accepted",
            ),
            Self::UnknownHost(_) => (421, "unknown_host", "The service has another name"),
            Self::Invalid(_) => (422, "invalid_request", "The request is not valid"),
            Self::KeyTaken => (
                422,
                "idempotency_key_taken",
                "The Idempotency-Key belongs to another request",
            ),
            Self::Share { .. } | Self::DiskShare => (429, "share_used", "The client has used its share"),
            Self::Panicked => (500, "internal", "The service has a bug"),
            Self::Overloaded => (503, "overloaded", "Every planner is busy"),
            Self::NoSolution(_) => (503, "no_solution", "No program was solved"),
            Self::NotReady(_) => (503, "not_ready", "The service cannot plan"),
            Self::Behind => (503, "mission_behind", "The mission cannot take the request now"),
            Self::Elsewhere(_) => (503, "mission_elsewhere", "Another service has the mission"),
            Self::Crowded { .. } => (503, "crowded", "The service is at its limit"),
            Self::NoMissions => (503, "no_missions", "The service keeps no missions"),
            Self::TimedOut => (504, "timed_out", "The plan took too long"),
            Self::FileTimedOut(_) => (504, "timed_out", "The file took too long to read"),
            Self::Unanswered => (504, "mission_unanswered", "The mission has not answered in time"),
            Self::Log(StoreError::Full) => (507, "disk_full", "The disk is full"),
            Self::Log(_) => (503, "not_stored", "The mission log does not work"),
        }
    }

    /// The document for the request with that path (`instance`) and id.
    #[must_use]
    pub fn document(&self, instance: &str, request_id: &str) -> ProblemDocument {
        let (status, code, title) = self.kind();
        let mut errors = match self {
            Self::Syntax(error) => vec![FieldError::clone(error)],
            Self::Invalid(errors) => errors.clone(),
            _ => Vec::new(),
        };
        errors.truncate(FIELD_ERRORS_MAX);
        ProblemDocument {
            kind: format!("urn:pilotfish:problem:{code}"),
            title: title.to_owned(),
            status,
            detail: shortened(self.to_string()),
            instance: shortened(instance.to_owned()),
            code: code.to_owned(),
            request_id: request_id.to_owned(),
            errors,
        }
    }
}

/// The refusals of a snapshot, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusals;

impl IntoResponses for Refusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        [
            (400, "The body is not JSON, or ended early."),
            (
                401,
                "The service requires a token, and the request has no valid one.",
            ),
            (
                403,
                "The token does not allow this call, or a page of another site sent the request.",
            ),
            (408, "The body came too slowly."),
            (413, "The body is longer than 1 MiB."),
            (
                415,
                "The body is not declared as JSON in UTF-8 without content encoding.",
            ),
            (
                422,
                "Some fields are not valid: `errors` names them by JSON pointer.",
            ),
            (500, "The service has a bug."),
            (
                503,
                "Every planner is busy, or there is no solution and `fallback` is `none`.",
            ),
            (
                504,
                "The deadline passed, and `fallback` is `none` or the body is a file.",
            ),
        ]
        .map(refusal)
        .into()
    }
}

fn refusal((status, description): (u16, &str)) -> (String, RefOr<Documented>) {
    let shape = Ref::from_schema_name("ProblemDocument");
    let content = ContentBuilder::new().schema(Some(shape)).build();
    let response = ResponseBuilder::new()
        .description(description)
        .content("application/problem+json", content)
        .build();
    (status.to_string(), RefOr::T(response))
}

/// The refusals of a call about missions, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MissionRefusals;

impl IntoResponses for MissionRefusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        let mut all = Refusals::responses();
        let of_missions = [
            (
                403,
                "The token does not allow this call or is limited to other missions, or a page of another site sent the request.",
            ),
            (404, "There is no such mission."),
            (
                409,
                "The mission's state does not allow this: it is over, running, without a plan, or not of the kind that this call needs.",
            ),
            (412, "The mission is no longer as `If-Match` says."),
            (
                429,
                "The client has used its share of missions, streams, records or disk.",
            ),
            (507, "The disk is full."),
            (
                503,
                "The mission or its log is too busy, the log cannot be written, or the service keeps no missions.",
            ),
            (504, "The mission has not answered in time."),
        ];
        all.extend(of_missions.map(refusal));
        all
    }
}

/// The remedy for a mission that has changed, and its last orders.
fn changed(revision: u64, since: &[Order]) -> String {
    let order = |order: &Order| {
        let Order {
            action, caller, at_s, ..
        } = order;
        format!("{action} by {caller} at {at_s:.0} s")
    };
    let since: Vec<_> = since.iter().map(order).collect();
    format!(
        "get the mission, which has the ETag \"{revision}\" now, and decide again; last orders: {}",
        since.join(", ")
    )
}

fn no_plan_yet(waits_for: &[String]) -> String {
    if waits_for.is_empty() {
        return "the mission has no plan yet: run it, and ask with ?wait_s= for the next plan".to_owned();
    }
    format!(
        "recent reports are missing of {}: POST reports",
        waits_for.join(", ")
    )
}

/// The first of the faults, and the number of the others.
fn first_of(errors: &[FieldError]) -> String {
    match errors {
        [] => "a field is not valid".to_owned(),
        [only] => located(only),
        [first, rest @ ..] => format!("{} (and {} more)", located(first), rest.len()),
    }
}

/// The fault and its place.
fn located(error: &FieldError) -> String {
    let place = match (&error.parameter, error.pointer.as_str()) {
        (Some(name), _) => format!("the parameter {name}"),
        (None, "") => "the body".to_owned(),
        (None, pointer) => pointer.to_owned(),
    };
    format!("{place}: {}", error.detail)
}

impl IntoResponse for Problem {
    /// The status and the headers; the middleware writes the document.
    fn into_response(self) -> Response {
        let (status, ..) = self.kind();
        let status = StatusCode::from_u16(status).expect("has three digits");
        let mut response = status.into_response();
        match self {
            Self::Overloaded
            | Self::TimedOut
            | Self::FileTimedOut(_)
            | Self::Behind
            | Self::Unanswered
            | Self::Crowded { .. }
            | Self::Share { .. }
            | Self::Elsewhere(_)
            | Self::Log(
                StoreError::Busy | StoreError::Locked | StoreError::Unavailable(_) | StoreError::Lapsed,
            ) => {
                response.headers_mut().insert(header::RETRY_AFTER, RETRY_AFTER);
            }
            Self::Unauthenticated => {
                let scheme = HeaderValue::from_static("Bearer");
                response.headers_mut().insert(header::WWW_AUTHENTICATE, scheme);
            }
            // The rest of the body is not read.
            Self::BodyTimedOut(_) => {
                let close = HeaderValue::from_static("close");
                response.headers_mut().insert(header::CONNECTION, close);
            }
            _ => {}
        }
        response.extensions_mut().insert(self);
        response
    }
}
