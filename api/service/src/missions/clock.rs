//! The clock of a live mission.

use std::time::{SystemTime, UNIX_EPOCH};

use wire::mission::Live;

/// Unix time, or the clock of a rehearsal, which is faster from the moment on when the mission was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// When the mission was made, Unix time, s.
    pub(super) created: f64,
    /// Seconds of this clock in one.
    pub(super) rate: f64,
}

impl Clock {
    /// The clock of a mission that was made at `created`, Unix time, s; of a simulated one, Unix time.
    pub(super) fn new(created: f64, live: Option<&Live>) -> Self {
        let rate = live.map_or(1.0, |live| live.clock_rate);
        Self { created, rate }
    }

    /// What it shows now, s.
    pub(super) fn now(&self) -> f64 {
        self.at(unix_now())
    }

    /// What it shows at a Unix time, s.
    pub(super) fn at(&self, unix: f64) -> f64 {
        self.created + self.rate * (unix - self.created)
    }
}

/// Time since 1970, s.
pub(super) fn unix_now() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64())
}
