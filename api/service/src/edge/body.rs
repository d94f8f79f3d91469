//! Request bodies: JSON, within a time limit and shared memory. Each rejection is a [`Problem`].

use std::{sync::Arc, time::Duration};

use axum::body::Body;
use axum::extract::{FromRef, FromRequest, Request};
use axum::http::{HeaderMap, header};
use clock::Clock;
use futures_util::StreamExt as _;
use serde::de::DeserializeOwned;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tracing::{Instrument as _, info_span};

use crate::edge::problem::Problem;
use crate::limits::{BODIES_KIB_MAX, BODY_BYTES_MAX, PIECES_MAX, SHORT_BYTES_MAX};
use crate::metrics::{Metrics, Shed};
use wire::BodyError;

#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    clock: Clock,
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

    /// Receives a body of any content type.
    pub(crate) async fn receive(&self, request: Request) -> Result<BodyBytes, Problem> {
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

/// A body, not yet parsed. As an argument of a handler it is declared as JSON.
#[derive(Debug)]
pub(crate) struct BodyBytes {
    pub(crate) bytes: Vec<u8>,
    /// The memory of a long body, held as long as its bytes.
    _permit: Option<OwnedSemaphorePermit>,
}

impl BodyBytes {
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

impl<S: Send + Sync> FromRequest<S> for BodyBytes
where
    Bodies: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        require_json(request.headers())?;
        Bodies::from_ref(state).receive(request).await
    }
}

/// Receives the whole body, and takes memory for it as it arrives.
async fn whole(body: Body, memory: &Arc<Semaphore>) -> Result<BodyBytes, Problem> {
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
    Ok(BodyBytes { bytes, _permit: permit })
}

fn require_json(headers: &HeaderMap) -> Result<(), Problem> {
    let given = headers.get(header::CONTENT_TYPE).ok_or_else(|| Problem::NotJson(String::new()))?;
    let given = String::from_utf8_lossy(given.as_bytes()).into_owned();
    let essence = given.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    if essence != "application/json" && !(essence.starts_with("application/") && essence.ends_with("+json")) {
        return Err(Problem::NotJson(format!(", not {given}")));
    }
    require_utf8(&given)
}

fn require_utf8(content_type: &str) -> Result<(), Problem> {
    let is_other = |parameter: &str| {
        let parameter = parameter.trim().to_ascii_lowercase();
        let charset = parameter.strip_prefix("charset=");
        charset.is_some_and(|name| name.trim_matches('"') != "utf-8")
    };
    if content_type.split(';').skip(1).any(is_other) {
        return Err(Problem::NotUtf8(content_type.to_owned()));
    }
    Ok(())
}

fn require_uncoded(headers: &HeaderMap) -> Result<(), Problem> {
    for given in headers.get_all(header::CONTENT_ENCODING) {
        let given = String::from_utf8_lossy(given.as_bytes());
        let is_plain = |coding: &str| coding.trim().eq_ignore_ascii_case("identity");
        if !given.split(',').all(is_plain) {
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
