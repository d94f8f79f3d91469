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
use wire::Unread;

/// Settings and memory for receiving bodies.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    clock: Clock,
    /// Longest time for a body to arrive.
    time_limit: Duration,
    /// One for plans and one for missions, so that neither uses the memory of the other.
    rooms: [Arc<Semaphore>; 2],
    metrics: Metrics,
}

impl Bodies {
    pub(crate) fn new(time_limit: Duration, metrics: Metrics, clock: Clock) -> Self {
        Self {
            clock,
            time_limit,
            rooms: [(); 2].map(|()| Arc::new(Semaphore::new(BODIES_KIB_MAX / 2))),
            metrics,
        }
    }
}

/// A body, not yet parsed: declared as JSON, or the file of [`AnyBytes`].
#[derive(Debug)]
pub(crate) struct JsonBytes {
    pub(crate) bytes: Vec<u8>,
    /// Held as long as the bytes.
    room: Option<OwnedSemaphorePermit>,
}

impl JsonBytes {
    pub(crate) fn read<T: DeserializeOwned>(self) -> Result<T, Problem> {
        read(&self.bytes)
    }

    /// Parses at most `most` items of its only member, `name`: each is a `T` or its error.
    pub(crate) fn read_each<T: DeserializeOwned>(
        self,
        name: &str,
        most: usize,
    ) -> Result<Vec<Result<T, Problem>>, Problem> {
        let items = wire::read_each(&self.bytes, name, most).map_err(Problem::from)?;
        Ok(items
            .into_iter()
            .map(|item| item.map_err(Problem::from))
            .collect())
    }
}

pub(crate) fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    wire::read(body).map_err(Problem::from)
}

impl From<Unread> for Problem {
    fn from(unread: Unread) -> Self {
        match unread {
            Unread::Syntax(error) => Self::Syntax(error),
            Unread::Misfit(error) => Self::Invalid(vec![*error]),
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
        received(request, &Bodies::from_ref(state)).await
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
        received(request, &Bodies::from_ref(state)).await.map(Self)
    }
}

async fn received(request: Request, bodies: &Bodies) -> Result<JsonBytes, Problem> {
    require_uncoded(request.headers())?;
    require_short(request.headers())?;
    let Bodies {
        clock,
        time_limit,
        rooms,
        metrics,
    } = bodies;
    let room = &rooms[usize::from(request.uri().path().starts_with("/v1/missions"))];
    let received = whole(request.into_body(), room).instrument(info_span!("receive"));
    let received = clock
        .timeout(*time_limit, received)
        .await
        .map_err(|_| Problem::BodyTimedOut(*time_limit))?;
    received.inspect_err(|problem| {
        if *problem == Problem::Overloaded {
            metrics.shed(Shed::Room);
        }
    })
}

/// Receives the whole body, and takes room for it as it arrives.
async fn whole(body: Body, room: &Arc<Semaphore>) -> Result<JsonBytes, Problem> {
    let mut received = JsonBytes {
        bytes: vec![],
        room: None,
    };
    let mut pieces = body.into_data_stream();
    let (mut taken, mut n_pieces) = (0, 0);
    while let Some(piece) = pieces.next().await {
        n_pieces += 1;
        if PIECES_MAX < n_pieces {
            return Err(Problem::InPieces(PIECES_MAX));
        }
        let piece = piece.map_err(|_| Problem::BodyUnreadable)?;
        received.bytes.extend_from_slice(&piece);
        if BODY_BYTES_MAX < received.bytes.len() {
            return Err(Problem::TooLarge);
        }
        // Short bodies take no room: the number of connections bounds them.
        let long = received.bytes.len().saturating_sub(SHORT_BYTES_MAX);
        let more = long.div_ceil(1 << 10) - taken;
        let more = u32::try_from(more).expect("a body is at most a MiB");
        let permit = Arc::clone(room).try_acquire_many_owned(more);
        let permit = permit.map_err(|_| Problem::Overloaded)?;
        taken += more as usize;
        match &mut received.room {
            Some(room) => room.merge(permit),
            none => *none = Some(permit),
        }
    }
    Ok(received)
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
