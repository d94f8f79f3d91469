//! Answers whose length the client decides: events as they happen, and records.

use std::{
    io::{self, Write},
    sync::Arc,
    time::Duration,
};

use axum::{
    body::{Body, Bytes},
    http::{StatusCode, header},
    response::{
        IntoResponse, Response,
        sse::{Event as Sent, KeepAlive, Sse},
    },
};
use futures_util::stream::{self, Stream};
use serde_json::json;
use tokio::{
    runtime,
    sync::{
        broadcast::{Receiver, error::RecvError},
        mpsc,
    },
    task::spawn_blocking,
    time::timeout,
};

use super::{
    record::{self, Part, RecordError, RecordFormat},
    registry::Missions,
};
use crate::{access::By, problem::Problem, slots::Slot, store::StoredEvent};

/// Between two signs of life when nothing happens.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// When an `EventSource` should come again.
pub(crate) const RETRY: Duration = Duration::from_secs(1);

/// Events that are read from the store at once, for a client that was away: each may be over 100 kB.
const PAGE: usize = 4;

/// Pieces of a record on their way: with the size of one, what a slow reader costs.
const PIECES: usize = 4;
/// Size of a piece, bytes.
const PIECE: usize = 64 << 10;

/// How long the client of a record may leave a piece waiting.
const PATIENCE: Duration = Duration::from_secs(10);

/// A client that reads a mission's events.
struct Subscription {
    missions: Missions,
    number: u64,
    /// The last event that was sent.
    sent: u64,
    /// Read from the store, and not yet sent.
    page: std::vec::IntoIter<StoredEvent>,
    /// Whether the store may have more than was read.
    behind: bool,
    stream: Receiver<StoredEvent>,
    /// The event after a gap.
    kept: Option<StoredEvent>,
    _slot: Slot<Arc<str>>,
}

/// The events of the mission called `id` after the one numbered `after`, or from now on.
pub(super) async fn events(
    missions: Missions,
    by: &By,
    id: &str,
    after: Option<u64>,
) -> Result<Response, Problem> {
    let slot = missions.streams.take(by.name());
    let slot = slot.map_err(|none| missions.no_slot(none, "event streams"))?;
    let handle = missions.handle(id).await?;
    // Before the store is read, so that no event falls between the two.
    let stream = handle.events.upgrade().ok_or(Problem::NoMission)?.subscribe();
    drop(handle);
    let (number, mission) = missions.find(id).await?;
    let sent = after.unwrap_or(mission.sequence).min(mission.sequence);
    if mission.status.is_over() && mission.sequence <= sent {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let subscription = Subscription {
        missions,
        number,
        sent,
        page: vec![].into_iter(),
        behind: true,
        stream,
        kept: None,
        _slot: slot,
    };
    Ok(sent_to(sent_events(subscription)))
}

/// The answer that sends `events`, with signs of life between them.
pub(crate) fn sent_to(events: impl Stream<Item = io::Result<Sent>> + Send + 'static) -> Response {
    let alive = KeepAlive::new().interval(HEARTBEAT);
    Sse::new(events).keep_alive(alive).into_response()
}

/// What is sent. The next event is fetched when the connection has room for it.
fn sent_events(subscription: Subscription) -> impl Stream<Item = io::Result<Sent>> {
    stream::unfold(Some(subscription), async |subscription| {
        let mut subscription = subscription?;
        match subscription.next().await {
            Ok(Some((event, last))) => Some((Ok(event), (!last).then_some(subscription))),
            Ok(None) => None,
            // The answer has begun: it can only break off.
            Err(problem) => {
                tracing::warn!(?problem, "an event stream broke off");
                Some((Err(io::ErrorKind::Other.into()), None))
            }
        }
    })
}

impl Subscription {
    /// The next event, and whether it is the last one of the mission.
    async fn next(&mut self) -> Result<Option<(Sent, bool)>, Problem> {
        if let Some(event) = self.kept.take() {
            return Ok(Some(self.send(&event)));
        }
        loop {
            if let Some(event) = self.page.next() {
                return Ok(Some(self.send(&event)));
            }
            if self.behind {
                let (number, sent) = (self.number, self.sent);
                let page = self.missions.read(move |store| store.events(number, sent, PAGE));
                let page = page.await?;
                self.behind = page.len() == PAGE;
                self.page = page.into_iter();
                continue;
            }
            match self.stream.recv().await {
                Ok(event) if event.sequence <= self.sent => {}
                Ok(event) if event.sequence == self.sent + 1 => return Ok(Some(self.send(&event))),
                Ok(event) => {
                    let gap = json!({ "kind": "gap", "from": self.sent + 1, "to": event.sequence - 1 });
                    self.kept = Some(event);
                    // Without an id, so that a client that connects again gets what it missed.
                    let gap = Sent::default().event("gap").data(gap.to_string());
                    return Ok(Some((gap, false)));
                }
                // The number of the next event shows how many were missed.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return Ok(None),
            }
        }
    }

    fn send(&mut self, event: &StoredEvent) -> (Sent, bool) {
        self.sent = event.sequence;
        let sent = Sent::default()
            .id(event.sequence.to_string())
            .event(&event.kind)
            .retry(RETRY)
            .data(String::from_utf8_lossy(&event.body));
        (sent, matches!(event.kind.as_str(), "finished" | "failed"))
    }
}

/// The record of the mission called `id`.
pub(super) async fn record(
    missions: Missions,
    by: &By,
    id: &str,
    format: RecordFormat,
    part: Part,
) -> Result<Response, Problem> {
    let slot = missions.records.take(by.name());
    let slot = slot.map_err(|none| missions.no_slot(none, "records"))?;
    let (number, _) = missions.find(id).await?;
    let (pieces, mut written) = mpsc::channel(PIECES);
    let runtime = runtime::Handle::current();
    spawn_blocking(move || {
        let _slot = slot;
        let mut out = Pieces {
            client: pieces,
            runtime,
            piece: Vec::with_capacity(PIECE),
            patience: PATIENCE,
        };
        let done = missions
            .reader()
            .map_err(RecordError::from)
            .and_then(|reader| record::write(&reader, number, format, &part, &mut out));
        if let Err(error) = done.and_then(|()| Ok(out.finish()?)) {
            out.fail(error);
        }
    });
    // An error of the whole record comes before the first piece, and is answered as a problem.
    let first = match written.recv().await {
        Some(Err(RecordError::NoOrigin)) => {
            return Err(Problem::conflict(&RecordError::NoOrigin.to_string()));
        }
        Some(Err(RecordError::Log(error))) => return Err(error.into()),
        Some(Err(error)) => {
            tracing::error!(%error, "no record");
            return Err(Problem::Panicked);
        }
        first => first,
    };
    let name = format!("attachment; filename=\"{id}.{}\"", format.extension());
    let headers = [
        (header::CONTENT_TYPE, format.media_type().to_owned()),
        (header::CONTENT_DISPOSITION, name),
    ];
    Ok((headers, Body::from_stream(whole_or_broken_off(first, written))).into_response())
}

/// A piece of a record; the empty one after the last says that the record is whole.
type Piece = Result<Bytes, RecordError>;

/// The pieces up to the empty one. Without that the writer gave up, and the answer breaks off, so that no client takes
/// it for whole.
fn whole_or_broken_off(first: Option<Piece>, written: mpsc::Receiver<Piece>) -> impl Stream<Item = Piece> {
    stream::unfold(Some((first, written)), async |left| {
        let (first, mut written) = left?;
        let piece = match first {
            Some(piece) => Some(piece),
            None => written.recv().await,
        };
        match piece {
            Some(Ok(piece)) if piece.is_empty() => None,
            Some(Ok(piece)) => Some((Ok(piece), Some((None, written)))),
            Some(Err(error)) => Some((Err(error), None)),
            None => Some((Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()), None)),
        }
    })
}

