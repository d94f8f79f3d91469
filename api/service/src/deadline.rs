//! When an answer is due, and what that leaves to the solver. All clocks of the planning path are here.

use std::time::{Duration, Instant};

use planner::stop::Stop;

/// Kept from the solver: the iteration that it is in when it looks at the clock, the check of its last answer,
/// and the writing of that answer.
const RESERVE: Duration = Duration::from_millis(1);

/// When a request's head had been read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival(pub(crate) Instant);

/// When an answer is due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadline(Instant);

impl Deadline {
    /// The sooner of the client's wish, ms, and the service's own limit.
    pub(crate) fn new(Arrival(arrival): Arrival, wish_ms: Option<f64>, limit: Duration) -> Self {
        let wish = wish_ms.map_or(limit, |ms| Duration::from_secs_f64(1e-3 * ms));
        Self(arrival + wish.min(limit))
    }

    /// When to give up waiting for the solver, even if it does not stop.
    pub(crate) fn instant(self) -> Instant {
        self.0
    }

    /// The deadline of what an answer can be without: half of the time that is left.
    pub(crate) fn half_way(self) -> Self {
        let now = Instant::now();
        Self(now + self.0.saturating_duration_since(now) / 2)
    }

    /// When the solver should stop by itself.
    pub(crate) fn stop(self) -> Stop {
        let at = self.0.checked_sub(RESERVE).unwrap_or(self.0);
        Stop::when(move || at <= Instant::now())
    }
}
