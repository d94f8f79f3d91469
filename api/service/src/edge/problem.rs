//! Problems of requests, as RFC 9457 problem documents.
//!
//! Only this module chooses status codes. Handlers return a [`Problem`]; the middleware, which
//! knows the request's path and id, writes the document.

use std::{collections::BTreeMap, fmt, time::Duration};

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response as Documented, ResponseBuilder};
use utoipa::{IntoResponses, ToSchema};

use wire::{FieldError, mission::Order, shortened};

use store::StoreError;

use crate::edge::role::{Role, TokenLimit};
use crate::limits::{BODY_BYTES_MAX, FIELD_ERRORS_MAX};

/// Time after which to ask a busy service again, s: plans take milliseconds.
const RETRY_AFTER: HeaderValue = HeaderValue::from_static("1");

/// Defines the problems: status, code, title and variant of each, and its detail: fault and remedy.
macro_rules! problems {
    ($($status:literal $code:literal $title:literal
        $variant:ident $(($($of:ty),*))? $({ $($field:ident: $kind:ty),* })? => $detail:tt)*) => {
        /// The reason of a refusal, with its remedy.
        #[expect(missing_docs, reason = "each detail explains the fields that it names")]
        #[derive(Clone, Debug, PartialEq, thiserror::Error)]
        pub enum Problem {
            $(#[doc = $title] #[error $detail] $variant $(($($of),*))? $({ $($field: $kind),* })?,)*
        }

        impl Problem {
            fn kind(&self) -> (u16, &'static str, &'static str) {
                match self {
                    Self::Log(StoreError::Full) => (507, "disk_full", "The disk is full"),
                    $(Self::$variant { .. } => ($status, $code, $title),)*
                }
            }
        }
    };
}

problems! {
    400 "syntax" "The body is not JSON" Syntax(Box<FieldError>) => (fmt = located)
    400 "body_unreadable" "The body ended early" BodyUnreadable =>
        ("the connection ended before the body did")
    400 "body_in_pieces" "The body has too many chunks" InPieces(usize) =>
        ("send the body in at most {0} chunks")
    400 "host_header" "The request does not name one host" HostHeader =>
        ("send exactly one Host header, as HTTP/1.1 requires")
    401 "unauthenticated" "The service requires a token" Unauthenticated =>
        ("send Authorization: Bearer and a valid token; pilotfish token add creates one")
    403 "forbidden" "The token does not allow this call" Forbidden { needed: Role, role: Role } =>
        ("the call needs the role {needed}, and the token has the role {role}")
    403 "mission_forbidden" "The token is limited to other missions" Limited(TokenLimit) =>
        ("the token is limited to {0}; a new mission has the name of its craft in metadata.bridge")
    403 "cross_site" "Pages of other sites may not call the service" CrossSite =>
        ("call it from its own page, or without a browser")
    404 "no_route" "There is no such route" NoRoute => ("GET /openapi.json lists every route")
    404 "no_example" "There is no such example" NoExample => ("GET /v1/examples lists them")
    404 "no_mission" "There is no such mission" NoMission => ("GET /v1/missions lists them")
    405 "method_not_allowed" "The method is not allowed" MethodNotAllowed =>
        ("the Allow header names the methods of this route")
    408 "body_timed_out" "The body came too slowly" BodyTimedOut(Duration) =>
        ("the whole body must arrive within {0:?}")
    409 "conflict" "The mission's state does not allow this" Conflict(String) => ("{0}")
    409 "no_plan_yet" "There is no plan yet" NoPlanYet(Vec<String>) => (fmt = no_plan_yet)
    412 "mission_changed" "The mission has changed" Changed { revision: u64, since: Vec<Order> } =>
        ("{}", changed(*revision, since))
    413 "body_too_large" "The body is too large" TooLarge => ("at most {BODY_BYTES_MAX} bytes are accepted")
    415 "unsupported_media_type" "JSON is the only format" NotJson(String) =>
        ("send content-type: application/json{0}")
    415 "unsupported_charset" "UTF-8 is the only character set" NotUtf8(String) => ("send UTF-8, not {0}")
    415 "unsupported_content_encoding" "Compressed bodies are not accepted" Coded(String) =>
        ("send the body without content-encoding, not as {0}")
    421 "unknown_host" "The service has another name" UnknownHost(String) =>
        ("{0} is not a name of this service: call it by its address, or start it with --allow-host {0}")
    422 "invalid_request" "The request is not valid" Invalid(Vec<FieldError>) => (fmt = first_of)
    422 "idempotency_key_taken" "The Idempotency-Key belongs to another request" KeyTaken =>
        ("choose a new key for each new request; repeat a key only to repeat its request")
    429 "share_used" "The client has used its share" Share { what: &'static str, limit: usize } =>
        ("one client may have {limit} {what}: end some, or try again after the time in Retry-After")
    429 "share_used" "The client has used its share" DiskShare =>
        ("the missions of the client that created this one fill that client's share of the disk: delete finished ones")
    500 "internal" "The service has a bug" Panicked => ("the service logged the error; quote the request id")
    503 "overloaded" "Every planner is busy" Overloaded =>
        ("the queue is full; try again after the time in Retry-After")
    503 "no_solution" "No program was solved" NoSolution(String) =>
        ("{0}; with \"fallback\":\"los\" a lower fallback level would have answered")
    503 "not_ready" "The service cannot plan" NotReady(String) => ("{0}")
    503 "mission_behind" "The mission cannot take the request now" Behind =>
        ("too many requests wait for the mission, or it is changing its service; try again after the time in Retry-After")
    503 "mission_elsewhere" "Another service has the mission" Elsewhere(String) =>
        ("another service has the mission; try again after the time in Retry-After")
    503 "crowded" "The service is at its limit" Crowded { what: &'static str, limit: usize } =>
        ("the service accepts {limit} {what} at once; try again after the time in Retry-After")
    503 "no_missions" "The service keeps no missions" NoMissions =>
        ("start the service with --data DIRECTORY")
    503 "not_stored" "The mission log does not work" Log(StoreError) => ("{0}")
    504 "timed_out" "The plan took too long" TimedOut =>
        ("no program was solved by the deadline; try again after the time in Retry-After, or set \"fallback\":\"los\" \
          to accept a lower fallback level")
    504 "timed_out" "The file took too long to read" FileTimedOut(Duration) =>
        ("the file was not read within the service's deadline, {0:?}; make it shorter, or try again after the time in \
          Retry-After")
    504 "mission_unanswered" "The mission has not answered in time" Unanswered =>
        ("the command may still be carried out: send it again with the same Idempotency-Key, or check the mission first")
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

    /// The document for the request with that path (`instance`) and id.
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
        refusals(&format!(
            "400 The body is not JSON, or ended early.
            401 The service requires a token, and the request has no valid one.
            403 The token does not allow this call, or a page of another site sent the request.
            408 The body came too slowly.
            413 The body is longer than {} MiB.
            415 The body is not declared as JSON in UTF-8 without content encoding.
            422 Some fields are not valid: `errors` names them by JSON pointer.
            500 The service has a bug.
            503 Every planner is busy, or there is no solution and `fallback` is `none`.
            504 The deadline passed, and `fallback` is `none` or the body is a file.",
            BODY_BYTES_MAX >> 20
        ))
    }
}

/// The refusals of a call about missions, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MissionRefusals;

impl IntoResponses for MissionRefusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        let mut all = Refusals::responses();
        all.extend(refusals(
            "403 The token does not allow this call or is limited to other missions, or a page of another site sent the request.
            404 There is no such mission.
            409 The mission's state does not allow this: it is over, running, without a plan, or not of the kind that this call needs.
            412 The mission is no longer as `If-Match` says.
            429 The client has used its share of missions, streams, records or disk.
            507 The disk is full.
            503 The mission or its log is too busy, the log cannot be written, or the service keeps no missions.
            504 The mission has not answered in time.",
        ));
        all
    }
}