/// Takes a record in pieces, which wait for the client. What the last piece holds is sent only when the record is whole:
/// an error before the first piece is answered as a problem.
struct Pieces {
    client: mpsc::Sender<Piece>,
    runtime: runtime::Handle,
    piece: Vec<u8>,
    /// How long the client may leave a piece waiting.
    patience: Duration,
}

impl Pieces {
    /// Marks the record as whole.
    fn finish(&mut self) -> io::Result<()> {
        self.flush()?;
        self.send(Bytes::new())
    }

    /// Sends the error, if there is room for it: a client that takes nothing is not waited for again.
    fn fail(&mut self, error: RecordError) {
        tracing::debug!(%error, "a record ended early");
        let _ = self.client.try_send(Err(error));
    }

    fn send(&mut self, piece: Bytes) -> io::Result<()> {
        let sent = timeout(self.patience, self.client.send(Ok(piece)));
        match self.runtime.block_on(sent) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(_) => Err(io::ErrorKind::TimedOut.into()),
        }
    }
}

impl Write for Pieces {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(PIECE - self.piece.len());
        self.piece.extend_from_slice(&bytes[..taken]);
        if self.piece.len() == PIECE {
            self.flush()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.piece.is_empty() {
            return Ok(());
        }
        let piece = std::mem::replace(&mut self.piece, Vec::with_capacity(PIECE));
        self.send(piece.into())
    }
}

#[cfg(test)]
mod tests {
    use futures_util::StreamExt as _;

    use super::*;

    /// Writes a little more than the pieces on their way hold, for a client that takes none of them in time, or all.
    async fn written(taken: bool) -> (io::Result<()>, Vec<Piece>) {
        let (client, written) = mpsc::channel(PIECES);
        let runtime = runtime::Handle::current();
        let patience = if taken {
            PATIENCE
        } else {
            Duration::from_millis(20)
        };
        let writer = spawn_blocking(move || {
            let mut out = Pieces {
                client,
                runtime,
                piece: vec![],
                patience,
            };
            let done = out
                .write_all(&vec![b'x'; (PIECES + 1) * PIECE + 1])
                .and_then(|()| out.finish());
            if done.is_err() {
                out.fail(io::Error::from(io::ErrorKind::TimedOut).into());
            }
            done
        });
        let take = async || whole_or_broken_off(None, written).collect().await;
        if taken {
            let (done, pieces) = tokio::join!(writer, take());
            (done.expect("does not panic"), pieces)
        } else {
            let done = writer.await.expect("does not panic");
            (done, take().await)
        }
    }

    #[tokio::test]
    async fn a_record_that_is_taken_ends_when_it_is_whole() {
        let (done, pieces) = written(true).await;
        done.expect("is taken");
        let bytes: usize = pieces
            .iter()
            .map(|piece| piece.as_ref().map_or(0, Bytes::len))
            .sum();
        assert_eq!(
            (pieces.iter().all(Result::is_ok), bytes),
            (true, (PIECES + 1) * PIECE + 1)
        );
    }

    #[tokio::test]
    async fn a_record_that_no_client_takes_is_given_up_at_once_and_does_not_look_whole() {
        let (done, pieces) = written(false).await;
        assert_eq!(
            done.expect_err("no client takes it").kind(),
            io::ErrorKind::TimedOut
        );
        assert_eq!(pieces.len(), PIECES + 1);
        assert!(pieces[PIECES].is_err());
    }
}
