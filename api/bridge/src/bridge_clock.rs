//! The clock of a bridge.

use std::time::Instant;

use clock::Clock;

/// Seconds since the bridge's start. Unlike the machine's wall clock it is never set.
#[derive(Clone, Debug)]
pub(crate) struct BridgeClock {
    pub(crate) machine: Clock,
    start: Instant,
}

impl BridgeClock {
    pub(crate) fn start(machine: &Clock) -> Self {
        Self { machine: machine.clone(), start: machine.now() }
    }

    pub(crate) fn now_s(&self) -> f64 {
        self.machine.since(self.start).as_secs_f64()
    }

    pub(crate) fn at_s(&self, at: Instant) -> f64 {
        at.saturating_duration_since(self.start).as_secs_f64()
    }

    /// Unix time of `t_s` on this clock, by the machine's clock now, s.
    pub(crate) fn unix_s(&self, t_s: f64) -> f64 {
        self.machine.unix_s() + (t_s - self.now_s())
    }
}
