//! The deadline of an answer, and the solver's time.

use std::time::{Duration, Instant};

use clock::Clock;
use planner::stop::Stop;
use wire::DEADLINE_MS;

use crate::{edge::arrival::Arrival, planning::pool::Caller};

/// Time after the solver stops: its last iteration, the check and the writing of the answer.
const RESERVE: Duration = Duration::from_millis(1);

/// Time when an answer is due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadline(Instant);

impl Deadline {
    /// The earlier of the service's limit and a valid deadline of the client, ms.
    pub(crate) fn new(Arrival(arrival): Arrival, wish_ms: Option<f64>, limit: Duration) -> Self {
        let wish_ms = wish_ms.filter(|ms| DEADLINE_MS.contains(ms));
        let wish = wish_ms.map_or(limit, |ms| Duration::from_secs_f64(1e-3 * ms));
        Self(arrival + wish.min(limit))
    }

    /// The end of the wait for the solver, even if it continues.
    pub(crate) fn instant(self) -> Instant {
        self.0
    }

    /// The deadline of one of `parts` equal parts of the remaining work.
    pub(crate) fn share(self, clock: &Clock, parts: usize) -> Self {
        let (now, parts) = (clock.now(), u32::try_from(parts).unwrap_or(u32::MAX));
        Self(now + self.0.saturating_duration_since(now) / parts)
    }

    /// The stop signal of the work: at the deadline, or when the caller is gone.
    pub(crate) fn stop(self, clock: &Clock, caller: Caller) -> Stop {
        let at = self.0.checked_sub(RESERVE).unwrap_or(self.0);
        let clock = clock.clone();
        Stop::when(move || at <= clock.now() || caller.is_gone())
    }
}
