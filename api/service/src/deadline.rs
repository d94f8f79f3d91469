//! The deadline of an answer, and the time that the solver gets.

use std::time::{Duration, Instant};

use clock::Clock;
use planner::stop::Stop;

/// Time reserved after the solver stops: its current iteration, the check of its last answer, and the writing of the answer.
const RESERVE: Duration = Duration::from_millis(1);

/// When the head of a request was read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival(pub(crate) Instant);

/// When an answer is due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadline(Instant);

impl Deadline {
    /// The earlier of the client's deadline, ms, and the service's limit.
    pub(crate) fn new(Arrival(arrival): Arrival, wish_ms: Option<f64>, limit: Duration) -> Self {
        let wish = wish_ms.map_or(limit, |ms| Duration::from_secs_f64(1e-3 * ms));
        Self(arrival + wish.min(limit))
    }

    /// When to stop waiting for the solver, even if it goes on.
    pub(crate) fn instant(self) -> Instant {
        self.0
    }

    /// The deadline of an optional part of the answer: half of the remaining time.
    pub(crate) fn half_way(self, clock: &Clock) -> Self {
        let now = clock.now();
        Self(now + self.0.saturating_duration_since(now) / 2)
    }

    /// When the solver should stop.
    pub(crate) fn stop(self, clock: &Clock) -> Stop {
        let at = self.0.checked_sub(RESERVE).unwrap_or(self.0);
        let clock = clock.clone();
        Stop::when(move || at <= clock.now())
    }
}
