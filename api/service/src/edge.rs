//! What every request and every answer passes: an id, problem documents, headers.

use std::{
    any::Any,
    hash::{BuildHasher, RandomState},
    mem,
    sync::{
        LazyLock, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use axum::{
    body::Body,
    extract::{MatchedPath, Request},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
};
use tracing::{Instrument as _, Span, error_span, field::Empty};

use crate::{
    access::{Caller, Tokens, is_public},
    deadline::Arrival,
    hosts::Hosts,
    metrics::Metrics,
    page,
    problem::Problem,
    trace::{TRACERESPONSE, TraceContext, TraceFn},
};

static REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest request id taken over from a client, bytes.
const REQUEST_ID_LENGTH_MAX: usize = 64;

/// The route of requests for which there is none.
const UNMATCHED: &str = "unmatched";

/// How routes of a mission begin.
const MISSION: &str = "/v1/missions/{id}";

/// Routes that machines ask every few seconds.
const PROBES: [&str; 3] = ["/livez", "/readyz", "/metrics"];

/// On every answer that has no other. Pages load nothing from elsewhere.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// On every answer. Nothing is guessed to be a script, and no page of another origin frames, loads or opens any of it.
const HEADERS: [(HeaderName, HeaderValue); 5] = [
    (header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        HeaderValue::from_static("same-origin"),
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        HeaderValue::from_static("same-origin"),
    ),
    (
        header::X_CONTENT_TYPE_OPTIONS,
        HeaderValue::from_static("nosniff"),
    ),
];

/// Of everything that is said of missions and plans: no cache keeps it.
const UNKEPT: HeaderValue = HeaderValue::from_static("no-store");

/// Of the page's own files: they may be kept, and are asked for again by their tags before they are used.
const ASKED_AGAIN: HeaderValue = HeaderValue::from_static("no-cache");

/// What a request is called in answers and logs.
#[derive(Clone, Debug)]
pub(crate) struct RequestId(pub(crate) String);

/// What every request passes.
#[derive(Clone)]
pub(crate) struct Edge {
    pub(crate) hosts: Option<Hosts>,
    pub(crate) tokens: Option<Tokens>,
    pub(crate) trace: TraceFn,
    pub(crate) metrics: Metrics,
}

impl Edge {
    /// Who sends the request, where that matters. Fails if it may not be sent.
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
}

/// Finishes whatever answer comes out.
pub(crate) async fn pass(edge: Edge, mut request: Request, next: Next) -> Response {
    let start = Instant::now();
    request.extensions_mut().insert(Arrival(start));
    let id = request_id(request.headers());
    request.extensions_mut().insert(RequestId(id.clone()));
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let route = request.extensions().get::<MatchedPath>().cloned();
    let route = route.as_ref().map_or(UNMATCHED, MatchedPath::as_str);
    let span = span(&method, route, &path, &id);
    let parent = TraceContext::of(request.headers());
    let trace = (edge.trace)(&span, format_args!("{method} {route}"), parent)
        .unwrap_or_else(|| TraceContext::within(parent, fresh));
    span.record("trace_id", format_args!("{:032x}", trace.trace));

    let mut response = match edge.admit(&request) {
        Ok(caller) => {
            if let Some(caller) = caller {
                span.record("caller", &*caller.name);
                request.extensions_mut().insert(caller);
            }
            next.run(request).instrument(span.clone()).await
        }
        Err(problem) => problem.into_response(),
    };
    let problem = response.extensions_mut().remove::<Problem>();
    if let Some(problem) = &problem {
        write_document(&mut response, problem, &path, &id);
    }
    let headers = response.headers_mut();
    headers.extend(HEADERS);
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(POLICY);
    let is_file = headers.contains_key(header::ETAG) && page::has(&path);
    headers.insert(header::CACHE_CONTROL, if is_file { ASKED_AGAIN } else { UNKEPT });
    for (name, value) in [(&REQUEST_ID, id), (&TRACERESPONSE, trace.to_string())] {
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(name.clone(), value);
        }
    }

    let took = start.elapsed();
    edge.metrics.request(&method, route, response.status(), took);
    span.in_scope(|| log(route, response.status(), took, problem.as_ref()));
    response
}

/// What a request's log lines say of it. At the level of errors, so that no filter takes it from a line that it lets through.
fn span(method: &Method, route: &str, path: &str, id: &str) -> Span {
    let mission = route.starts_with(MISSION).then(|| path.split('/').nth(3));
    let mission = mission.flatten().filter(|id| id.len() <= REQUEST_ID_LENGTH_MAX);
    error_span!(
        "request",
        %method,
        route,
        request_id = id,
        trace_id = Empty,
        mission,
        caller = Empty,
        // Of tracers.
        otel.name = Empty,
        otel.kind = Empty,
    )
}

fn log(route: &str, status: StatusCode, took: Duration, problem: Option<&Problem>) {
    let (status, ms) = (status.as_u16(), took.as_secs_f64() * 1e3);
    if problem == Some(&Problem::Overloaded) {
        tracing::debug!(status, ms, "answered");
        if let Some(requests) = TURNED_AWAY.count(Instant::now()) {
            tracing::warn!(
                requests,
                "turned away since the last such line; this was the newest"
            );
        }
    } else if 500 <= status {
        tracing::warn!(status, ms, "answered");
    } else if PROBES.contains(&route) {
        tracing::debug!(status, ms, "answered");
    } else {
        tracing::info!(status, ms, "answered");
    }
}

/// Those that the service has no room for. Under overload a line for each would cost more than to turn it away.
static TURNED_AWAY: Counted = Counted(Mutex::new((0, None)));

/// Events of which a line a second is logged: those since that line, and when it was.
struct Counted(Mutex<(u64, Option<Instant>)>);

impl Counted {
    /// Counts one more; how many there were, if a line is due.
    fn count(&self, now: Instant) -> Option<u64> {
        let mut counted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
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
    headers.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static("application/problem+json"),
    );
}

/// What a panicking handler is answered with.
#[expect(clippy::needless_pass_by_value, reason = "the layer hands the panic over")]
pub(crate) fn caught_panic(panic: Box<dyn Any + Send>) -> Response {
    let message = panic.downcast_ref::<String>().map(String::as_str);
    let message = message
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    tracing::error!(message, "a handler panicked");
    Problem::Panicked.into_response()
}

/// The client's own id where it is short and plain, else a fresh one.
fn request_id(headers: &HeaderMap) -> String {
    let plain = |id: &&str| {
        (1..=REQUEST_ID_LENGTH_MAX).contains(&id.len())
            && id
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || b"-_.:".contains(&byte))
    };
    let given = headers
        .get(&REQUEST_ID)
        .and_then(|id| id.to_str().ok())
        .filter(plain);
    given.map_or_else(fresh_id, str::to_owned)
}

/// Unique in this process, and unlike those of other processes; no secret.
pub(crate) fn fresh_id() -> String {
    format!("{:016x}", fresh())
}

fn fresh() -> u64 {
    static PROCESS: LazyLock<RandomState> = LazyLock::new(RandomState::new);
    static COUNT: AtomicU64 = AtomicU64::new(0);
    PROCESS.hash_one(COUNT.fetch_add(1, Ordering::Relaxed))
}
