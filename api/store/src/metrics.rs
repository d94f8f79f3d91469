//! Counters of the event store, for the metrics of its service.

use std::time::Duration;

use prometheus_client::{
    metrics::{counter::Counter, gauge::Gauge, histogram::Histogram},
    registry::Registry,
};

/// Bounds of commit times, from a quick commit to a client's timeout, s.
const SECONDS: [f64; 14] = [5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0];

/// Counters of the mission log. Clones share them.
#[derive(Clone, Debug)]
pub struct StoreMetrics {
    commits: Histogram,
    failures: Counter,
    events: Counter,
    bytes: Counter,
    free: Gauge,
}

impl Default for StoreMetrics {
    fn default() -> Self {
        Self {
            commits: Histogram::new(SECONDS),
            failures: Counter::default(),
            events: Counter::default(),
            bytes: Counter::default(),
            free: Gauge::default(),
        }
    }
}

impl StoreMetrics {
    /// Adds the counters to `registry`.
    pub fn register(&self, registry: &mut Registry) {
        let all = self.clone();
        let help = "Time of a commit of the mission log";
        registry.register("store_commit_duration_seconds", help, all.commits);
        registry.register("store_commit_failures", "Commits that failed", all.failures);
        registry.register("store_events", "Events stored", all.events);
        let help = "Bytes of what was stored and stays: events and answers";
        registry.register("store_bytes", help, all.bytes);
        let help = "Bytes that are free on the disk of the mission log, if it is this machine's";
        registry.register("store_free_bytes", help, all.free);
    }

    /// Counts a commit: its duration, and the events and bytes that it stored; `None` if it failed.
    pub(crate) fn committed(&self, took: Duration, stored: Option<(usize, u64)>) {
        self.commits.observe(took.as_secs_f64());
        let Some((n_events, n_bytes)) = stored else {
            self.failures.inc();
            return;
        };
        self.events.inc_by(n_events as u64);
        self.bytes.inc_by(n_bytes);
    }

    /// Sets the free bytes. Returns the bytes stored so far.
    pub(crate) fn free(&self, bytes: u64) -> u64 {
        self.free.set(i64::try_from(bytes).unwrap_or(i64::MAX));
        self.bytes.get()
    }
}
