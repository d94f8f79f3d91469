//! Streamed answers: events as they happen, and records.

#![expect(
    clippy::disallowed_methods,
    reason = "a record is written on a thread that waits for its client: simulated time does not pass meanwhile"
)]

use std::io::{self, Write};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use ::record::ExportError;
use axum::{
    body::{Body, Bytes},
    http::{StatusCode, header},
    response::{
        IntoResponse, Response,
        sse::{Event as SseEvent, KeepAlive, Sse},
    },
};
use futures_util::stream::{self, Stream};
use serde_json::json;
use tokio::runtime;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use super::record::{self, EventFilter, RecordError, RecordFormat};
use super::registry::Missions;
use store::StoredEvent;

use crate::{
    edge::{access::By, problem::Problem, quota::QuotaPermit},
    limits::{CHUNK, CHUNK_TIME, CHUNKS},
    planning::pool::lower_priority,
};

/// Time between two keep-alive comments when nothing happens.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// Time after which an `EventSource` should reconnect.
const RETRY: Duration = Duration::from_secs(1);

/// Events read from the store at once, for a client that was away: each may exceed 100 kB.
const PAGE: usize = 4;

struct Subscription {
    missions: Missions,
    number: u64,
    /// The last event that was sent.
    sent: u64,
    /// Events read from the store and not yet sent.
    page: std::vec::IntoIter<StoredEvent>,
    /// `true` if the store may have more events.
    behind: bool,
    stream: Receiver<StoredEvent>,
    /// Incarnation of this service when it had the mission.
    incarnation: u64,
    after_gap: Option<StoredEvent>,
    _permit: QuotaPermit<Arc<str>>,
}

/// The events of the mission `id` after the one numbered `after`, or from now on.
pub(super) async fn events(
    missions: Missions,
    by: &By,
    id: &str,
    after: Option<u64>,
) -> Result<Response, Problem> {
    let permit = missions.streams.take(by.name(), 1);
    let permit = permit.map_err(|exceeded| missions.quota_exceeded(exceeded, "event streams"))?;
    let handle = missions.handle(id).await?;
    // Subscribed before the store is read, so that no event falls between the two.
    let stream = handle.events.upgrade().ok_or(Problem::Behind)?.subscribe();
    let incarnation = handle.ownership.incarnation;
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
        incarnation,
        after_gap: None,
        _permit: permit,
    };
    let alive = KeepAlive::new().interval(HEARTBEAT);
    let events = Sse::new(sent_events(subscription)).keep_alive(alive);
    Ok(events.into_response())
}

/// The events to send. Each is fetched when the connection has room for it.
fn sent_events(subscription: Subscription) -> impl Stream<Item = io::Result<SseEvent>> {
    stream::unfold(Some(subscription), async |subscription| {
        let mut subscription = subscription?;
        match subscription.next().await {
            Ok(Some((event, last))) => Some((Ok(event), (!last).then_some(subscription))),
            Ok(None) => None,
            // The answer has begun: it can only be cut off.
            Err(problem) => {
                tracing::warn!(?problem, "an event stream was cut off");
                Some((Err(io::ErrorKind::Other.into()), None))
            }
        }
    })
}

impl Subscription {
    /// The next event, and `true` with the mission's last.
    async fn next(&mut self) -> Result<Option<(SseEvent, bool)>, Problem> {
        if let Some(event) = self.after_gap.take() {
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
            let event = tokio::select! {
                event = self.stream.recv() => event,
                problem = self.missions.lost(self.incarnation) => return Err(problem),
            };
            match event {
                Ok(event) if event.sequence <= self.sent => {}
                Ok(event) if event.sequence == self.sent + 1 => return Ok(Some(self.send(&event))),
                Ok(event) => {
                    let gap = json!({ "kind": "gap", "from": self.sent + 1, "to": event.sequence - 1 });
                    self.after_gap = Some(event);
                    // Without an id: a client that reconnects gets what it missed.
                    let gap = SseEvent::default().event("gap").data(gap.to_string());
                    return Ok(Some((gap, false)));
                }
                // The number of the next event shows how many were missed.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return Ok(None),
            }
        }
    }

    fn send(&mut self, event: &StoredEvent) -> (SseEvent, bool) {
        self.sent = event.sequence;
        let sent = SseEvent::default()
            .id(event.sequence.to_string())
            .event(&event.kind)
            .retry(RETRY)
            .data(String::from_utf8_lossy(&event.body));
        (sent, matches!(event.kind.as_str(), "finished" | "failed"))
    }
}

