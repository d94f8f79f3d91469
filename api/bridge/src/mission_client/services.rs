//! Services that share their missions: after no answer the client goes to the next one.

use std::sync::atomic::{AtomicUsize, Ordering};

/// The services, and which of them is asked.
#[derive(Debug)]
pub(super) struct Services {
    urls: Vec<String>,
    asked: AtomicUsize,
}

impl Services {
    /// The first of `urls` is asked first.
    ///
    /// # Panics
    /// If there is none.
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

    /// Moves on to the next service, because `silent` does not answer. Does nothing if another task has already moved on.
    pub(super) fn leave(&self, silent: usize) {
        let next = (silent + 1) % self.urls.len();
        let left = self
            .asked
            .compare_exchange(silent, next, Ordering::Relaxed, Ordering::Relaxed);
        if left.is_ok() && next != silent {
            // The status line says that a service does not answer; several that are away would fill the log.
            tracing::debug!(
                from = self.urls[silent],
                to = self.urls[next],
                "asks the next service"
            );
        }
    }
}
