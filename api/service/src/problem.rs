//! What can go wrong with a request, and how it is said: RFC 9457 problem documents.
//!
//! The only place where a status code is chosen. Handlers answer with a [`Problem`]; the document is
//! written at the service's edge, which knows the request's path and id.

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

use wire::{FieldError, shortened};

use crate::{access::Role, examples::EXAMPLES, posted::BODY_BYTES_MAX, store::StoreError};

/// Most field errors in one document: a client mends the first few and asks again.
const FIELD_ERRORS_MAX: usize = 64;

/// When to try again after the service was too busy, s: plans take milliseconds, so a queue that is
/// full now is not full a second later.
const RETRY_AFTER: HeaderValue = HeaderValue::from_static("1");

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Problem {
    /// The body is not JSON.
    Syntax(Box<FieldError>),
    /// The body is JSON but not a valid request.
    Invalid(Vec<FieldError>),
    /// The body is announced as something other than JSON, by this content type if any.
    NotJson(Option<String>),
    /// The body is announced as something other than a campaign, by this content type if any.
    NoCampaignFormat(Option<String>),
    /// The body is announced in a character set other than UTF-8, by this content type.
    NotUtf8(String),
    /// The body is compressed or coded otherwise: its content encoding.
    Coded(String),
    /// The body is longer than accepted.
    TooLarge,
    /// The body ended early.
    BodyUnreadable,
    /// The body came too slowly: the longest time for one.
    BodyTimedOut(Duration),
    /// The request names no host, several, or one that is none.
    HostHeader,
    /// The request is for another host: its name.
    UnknownHost(String),
    /// A page of another site sent the request.
    CrossSite,
    /// The request has no valid token.
    Unauthenticated,
    /// The request's token is not for this call.
    Forbidden {
        /// The least role that the call needs.
        needed: Role,
        /// The token's.
        role: Role,
    },
    /// No such route.
    NoRoute,
    /// What was asked for is in a program that is built with this feature.
    NotBuiltIn(&'static str),
    /// No such example.
    NoExample,
    /// The route does not know the method.
    MethodNotAllowed,
    /// Every planner is busy and the queue is full.
    Overloaded,
    /// The plan took too long.
    TimedOut,
    /// No program was solved, and the client accepts nothing else: what the solver said.
    NoSolution(String),
    /// The service cannot plan, and why.
    NotReady(String),
    /// No such mission.
    NoMission,
    /// The mission is not such that this could be done, and why.
    Conflict(String),
    /// No such campaign.
    NoCampaign,
    /// The campaign is not such that this could be done, and why.
    CampaignConflict(String),
    /// As many campaigns are kept as may be.
    CampaignsKept(usize),
    /// A campaign cannot be stored, and why.
    NotStored(String),
    /// There is no plan yet: the vehicles of which nothing is known.
    NoPlanYet(Vec<String>),
    /// The client's key was answered before, when it asked for something else.
    KeyTaken,
    /// The mission has more to do than it gets done.
    Behind,
    /// The mission has not answered.
    Unanswered,
    /// As many missions, streams or records are under way as the service takes on.
    Crowded {
        /// What there are too many of.
        what: &'static str,
        /// How many it takes on.
        limit: usize,
    },
    /// The client has as many of something as one may.
    Share {
        /// What it has too many of.
        what: &'static str,
        /// How many one may have.
        limit: usize,
    },
    /// The missions of the client who made this one take as much of the disk as they may.
    DiskShare,
    /// The service was started without a place for missions.
    NoMissions,
    /// The mission log does not do what it should.
    Log(StoreError),
    /// A bug of ours.
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
    /// Names the kind of problem.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind of problem, for people.
    pub title: String,
    /// The HTTP status code.
    pub status: u16,
    /// Which error it is, and what to do about it.
    pub detail: String,
    /// Path of the request.
    pub instance: String,
    /// The kind of problem, for programs.
    pub code: String,
    /// Id of the request, also in the `x-request-id` header and the service's log.
    pub request_id: String,
    /// The fields at fault.
    pub errors: Vec<FieldError>,
}

impl Problem {
    pub(crate) fn conflict(why: &str) -> Self {
        Self::Conflict(why.to_owned())
    }

    /// The same problem of what stands at `place` of the body.
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
            Self::Invalid(_) => (422, "invalid_request", "The request is not valid"),
            Self::NotJson(_) => (415, "unsupported_media_type", "JSON is the only format"),
            Self::NoCampaignFormat(_) => (
                415,
                "unsupported_media_type",
                "JSON and TOML are the only formats",
            ),
            Self::NotUtf8(_) => (415, "unsupported_charset", "UTF-8 is the only character set"),
            Self::Coded(_) => (415, "unsupported_content_encoding", "Bodies are not decoded"),
            Self::BodyTimedOut(_) => (408, "body_timed_out", "The body came too slowly"),
            Self::TooLarge => (413, "body_too_large", "The body is too large"),
            Self::HostHeader => (400, "host_header", "The request does not name one host"),
            Self::UnknownHost(_) => (421, "unknown_host", "The service has another name"),
            Self::CrossSite => (403, "cross_site", "Pages of other sites may not call the service"),
            Self::Unauthenticated => (401, "unauthenticated", "The service asks for a token"),
            Self::Forbidden { .. } => (403, "forbidden", "The token is not for this call"),
            Self::NoRoute => (404, "no_route", "There is nothing here"),
            Self::NotBuiltIn(_) => (404, "not_built_in", "The program was built without it"),
            Self::NoExample => (404, "no_example", "There is no such example"),
            Self::MethodNotAllowed => (405, "method_not_allowed", "The method is not allowed"),
            Self::Overloaded => (503, "overloaded", "Every planner is busy"),
            Self::TimedOut => (504, "timed_out", "The plan took too long"),
            Self::NoSolution(_) => (503, "no_solution", "No program was solved"),
            Self::NotReady(_) => (503, "not_ready", "The service cannot plan"),
            Self::NoMission => (404, "no_mission", "There is no such mission"),
            Self::Behind => (503, "mission_behind", "The mission has too much to do"),
            Self::Conflict(_) => (409, "conflict", "The mission is not such"),
            Self::NoCampaign => (404, "no_campaign", "There is no such campaign"),
            Self::CampaignConflict(_) => (409, "conflict", "The campaign is not such"),
            Self::NoPlanYet(_) => (409, "no_plan_yet", "There is no plan yet"),
            Self::KeyTaken => (
                422,
                "idempotency_key_taken",
                "The Idempotency-Key stands for another request",
            ),
            Self::Unanswered => (504, "mission_unanswered", "The mission has not answered in time"),
            Self::Crowded { .. } | Self::CampaignsKept(_) => {
                (503, "crowded", "The service has taken on all it can")
            }
            Self::Share { .. } | Self::DiskShare => (429, "share_used", "The client has its share"),
            Self::NoMissions => (503, "no_missions", "There is no place for missions"),
            Self::Log(StoreError::Full) => (507, "disk_full", "The disk is full"),
            Self::Log(_) | Self::NotStored(_) => (503, "not_stored", "Nothing can be stored"),
            Self::Panicked => (500, "internal", "The service has a bug"),
        }
    }

    fn detail(&self) -> String {
        match self {
            Self::Syntax(error) => placed(error),
            Self::Invalid(errors) => match errors.as_slice() {
                [] => "a field is not valid".to_owned(),
                [only] => placed(only),
                [first, rest @ ..] => format!("{} (and {} more)", placed(first), rest.len()),
            },
            Self::NotJson(Some(given)) => format!("send content-type: application/json, not {given}"),
            Self::NotJson(None) => "send content-type: application/json".to_owned(),
            Self::NoCampaignFormat(Some(given)) => {
                format!("send content-type: application/json or application/toml, not {given}")
            }
            Self::NoCampaignFormat(None) => "send content-type: application/json or application/toml".to_owned(),
            Self::NotUtf8(given) => format!("send UTF-8, as application/json always is, not {given}"),
            Self::Coded(given) => format!("send the body without content-encoding, not as {given}"),
            Self::BodyTimedOut(limit) => format!("the whole body must arrive within {limit:?}"),
            Self::TooLarge => format!("at most {BODY_BYTES_MAX} bytes are accepted"),
            Self::BodyUnreadable => "the connection ended before the body did".to_owned(),
            Self::HostHeader => "send exactly one Host header, as HTTP/1.1 asks".to_owned(),
            Self::UnknownHost(given) => {
                format!("{given} is not a name of this service: call it by its address, or start it with --allow-host {given}")
            }
            Self::CrossSite => "call it from its own page, or without a browser".to_owned(),
            Self::Unauthenticated => {
                "send Authorization: Bearer and a token that is valid; pilotfish token add makes one".to_owned()
            }
            Self::Forbidden { needed, role } => {
                format!("it needs the role {needed}, and this token is {role}")
            }
            Self::NoRoute => "GET /openapi.json lists every route".to_owned(),
            Self::NotBuiltIn(feature) => {
                format!("build the program with --features {feature}; GET /openapi.json lists every route")
            }
            Self::NoExample => {
                format!("the examples are {}", EXAMPLES.map(|example| example.name).join(", "))
            }
            Self::MethodNotAllowed => "the Allow header names the methods of this route".to_owned(),
            Self::Overloaded => "the queue is full; try again after the time in Retry-After".to_owned(),
            Self::TimedOut => {
                "no program was solved by the deadline; try again after the time in Retry-After, or \
                               with \"fallback\":\"los\" for a lower fallback level"
                    .to_owned()
            }
            Self::NoSolution(reason) => {
                format!("{reason}; with \"fallback\":\"los\" a lower fallback level would have answered")
            }
            Self::NotReady(why) | Self::Conflict(why) | Self::CampaignConflict(why) | Self::NotStored(why) => {
                why.clone()
            }
            Self::NoCampaign => "GET /v1/campaigns lists them".to_owned(),
            Self::CampaignsKept(limit) => format!("it keeps {limit} campaigns: DELETE some that are over"),
            Self::NoMission => "GET /v1/missions lists them".to_owned(),
            Self::Behind => "its mailbox is full; try again after the time in Retry-After".to_owned(),
            Self::Unanswered => {
                "it may still be carried out: send it again with the same Idempotency-Key, or look before you do".to_owned()
            }
            Self::NoPlanYet(waits_for) if waits_for.is_empty() => {
                "the mission has not been planned for; run it, and ask with ?wait_s= for the next plan"
                    .to_owned()
            }
            Self::NoPlanYet(waits_for) => {
                format!("nothing recent is known of {}: POST reports", waits_for.join(", "))
            }
            Self::KeyTaken => {
                "choose a new key for each new request, and an old one for an old request only".to_owned()
            }
            Self::Crowded { what, limit } => {
                format!("it takes on {limit} {what} at once; try again after the time in Retry-After")
            }
            Self::Share { what, limit } => {
                format!("one client has at most {limit} {what}: end some, or try again after the time in Retry-After")
            }
            Self::DiskShare => {
                "the missions of the client who made this one fill its share of the disk: delete some that are over".to_owned()
            }
            Self::NoMissions => "start it with --data DIRECTORY".to_owned(),
            Self::Log(error) => error.to_string(),
            Self::Panicked => "the service logged what happened; quote the request id".to_owned(),
        }
    }

    /// The document for a request of `instance`, a path, known as `request_id`.
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
            detail: shortened(self.detail()),
            instance: shortened(instance.to_owned()),
            code: code.to_owned(),
            request_id: request_id.to_owned(),
            errors,
        }
    }
}

