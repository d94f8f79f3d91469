//! What the event store counts, for the metrics of its service.

use std::time::Duration;

use prometheus_client::{
    metrics::{counter::Counter, histogram::Histogram},
    registry::Registry,
};

/// Times from that of a quick commit to that after which clients have gone away, s.
const SECONDS: [f64; 14] = [
    5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0,
];

/// Counters of the mission log. Clones share them.
#[derive(Clone, Debug)]
pub struct StoreMetrics {
    commits: Histogram,
    failures: Counter,
    events: Counter,
}

impl Default for StoreMetrics {
    fn default() -> Self {
        Self {
            commits: Histogram::new(SECONDS),
            failures: Counter::default(),
            events: Counter::default(),
        }
    }
}

impl StoreMetrics {
    /// Adds the counters to `registry`.
    pub fn register(&self, registry: &mut Registry) {
        let Self {
            commits,
            failures,
            events,
        } = self.clone();
        registry.register(
            "store_commit_duration_seconds",
            "Time of a commit of the mission log",
            commits,
        );
        registry.register("store_commit_failures", "Commits that failed", failures);
        registry.register("store_events", "Events stored", events);
    }

    /// Counts a commit: its time, and the number of events it stored; `None` if it failed.
    pub(crate) fn committed(&self, took: Duration, n_events: Option<usize>) {
        self.commits.observe(took.as_secs_f64());
        let _before = match n_events {
            Some(n) => self.events.inc_by(n as u64),
            None => self.failures.inc(),
        };
    }
}
