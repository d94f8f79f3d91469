//! The body of an answer on its way to the client: its memory, and the reasons that end it.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Error;
use axum::body::{Body, Bytes, HttpBody, to_bytes};
use clock::Clock;
use http_body::{Frame, SizeHint};
use tokio::time::Interval;

use crate::edge::problem::Problem;
use crate::edge::quota::{Quota, QuotaExceeded, QuotaPermit};
use crate::edge::slots::ActiveRequest;
use crate::limits::{ANSWERS_KIB_MAX, SHORT_BYTES_MAX};

/// Time between two checks of a waiting caller. With the rereading of tokens, less than a second.
const CHECK: Duration = Duration::from_millis(400);

/// Memory for answers on their way, shared by callers. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct AnswerMemory(Quota<Arc<str>>);

/// `true` while the caller of an answer may have it.
pub(crate) type StillAllowed = Box<dyn Fn() -> bool + Send + Sync>;

/// Waits until the caller may no longer have an answer.
pub(crate) async fn no_longer(still_allowed: &StillAllowed, clock: &Clock) {
    loop {
        clock.sleep(CHECK).await;
        if !still_allowed() {
            return;
        }
    }
}

impl AnswerMemory {
    pub(crate) fn new() -> Self {
        Self(Quota::new(ANSWERS_KIB_MAX))
    }

    /// The same body, which takes memory until it is sent. Fails without memory for `caller`.
    pub(crate) async fn hold(&self, caller: Arc<str>, body: Body) -> Result<Body, Problem> {
        let length = body.size_hint().exact();
        let length = length.and_then(|length| usize::try_from(length).ok());
        let Some(length) = length.filter(|length| SHORT_BYTES_MAX < *length) else {
            return Ok(body);
        };
        let what = "KiB of long answers on their way";
        let permit = self.0.take(caller, length.div_ceil(1 << 10));
        let permit = permit.map_err(|exceeded| {
            let (QuotaExceeded::OfAll(limit) | QuotaExceeded::OfClient(limit)) = exceeded;
            Problem::Crowded { what, limit }
        })?;
        let bytes = to_bytes(body, length).await.map_err(|_| Problem::Panicked)?;
        Ok(Body::from(Bytes::from_owner(HeldBytes { bytes, _permit: permit })))
    }
}

/// Bytes that take memory. The connection drops them when they are sent.
struct HeldBytes {
    bytes: Bytes,
    _permit: QuotaPermit<Arc<str>>,
}

impl AsRef<[u8]> for HeldBytes {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

/// A body that ends when its caller's permission ends.
pub(crate) struct Answer {
    body: Body,
    /// Marks the connection as in use.
    _request: Option<ActiveRequest>,
    check: Option<(Interval, StillAllowed)>,
}

impl Answer {
    /// Cuts off a streamed body when its caller is no longer allowed. Other bodies stay whole.
    pub(crate) fn body(
        body: Body,
        request: Option<ActiveRequest>,
        still_allowed: Option<StillAllowed>,
        clock: &Clock,
    ) -> Body {
        let streamed = body.size_hint().exact().is_none();
        let check = still_allowed.filter(|_| streamed);
        let check = check.map(|still_allowed| (clock.every(CHECK), still_allowed));
        Body::new(Self { body, _request: request, check })
    }
}

impl HttpBody for Answer {
    type Data = Bytes;
    type Error = Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Error>>> {
        if let Some((ticks, still_allowed)) = &mut self.check {
            while ticks.poll_tick(context).is_ready() {
                if !still_allowed() {
                    tracing::info!("a stream was cut off: its caller's token is no longer valid");
                    return Poll::Ready(Some(Err(Error::new("the caller's token is no longer valid"))));
                }
            }
        }
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use futures_util::{StreamExt as _, stream};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn long_answers_take_room_until_they_are_sent_and_leave_half_to_other_callers() {
        let memory = AnswerMemory::new();
        let long = || Body::from(vec![b'x'; 1 << 20]);
        let hold = async |caller: &str| memory.hold(caller.into(), long()).await;
        let mut held = vec![];
        while let Ok(body) = hold("greedy").await {
            held.push(to_bytes(body, 1 << 20).await.expect("is in memory"));
        }
        assert_eq!(held.len(), ANSWERS_KIB_MAX / 1024 / 2);
        let refused = hold("greedy").await.expect_err("has its share");
        assert!(matches!(refused, Problem::Crowded { .. }), "{refused:?}");
        assert!(hold("another").await.is_ok());
        let short = Body::from(vec![b'x'; SHORT_BYTES_MAX]);
        assert!(memory.hold("greedy".into(), short).await.is_ok());
        held.pop();
        assert!(hold("greedy").await.is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn a_stream_ends_with_its_caller_s_permission_and_a_whole_answer_stays_whole() {
        let allowed = Arc::new(AtomicBool::new(true));
        let still_allowed = || -> StillAllowed {
            let allowed = Arc::clone(&allowed);
            Box::new(move || allowed.load(Ordering::Relaxed))
        };
        let clock = Clock::simulated(0.0);
        let first = stream::iter([Ok::<_, Error>(Bytes::from("first"))]).chain(stream::pending());
        let mut streamed =
            Answer::body(Body::from_stream(first), None, Some(still_allowed()), &clock).into_data_stream();
        let whole = Answer::body(Body::from("whole"), None, Some(still_allowed()), &clock);
        assert_eq!(streamed.next().await.expect("comes").expect("is allowed"), "first");
        let waited = clock.timeout(3 * CHECK, streamed.next()).await;
        assert!(waited.is_err(), "is allowed");
        allowed.store(false, Ordering::Relaxed);
        assert!(streamed.next().await.expect("ends with an error").is_err());
        assert_eq!(to_bytes(whole, 5).await.expect("is whole"), "whole");
    }
}