/// Every way in which a posted snapshot is refused, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusals;

impl IntoResponses for Refusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        [
            (400, "Not JSON, or not whole."),
            (401, "No valid token, where the service asks for one."),
            (
                403,
                "The token is not for this call, or a page of another site sent the request.",
            ),
            (408, "The body came too slowly."),
            (413, "Over 1 MiB."),
            (415, "Not announced as JSON, in UTF-8, without content encoding."),
            (422, "Fields at fault, by pointer."),
            (500, "A bug of the service."),
            (
                503,
                "Every planner is busy, or no solution and `fallback` is `none`.",
            ),
            (504, "Not in time, and `fallback` is `none`."),
        ]
        .map(refusal)
        .into()
    }
}

/// A refusal of that status, as the `OpenAPI` document shows it.
fn refusal((status, description): (u16, &str)) -> (String, RefOr<Documented>) {
    let shape = Ref::from_schema_name("ProblemDocument");
    let content = ContentBuilder::new().schema(Some(shape)).build();
    let response = ResponseBuilder::new()
        .description(description)
        .content("application/problem+json", content)
        .build();
    (status.to_string(), RefOr::T(response))
}

/// Every way in which a call about missions is refused, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MissionRefusals;

impl IntoResponses for MissionRefusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        let mut all = Refusals::responses();
        let of_missions = [
            (404, "There is no such mission."),
            (
                409,
                "The mission is over, of the other kind, running, or without a plan.",
            ),
            (
                429,
                "The client has as many missions, streams or records as one may.",
            ),
            (507, "The disk is full."),
            (
                503,
                "The mission or the log has too much to do, the log cannot be written, or there is no place for missions.",
            ),
            (504, "The mission has not answered in time."),
        ];
        all.extend(of_missions.map(refusal));
        all
    }
}