pub(super) async fn record(
    missions: Missions,
    by: &By,
    id: &str,
    format: RecordFormat,
    filter: EventFilter,
) -> Result<Response, Problem> {
    let permit = missions.records.take(by.name(), 1);
    let permit = permit.map_err(|exceeded| missions.quota_exceeded(exceeded, "records"))?;
    let (number, _) = missions.find(id).await?;
    let (chunks, mut written) = mpsc::channel(CHUNKS);
    let runtime = runtime::Handle::current();
    let is_simulated = missions.clock().is_simulated();
    let write = move || {
        let _permit = permit;
        let mut out =
            ChunkWriter { client: chunks, runtime, chunk: Vec::with_capacity(CHUNK), patience: CHUNK_TIME };
        let mut whole = || -> Result<(), RecordError> {
            record::write(&missions.store.reader()?, number, format, &filter, &mut out)?;
            Ok(out.finish()?)
        };
        if let Err(error) = whole() {
            out.fail(error);
        }
    };
    if is_simulated {
        spawn_blocking(write);
    } else {
        // A thread of its own, because missions plan on Tokio's threads too.
        let thread = thread::Builder::new().name("record".to_owned());
        let started = thread.spawn(move || {
            lower_priority();
            write();
        });
        started.map_err(|_| Problem::Overloaded)?;
    }
    // An error before the first chunk is answered as a problem.
    let first = match written.recv().await {
        Some(Err(error @ (RecordError::NoOrigin | RecordError::Export(ExportError::LeftOut(_))))) => {
            return Err(Problem::conflict(&error.to_string()));
        }
        Some(Err(RecordError::Log(error))) => return Err(error.into()),
        Some(Err(error)) => {
            tracing::error!(%error, "a record failed");
            return Err(Problem::Panicked);
        }
        first => first,
    };
    let name = format!("attachment; filename=\"{id}.{}\"", format.extension());
    let headers =
        [(header::CONTENT_TYPE, format.media_type().to_owned()), (header::CONTENT_DISPOSITION, name)];
    Ok((headers, Body::from_stream(complete_or_cut_off(first, written))).into_response())
}

/// A chunk of a record. An empty one marks the end of a complete record.
type Chunk = Result<Bytes, RecordError>;

/// The chunks up to the empty one. Without it the writer has failed, and the answer is cut off: the
/// client notices that it is incomplete.
fn complete_or_cut_off(first: Option<Chunk>, written: mpsc::Receiver<Chunk>) -> impl Stream<Item = Chunk> {
    stream::unfold(Some((first, written)), async |left| {
        let (first, mut written) = left?;
        let chunk = match first {
            Some(chunk) => Some(chunk),
            None => written.recv().await,
        };
        match chunk {
            Some(Ok(chunk)) if chunk.is_empty() => None,
            Some(Ok(chunk)) => Some((Ok(chunk), Some((None, written)))),
            Some(Err(error)) => Some((Err(error), None)),
            None => Some((Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()), None)),
        }
    })
}

/// Sends the written bytes in chunks, which wait for the client. The last chunk is sent only when
/// the record is complete, so that an error before the first chunk is answered as a problem.
struct ChunkWriter {
    client: mpsc::Sender<Chunk>,
    runtime: runtime::Handle,
    chunk: Vec<u8>,
    /// Longest time for which the client may leave a chunk waiting.
    patience: Duration,
}

impl ChunkWriter {
    /// Marks the record as complete.
    fn finish(&mut self) -> io::Result<()> {
        self.flush()?;
        self.send(Bytes::new())
    }

    /// Sends the error if there is room; it does not wait for a client that reads nothing.
    fn fail(&mut self, error: RecordError) {
        tracing::debug!(%error, "a record ended early");
        let _ = self.client.try_send(Err(error));
    }

    fn send(&mut self, chunk: Bytes) -> io::Result<()> {
        // The timer is made inside, because the thread has no runtime of its own.
        let sent = async { timeout(self.patience, self.client.send(Ok(chunk))).await };
        match self.runtime.block_on(sent) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(_) => Err(io::ErrorKind::TimedOut.into()),
        }
    }
}

impl Write for ChunkWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(CHUNK - self.chunk.len());
        self.chunk.extend_from_slice(&bytes[..taken]);
        if self.chunk.len() == CHUNK {
            self.flush()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let chunk = std::mem::replace(&mut self.chunk, Vec::with_capacity(CHUNK));
        self.send(chunk.into())
    }
}

#[cfg(test)]
mod tests {
    use futures_util::StreamExt as _;

    use super::*;

    /// Writes more than the chunks in transit hold, for a client that reads all of them or none.
    async fn written(taken: bool) -> (io::Result<()>, Vec<Chunk>) {
        let (client, written) = mpsc::channel(CHUNKS);
        let runtime = runtime::Handle::current();
        // Simulated time does not pass while a blocking thread works.
        let patience = if taken { CHUNK_TIME } else { Duration::ZERO };
        let writer = spawn_blocking(move || {
            let mut out = ChunkWriter { client, runtime, chunk: vec![], patience };
            let done = out.write_all(&vec![b'x'; (CHUNKS + 1) * CHUNK + 1]).and_then(|()| out.finish());
            if done.is_err() {
                out.fail(io::Error::from(io::ErrorKind::TimedOut).into());
            }
            done
        });
        let take = async || complete_or_cut_off(None, written).collect().await;
        if taken {
            let (done, chunks) = tokio::join!(writer, take());
            (done.expect("does not panic"), chunks)
        } else {
            let done = writer.await.expect("does not panic");
            (done, take().await)
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_record_that_is_read_ends_when_it_is_complete() {
        let (done, chunks) = written(true).await;
        done.expect("is taken");
        let bytes: usize = chunks.iter().map(|chunk| chunk.as_ref().map_or(0, Bytes::len)).sum();
        assert_eq!((chunks.iter().all(Result::is_ok), bytes), (true, (CHUNKS + 1) * CHUNK + 1));
    }

    #[tokio::test(start_paused = true)]
    async fn a_record_that_no_client_reads_is_abandoned_and_looks_incomplete() {
        let (done, chunks) = written(false).await;
        assert_eq!(done.expect_err("no client takes it").kind(), io::ErrorKind::TimedOut);
        assert_eq!(chunks.len(), CHUNKS + 1);
        assert!(chunks[CHUNKS].is_err());
    }
}
