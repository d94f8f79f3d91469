//! The clock of a live mission.

use std::time::Instant;

use wire::mission::Live;

use crate::unix_time::unix_now;

/// Least step by which a clock counts as set, s: reports that are ahead by more are refused.
const SET_MIN: f64 = 1.0;

/// Unix time, or the clock of a rehearsal, which runs faster from the creation of the mission on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// When the mission was created, Unix time, s.
    pub(super) created: f64,
    /// Seconds of this clock in one second.
    pub(super) rate: f64,
}

impl Clock {
    /// The clock of a mission created at `created`, Unix time, s. For a simulated mission it is Unix time.
    pub(super) fn new(created: f64, live: Option<&Live>) -> Self {
        let rate = live.map_or(1.0, |live| live.clock_rate);
        Self { created, rate }
    }

    /// The time now, s.
    pub(super) fn now(&self) -> f64 {
        self.at(unix_now())
    }

    /// The time at a Unix time, s.
    pub(super) fn at(&self, unix: f64) -> f64 {
        self.created + self.rate * (unix - self.created)
    }
}

/// Detects that the clock of this machine was set.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClockWatch {
    unix: f64,
    instant: Instant,
}

impl ClockWatch {
    /// Begins to watch now.
    pub(super) fn new() -> Self {
        Self {
            unix: unix_now(),
            instant: Instant::now(),
        }
    }

    /// By how much the clock was set since the last call, s, positive forward. None below a second: slewing is no step.
    pub(super) fn set_by(&mut self) -> Option<f64> {
        self.set_by_at(Self::new())
    }

    fn set_by_at(&mut self, now: Self) -> Option<f64> {
        let before = std::mem::replace(self, now);
        let by = (now.unix - before.unix) - (now.instant - before.instant).as_secs_f64();
        (SET_MIN < by.abs()).then_some(by)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_clock_that_is_set_is_noticed_once_and_one_that_drifts_is_not() {
        let start = ClockWatch {
            unix: 1e9,
            instant: Instant::now(),
        };
        let after = |seconds: f64, unix: f64| ClockWatch {
            unix: start.unix + unix,
            instant: start.instant + Duration::from_secs_f64(seconds),
        };
        let mut watch = start;
        assert_eq!(watch.set_by_at(after(10.0, 10.5)), None);
        let back = watch.set_by_at(after(20.0, 20.5 - 7200.0)).expect("was set");
        assert!((back + 7200.0).abs() < 1e-6, "{back}");
        assert_eq!(watch.set_by_at(after(30.0, 30.5 - 7200.0)), None);
    }
}
