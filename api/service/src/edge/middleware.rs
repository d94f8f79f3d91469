//! Steps around every request and answer: access, id, log line, problem documents, headers.

use std::any::Any;
use std::mem;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use clock::Clock;
use parking_lot::Mutex;
use tracing::{Instrument as _, Span, error_span, field::Empty};

use crate::edge::access::{Caller, Tokens, changes_nothing, is_public};
use crate::edge::answer::{Answer, AnswerMemory, StillAllowed, no_longer};
use crate::edge::arrival::Arrival;
use crate::edge::hosts::Hosts;
use crate::edge::page;
use crate::edge::problem::Problem;
use crate::edge::request_id::{self, RequestId};
use crate::edge::slots::ConnectionSlot;
use crate::edge::trace::{TRACERESPONSE, TraceContext, TraceFn};
use crate::metrics::{Metrics, Shed};

/// The route label of requests without a route.
const UNMATCHED: &str = "unmatched";

const MISSION: &str = "/v1/missions/{id}";

/// Calls that keep missions alive: their connections keep their slots.
const MISSION_CALLS: [(Method, &str); 2] =
    [(Method::POST, "/v1/missions/{id}/reports"), (Method::GET, "/v1/missions/{id}/events")];

/// Routes that probes and bridges call often; their successful answers are logged at debug level.
const FREQUENT: [&str; 5] =
    ["/livez", "/readyz", "/metrics", "/v1/missions/{id}/reports", "/v1/missions/{id}/reference"];

/// The content security policy of every answer without its own. Pages load nothing from elsewhere.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// The policy of the page's files where pages of `origins` may show them in a frame; `None` without
/// any.
pub(crate) fn framed_by(origins: &[HeaderValue]) -> Option<HeaderValue> {
    let origins: Vec<&str> = origins.iter().filter_map(|origin| origin.to_str().ok()).collect();
    let policy = POLICY.to_str().ok()?.strip_suffix("'none'")?.to_owned() + &origins.join(" ");
    HeaderValue::from_str(&policy).ok().filter(|_| !origins.is_empty())
}

