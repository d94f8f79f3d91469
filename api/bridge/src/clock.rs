//! The clock of a bridge.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Seconds since the bridge's start. Unlike the machine's clock it is never set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    start: Instant,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self {
            start: Instant::now(),
        }
    }

    /// s since the start.
    pub(crate) fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    pub(crate) fn at_s(&self, at: Instant) -> f64 {
        at.saturating_duration_since(self.start).as_secs_f64()
    }

    /// Unix time of `t_s` on this clock, by the machine's clock now, s.
    pub(crate) fn unix_s(&self, t_s: f64) -> f64 {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH);
        unix.map_or(0.0, |since| since.as_secs_f64()) + (t_s - self.now_s())
    }
}
