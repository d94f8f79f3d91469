//! What every request and every answer passes: an id, problem documents, headers.

use std::{
    any::Any,
    hash::{BuildHasher, RandomState},
    sync::{
        Arc, LazyLock,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use axum::{
    body::Body,
    extract::Request,
    http::{HeaderMap, HeaderName, HeaderValue, header},
    middleware::Next,
    response::{IntoResponse, Response},
};

use crate::{
    access::{Caller, Tokens, is_public},
    deadline::Arrival,
    hosts::Hosts,
    problem::Problem,
};

static REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest request id taken over from a client, bytes.
const REQUEST_ID_LENGTH_MAX: usize = 64;

/// On every answer that has no other. Pages load nothing from elsewhere.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// On every answer. Nothing is guessed to be a script, and no page of another origin frames, loads or opens any of it.
const HEADERS: [(HeaderName, HeaderValue); 6] = [
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
    (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
];

/// What a request is called in answers and logs.
#[derive(Clone, Debug)]
pub(crate) struct RequestId(pub(crate) String);

/// Finishes whatever answer comes out.
pub(crate) async fn pass(
    hosts: Option<Hosts>,
    tokens: Option<Tokens>,
    mut request: Request,
    next: Next,
) -> Response {
    let start = Instant::now();
    request.extensions_mut().insert(Arrival(start));
    let id = request_id(request.headers());
    request.extensions_mut().insert(RequestId(id.clone()));
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());

    let mut caller = None;
    let mut response = match admit(hosts.as_ref(), tokens.as_ref(), &request) {
        Ok(known) => {
            if let Some(known) = known {
                caller = Some(Arc::clone(&known.name));
                request.extensions_mut().insert(known);
            }
            next.run(request).await
        }
        Err(problem) => problem.into_response(),
    };
    if let Some(problem) = response.extensions_mut().remove::<Problem>() {
        write_document(&mut response, &problem, &path, &id);
    }
    let headers = response.headers_mut();
    headers.extend(HEADERS);
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(POLICY);
    if let Ok(id) = HeaderValue::from_str(&id) {
        headers.insert(REQUEST_ID.clone(), id);
    }

    let (status, ms) = (response.status().as_u16(), start.elapsed().as_secs_f64() * 1e3);
    let caller = caller.as_deref();
    if response.status().is_server_error() {
        tracing::warn!(%method, path, status, ms, id, caller, "answered");
    } else {
        tracing::debug!(%method, path, status, ms, id, caller, "answered");
    }
    response
}

/// Who sends the request, where that matters. Fails if it may not be sent.
fn admit(
    hosts: Option<&Hosts>,
    tokens: Option<&Tokens>,
    request: &Request,
) -> Result<Option<Caller>, Problem> {
    let (method, path) = (request.method(), request.uri().path());
    if let Some(hosts) = hosts {
        hosts.check(method, request.version(), request.headers())?;
    }
    if is_public(path) {
        return Ok(None);
    }
    let peer = request.extensions().get().copied();
    let caller = Caller::of(tokens, peer, request.headers())?;
    caller.may(method, path)?;
    Ok(Some(caller))
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
    static PROCESS: LazyLock<RandomState> = LazyLock::new(RandomState::new);
    static COUNT: AtomicU64 = AtomicU64::new(0);
    format!("{:016x}", PROCESS.hash_one(COUNT.fetch_add(1, Ordering::Relaxed)))
}