/// Headers of every answer: no guessed content types, no use by pages of other origins.
const HEADERS: [(HeaderName, HeaderValue); 5] = [
    (header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
    (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
    (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
];

/// Cache control of everything about missions and plans: no cache keeps it.
const NO_STORE: HeaderValue = HeaderValue::from_static("no-store");

/// Cache control of the page's files: they may be kept, and are validated by their tags before use.
const REVALIDATE: HeaderValue = HeaderValue::from_static("no-cache");

#[derive(Clone)]
pub(crate) struct Middleware {
    pub(crate) clock: Clock,
    pub(crate) hosts: Option<Hosts>,
    pub(crate) tokens: Option<Tokens>,
    pub(crate) trace: TraceFn,
    pub(crate) framed: Option<HeaderValue>,
    pub(crate) metrics: Metrics,
    pub(crate) answers: AnswerMemory,
}

impl Middleware {
    /// The sender of the request; `None` on public paths. Fails if the request is not allowed.
    fn admit(&self, request: &Request) -> Result<Option<Caller>, Problem> {
        let (method, path) = (request.method(), request.uri().path());
        if let Some(hosts) = &self.hosts {
            hosts.check(method, request.version(), request.headers())?;
        }
        if is_public(path) {
            return Ok(None);
        }
        let peer = request.extensions().get().copied();
        let caller = Caller::of(self.tokens.as_ref(), peer, request.headers())?;
        caller.may(method, path)?;
        Ok(Some(caller))
    }

    /// Checks, when asked later, if the sender of the request is still `caller`.
    fn still_allowed(&self, request: &Request, caller: &Caller) -> StillAllowed {
        let tokens = self.tokens.clone();
        let peer = request.extensions().get().copied();
        let given = request.headers().get_all(header::AUTHORIZATION).iter();
        let headers: HeaderMap = given.map(|token| (header::AUTHORIZATION, token.clone())).collect();
        let caller = caller.clone();
        Box::new(move || Caller::of(tokens.as_ref(), peer, &headers).is_ok_and(|now| now == caller))
    }

    /// Lets the service answer, within the memory for answers. A change once made is never refused.
    async fn answer(&self, mut request: Request, caller: Caller, next: Next) -> Response {
        let needs_memory = changes_nothing(request.method(), request.uri().path());
        let name = caller.name.clone();
        request.extensions_mut().insert(caller);
        let answer = next.run(request).await;
        if !needs_memory {
            return answer;
        }
        let (head, body) = answer.into_parts();
        match self.answers.hold(name, body).await {
            Ok(body) => Response::from_parts(head, body),
            Err(problem) => {
                self.metrics.shed(Shed::Memory);
                problem.into_response()
            }
        }
    }
}

/// Admits a request, hands it on, and completes its answer.
pub(crate) async fn handle(middleware: Middleware, mut request: Request, next: Next) -> Response {
    let clock = middleware.clock.clone();
    let start = clock.now();
    request.extensions_mut().insert(Arrival(start));
    request.extensions_mut().insert(clock.clone());
    let id = RequestId::of(request.headers());
    request.extensions_mut().insert(id.clone());
    let RequestId(id) = id;
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let route = request.extensions().get::<MatchedPath>().cloned();
    let route = route.as_ref().map_or(UNMATCHED, MatchedPath::as_str);
    let span = span(&method, route, &path, &id);
    let parent = TraceContext::of(request.headers());
    let trace = (middleware.trace)(&span, format_args!("{method} {route}"), parent);
    let trace = trace.unwrap_or_else(|| TraceContext::within(parent, request_id::random));
    span.record("trace_id", format_args!("{:032x}", trace.trace));

    let slot = request.extensions_mut().remove::<ConnectionSlot>();
    let active = slot.as_ref().map(ConnectionSlot::request);
    let mut still_allowed = None;
    let mut response = match middleware.admit(&request) {
        Ok(Some(caller)) => {
            span.record("caller", &*caller.name);
            if let Some(slot) = slot.as_ref().filter(|_| caller.has_token) {
                slot.serves_a_caller(&caller.name);
            }
            let allowed = still_allowed.insert(middleware.still_allowed(&request, &caller));
            let answer = middleware.answer(request, caller, next).instrument(span.clone());
            // A change always completes: its answer says if it was stored.
            tokio::select! {
                biased;
                answer = answer => answer,
                () = no_longer(allowed, &clock), if changes_nothing(&method, &path) => Problem::Unauthenticated.into_response(),
            }
        }
        Ok(None) => next.run(request).instrument(span.clone()).await,
        Err(problem) => problem.into_response(),
    };
    if let Some(slot) = slot
        && response.status().is_success()
        && MISSION_CALLS.contains(&(method.clone(), route))
    {
        slot.serves_a_mission();
    }
    let problem = response.extensions_mut().remove::<Problem>();
    if let Some(problem) = &problem {
        write_document(&mut response, problem, &path, &id);
    }
    let headers = response.headers_mut();
    headers.extend(HEADERS);
    if let Some(framed) = middleware.framed.filter(|_| page::has(&path)) {
        headers.remove(header::X_FRAME_OPTIONS);
        headers.insert(header::CONTENT_SECURITY_POLICY, framed);
    }
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(POLICY);
    let is_file = headers.contains_key(header::ETAG) && page::has(&path);
    headers.insert(header::CACHE_CONTROL, if is_file { REVALIDATE } else { NO_STORE });
    for (name, value) in [(&request_id::HEADER, id), (&TRACERESPONSE, trace.to_string())] {
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(name.clone(), value);
        }
    }

    let took = clock.since(start);
    let metrics = &middleware.metrics;
    metrics.request(&method, route, response.status(), took);
    span.in_scope(|| log(route, response.status(), took, problem.as_ref(), &clock));
    response.map(|body| Answer::body(body, active, still_allowed, &clock))
}

/// Fields of each log line about a request. Its level is error, so that filters keep the fields.
fn span(method: &Method, route: &str, path: &str, id: &str) -> Span {
    let mission = route.starts_with(MISSION).then(|| path.split('/').nth(3));
    let mission = mission.flatten().filter(|id| id.len() <= request_id::LENGTH_MAX);
    error_span!(
        "request",
        %method,
        route,
        request_id = id,
        trace_id = Empty,
        mission,
        caller = Empty,
        // Tracers set these.
        otel.name = Empty,
        otel.kind = Empty,
    )
}

fn log(route: &str, status: StatusCode, took: Duration, problem: Option<&Problem>, clock: &Clock) {
    let (status, ms) = (status.as_u16(), took.as_secs_f64() * 1e3);
    if problem == Some(&Problem::Overloaded) {
        tracing::debug!(status, ms, "answered");
        if let Some(requests) = REFUSED.count(clock.now()) {
            tracing::warn!(requests, "requests refused since the last such line, this one last");
        }
    } else if problem == Some(&Problem::Panicked) || (status < 300 && FREQUENT.contains(&route)) {
        // The panic has its own line.
        tracing::debug!(status, ms, "answered");
    } else if 500 <= status {
        tracing::warn!(status, ms, "answered");
    } else {
        tracing::info!(status, ms, "answered");
    }
}

/// Requests refused under overload. A log line for each would cost more than the refusal.
static REFUSED: RateLimited = RateLimited(Mutex::new((0, None)));

/// Events that are logged once a second: their number since the last line, and its time.
struct RateLimited(Mutex<(u64, Option<Instant>)>);

impl RateLimited {
    /// Counts one event. Returns the count if a line is due.
    fn count(&self, now: Instant) -> Option<u64> {
        let mut counted = self.0.lock();
        counted.0 += 1;
        let since = counted.1.map(|line| now.saturating_duration_since(line));
        if since.is_some_and(|since| since < Duration::from_secs(1)) {
            return None;
        }
        counted.1 = Some(now);
        Some(mem::take(&mut counted.0))
    }
}

fn write_document(response: &mut Response, problem: &Problem, path: &str, id: &str) {
    let document = serde_json::to_vec(&problem.document(path, id)).expect("strings, numbers and lists only");
    *response.body_mut() = Body::from(document);
    let headers = response.headers_mut();
    headers.remove(header::CONTENT_LENGTH);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
}

/// The answer of a handler that panicked. The program's panic hook has logged it.
pub(crate) fn caught_panic(_panic: Box<dyn Any + Send>) -> Response {
    Problem::Panicked.into_response()
}
