//! Services that share their missions: the client leaves a silent one for the next.

use std::sync::atomic::{AtomicUsize, Ordering};

/// The services, and the one in use.
#[derive(Debug)]
pub(super) struct Services {
    urls: Vec<String>,
    asked: AtomicUsize,
}

impl Services {
    /// The first of `urls` is asked first.
    ///
    /// # Panics
    /// If `urls` is empty.
    pub(super) fn new(urls: &[String]) -> Self {
        assert!(!urls.is_empty(), "a client needs a service");
        let urls = urls.iter().map(|url| url.trim_end_matches('/').to_owned());
        Self {
            urls: urls.collect(),
            asked: AtomicUsize::new(0),
        }
    }

    /// The number and the URL of the service to ask.
    pub(super) fn asked(&self) -> (usize, &str) {
        let asked = self.asked.load(Ordering::Relaxed);
        (asked, &self.urls[asked])
    }

    /// Leaves the `silent` service for the next one, unless another task has done so.
    pub(super) fn leave(&self, silent: usize) {
        let next = (silent + 1) % self.urls.len();
        let left = self
            .asked
            .compare_exchange(silent, next, Ordering::Relaxed, Ordering::Relaxed);
        if left.is_ok() && next != silent {
            // The status line tells it; several absent services would fill the log.
            tracing::debug!(
                from = self.urls[silent],
                to = self.urls[next],
                "asks the next service"
            );
        }
    }
}