/// The refusals of a table: lines of a status and its reason.
fn refusals(table: &str) -> BTreeMap<String, RefOr<Documented>> {
    let refusal = |line: &str| {
        let (status, reason) = line.trim().split_once(' ')?;
        let shape = Ref::from_schema_name("ProblemDocument");
        let content = ContentBuilder::new().schema(Some(shape)).build();
        let response = ResponseBuilder::new().description(reason);
        let response = response.content("application/problem+json", content);
        Some((status.to_owned(), RefOr::T(response.build())))
    };
    table.lines().filter_map(refusal).collect()
}

/// The remedy for a mission that has changed, and its last orders.
fn changed(revision: u64, since: &[Order]) -> String {
    let order = |order: &Order| {
        let (action, caller) = (&order.action, &order.caller);
        format!("{action} by {caller} at {:.0} s", order.at_s)
    };
    let since: Vec<_> = since.iter().map(order).collect();
    format!(
        "get the mission, which has the ETag \"{revision}\" now, and decide again; last orders: {}",
        since.join(", ")
    )
}

fn no_plan_yet(waits_for: &[String], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if waits_for.is_empty() {
        return f.write_str("POST /run if the mission is not running; ?wait_s=5 waits for its plan");
    }
    let missing = waits_for.join(", ");
    write!(
        f,
        "recent reports of {missing} are missing: POST them, and POST /run if the mission is not running"
    )
}

/// The first of the faults, and the number of the others.
fn first_of(errors: &[FieldError], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let [first, rest @ ..] = errors else {
        return f.write_str("a field is not valid");
    };
    located(first, f)?;
    match rest.len() {
        0 => Ok(()),
        more => write!(f, " (and {more} more)"),
    }
}

fn located(error: &FieldError, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match (&error.parameter, error.pointer.as_str()) {
        (Some(name), _) => write!(f, "the parameter {name}")?,
        (None, "") => f.write_str("the body")?,
        (None, pointer) => f.write_str(pointer)?,
    }
    write!(f, ": {}", error.detail)
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