/// Every way in which a call about campaigns is refused, for the `OpenAPI` document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CampaignRefusals;

impl IntoResponses for CampaignRefusals {
    fn responses() -> BTreeMap<String, RefOr<Documented>> {
        let mut all = Refusals::responses();
        all.remove("504");
        let of_campaigns = [
            (404, "There is no such campaign."),
            (409, "The campaign is over, or not done."),
            (
                415,
                "Not announced as JSON or TOML, in UTF-8, without content encoding.",
            ),
            (
                429,
                "The client has as many campaigns, streams or files under way as one may.",
            ),
            (
                503,
                "As many campaigns, streams or files are under way, or campaigns kept, as there may be, or nothing can be stored.",
            ),
            (507, "The disk is full."),
        ];
        all.extend(of_campaigns.map(refusal));
        all
    }
}

/// What is wrong, and where.
fn placed(error: &FieldError) -> String {
    let place = match (&error.parameter, error.pointer.as_str()) {
        (Some(name), _) => format!("the parameter {name}"),
        (None, "") => "the body".to_owned(),
        (None, pointer) => pointer.to_owned(),
    };
    format!("{place}: {}", error.detail)
}

impl IntoResponse for Problem {
    /// The status and the headers; the edge of the service writes the document.
    fn into_response(self) -> Response {
        let (status, ..) = self.kind();
        let status = StatusCode::from_u16(status).expect("has three digits");
        let mut response = status.into_response();
        match self {
            Self::Overloaded
            | Self::TimedOut
            | Self::Behind
            | Self::Unanswered
            | Self::Crowded { .. }
            | Self::Share { .. }
            | Self::Log(StoreError::Busy) => {
                response.headers_mut().insert(header::RETRY_AFTER, RETRY_AFTER);
            }
            Self::Unauthenticated => {
                let scheme = HeaderValue::from_static("Bearer");
                response.headers_mut().insert(header::WWW_AUTHENTICATE, scheme);
            }
            // What is still to come of the body is not waited for.
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
