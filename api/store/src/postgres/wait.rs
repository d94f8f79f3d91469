//! Waits for answers of the database, within or without a runtime, for a limited time.

#![expect(
    clippy::disallowed_methods,
    reason = "answers come from a socket in real time: no simulated clock decides when"
)]

use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, MutexGuard};

struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// The output of `future`; none if it takes longer than `limit`.
///
/// A connection may hang for as long as TCP tries. Tokio's own time limits need its runtime, where
/// blocking is forbidden.
pub(super) fn wait_for<F: Future>(future: F, limit: Duration) -> Option<F::Output> {
    let end = Instant::now() + limit;
    let mut future = pin!(future);
    let waker = Waker::from(Arc::new(Unpark(thread::current())));
    let mut context = Context::from_waker(&waker);
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return Some(output);
        }
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        thread::park_timeout(left);
    }
}

/// Waits for `changed` until `condition` is false; none if it is still true after `limit`.
pub(super) fn wait_while<'a, T>(
    changed: &Condvar,
    mut guard: MutexGuard<'a, T>,
    limit: Duration,
    condition: impl FnMut(&mut T) -> bool,
) -> Option<MutexGuard<'a, T>> {
    let waited = changed.wait_while_for(&mut guard, condition, limit);
    (!waited.timed_out()).then_some(guard)
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use super::*;

    #[tokio::test]
    async fn a_wait_works_within_a_runtime_and_ends_at_its_limit() {
        let (sender, receiver) = tokio::sync::oneshot::channel();
        thread::spawn(move || sender.send(7));
        assert_eq!(wait_for(receiver, Duration::from_mins(10)), Some(Ok(7)));
        assert_eq!(wait_for(pending::<()>(), Duration::from_millis(20)), None);
    }
}
