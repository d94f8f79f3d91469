//! Waits for a future on any thread, within or without a runtime, for a limited time.

use std::{
    pin::pin,
    sync::Arc,
    task::{Context, Poll, Wake, Waker},
    thread::{self, Thread},
    time::Instant,
};

struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// The output of `future`; none if it is not there by `end`.
///
/// A connection to the database may hang for as long as TCP tries. Tokio's own time limits work only within its runtime, where
/// blocking is forbidden.
pub(super) fn wait_until<F: Future>(future: F, end: Instant) -> Option<F::Output> {
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

#[cfg(test)]
mod tests {
    use std::{future::pending, time::Duration};

    use super::*;

    #[tokio::test]
    async fn a_future_is_waited_for_within_a_runtime_and_given_up_at_its_end() {
        let (sender, receiver) = tokio::sync::oneshot::channel();
        thread::spawn(move || sender.send(7));
        let end = Instant::now() + Duration::from_secs(10);
        assert_eq!(wait_until(receiver, end), Some(Ok(7)));
        let start = Instant::now();
        assert_eq!(
            wait_until(pending::<()>(), start + Duration::from_millis(20)),
            None
        );
        assert!(Duration::from_millis(20) <= start.elapsed());
    }
}
