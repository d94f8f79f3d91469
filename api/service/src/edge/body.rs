//! Request bodies: JSON, within a time limit and shared memory. Each rejection is a [`Problem`].

use std::{sync::Arc, time::Duration};

use axum::{
    body::Body,
    extract::{FromRef, FromRequest, Request},
    http::{HeaderMap, header},
};
use clock::Clock;
use futures_util::StreamExt as _;
use serde::de::DeserializeOwned;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tracing::{Instrument as _, info_span};

use crate::{
    edge::problem::Problem,
    limits::{BODIES_KIB_MAX, BODY_BYTES_MAX, PIECES_MAX, SHORT_BYTES_MAX},
    metrics::{Metrics, Shed},
};
use wire::BodyError;

/// Settings and memory for receiving bodies.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    clock: Clock,
    /// Longest time for a body to arrive.
    time_limit: Duration,
    /// Memory for plans, and for missions, KiB.
    memory: [Arc<Semaphore>; 2],
    metrics: Metrics,
}

impl Bodies {
    pub(crate) fn new(time_limit: Duration, metrics: Metrics, clock: Clock) -> Self {
        Self {
            clock,
            time_limit,
            memory: [(); 2].map(|()| Arc::new(Semaphore::new(BODIES_KIB_MAX / 2))),
            metrics,
        }
    }

    async fn receive(&self, request: Request) -> Result<JsonBytes, Problem> {
        require_uncoded(request.headers())?;
        require_short(request.headers())?;
        let memory = &self.memory[usize::from(request.uri().path().starts_with("/v1/missions"))];
        let received = whole(request.into_body(), memory).instrument(info_span!("receive"));
        let received = self.clock.timeout(self.time_limit, received).await;
        let received = received.map_err(|_| Problem::BodyTimedOut(self.time_limit))?;
        received.inspect_err(|problem| {
            if *problem == Problem::Overloaded {
                self.metrics.shed(Shed::Memory);
            }
        })
    }
}

/// A body, not yet parsed: declared as JSON, or the file of [`AnyBytes`].
#[derive(Debug)]
pub(crate) struct JsonBytes {
    pub(crate) bytes: Vec<u8>,
    /// The memory of a long body, held as long as its bytes.
    _permit: Option<OwnedSemaphorePermit>,
}

impl JsonBytes {
    pub(crate) fn read<T: DeserializeOwned>(self) -> Result<T, Problem> {
        Ok(wire::read(&self.bytes)?)
    }
}

impl From<BodyError> for Problem {
    fn from(error: BodyError) -> Self {
        match error {
            BodyError::Syntax(error) => Self::Syntax(error),
            BodyError::Shape(error) => Self::Invalid(vec![*error]),
        }
    }
}

impl<S: Send + Sync> FromRequest<S> for JsonBytes
where
    Bodies: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        require_json(request.headers())?;
        Bodies::from_ref(state).receive(request).await
    }
}

/// A body of any content type.
#[derive(Debug)]
pub(crate) struct AnyBytes(pub(crate) JsonBytes);

impl<S: Send + Sync> FromRequest<S> for AnyBytes
where
    Bodies: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        Bodies::from_ref(state).receive(request).await.map(Self)
    }
}

/// Receives the whole body, and takes memory for it as it arrives.
async fn whole(body: Body, memory: &Arc<Semaphore>) -> Result<JsonBytes, Problem> {
    let (mut bytes, mut permit) = (vec![], None::<OwnedSemaphorePermit>);
    let (mut taken, mut n_pieces) = (0, 0);
    let mut pieces = body.into_data_stream();
    while let Some(piece) = pieces.next().await {
        n_pieces += 1;
        if PIECES_MAX < n_pieces {
            return Err(Problem::InPieces(PIECES_MAX));
        }
        bytes.extend_from_slice(&piece.map_err(|_| Problem::BodyUnreadable)?);
        if BODY_BYTES_MAX < bytes.len() {
            return Err(Problem::TooLarge);
        }
        // Short bodies take none: the number of connections bounds them.
        let long = bytes.len().saturating_sub(SHORT_BYTES_MAX);
        let more = long.div_ceil(1 << 10) - taken;
        let kib = u32::try_from(more).expect("a body is at most a MiB");
        let more_memory = Arc::clone(memory).try_acquire_many_owned(kib);
        let more_memory = more_memory.map_err(|_| Problem::Overloaded)?;
        taken += more;
        match &mut permit {
            Some(permit) => permit.merge(more_memory),
            none => *none = Some(more_memory),
        }
    }
    let _permit = permit;
    Ok(JsonBytes { bytes, _permit })
}

fn require_json(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(given) = announced(headers) else {
        return Err(Problem::NotJson(None));
    };
    let essence = given.split(';').next().unwrap_or_default();
    let essence = essence.trim().to_ascii_lowercase();
    if essence != "application/json" && !(essence.starts_with("application/") && essence.ends_with("+json")) {
        return Err(Problem::NotJson(Some(given)));
    }
    require_utf8(&given)
}

fn announced(headers: &HeaderMap) -> Option<String> {
    let given = headers.get(header::CONTENT_TYPE)?;
    Some(String::from_utf8_lossy(given.as_bytes()).into_owned())
}

fn require_utf8(content_type: &str) -> Result<(), Problem> {
    let parameters = content_type.split(';').skip(1);
    for parameter in parameters.map(|part| part.trim().to_ascii_lowercase()) {
        let charset = parameter
            .strip_prefix("charset=")
            .map(|name| name.trim_matches('"'));
        if charset.is_some_and(|name| name != "utf-8") {
            return Err(Problem::NotUtf8(content_type.to_owned()));
        }
    }
    Ok(())
}

fn require_uncoded(headers: &HeaderMap) -> Result<(), Problem> {
    for given in headers.get_all(header::CONTENT_ENCODING) {
        let given = String::from_utf8_lossy(given.as_bytes());
        if given
            .split(',')
            .any(|coding| !coding.trim().eq_ignore_ascii_case("identity"))
        {
            return Err(Problem::Coded(given.into_owned()));
        }
    }
    Ok(())
}

/// Refuses a declared length that is too long. A body without one is checked as it arrives.
fn require_short(headers: &HeaderMap) -> Result<(), Problem> {
    let announced = headers.get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    if announced.is_some_and(|length| BODY_BYTES_MAX < length) {
        return Err(Problem::TooLarge);
    }
    Ok(())
}
