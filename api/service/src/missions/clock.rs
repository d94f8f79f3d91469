//! The clock of a live mission.

use std::time::Instant;

use clock::Clock;
use wire::mission::Live;

/// Least step that counts as a clock being set, s. Reports that are further ahead are refused.
const SET_MIN: f64 = 1.0;

/// Greatest lead of a vehicle's clock over the service's, s of the mission's clock.
pub(super) const AHEAD_MAX: f64 = 1.0;

/// Unix time, or a rehearsal's clock, which runs faster from the creation of the mission.
#[derive(Clone, Copy, Debug)]
pub(super) struct MissionClock {
    /// Time of the mission's creation, Unix time, s.
    pub(super) created: f64,
    /// Seconds of this clock in one second.
    pub(super) rate: f64,
}

impl MissionClock {
    /// The clock of a mission created at `created`, Unix time, s; Unix time for a simulated one.
    pub(super) fn new(created: f64, live: Option<&Live>) -> Self {
        let rate = live.map_or(1.0, |live| live.clock_rate);
        Self { created, rate }
    }

    pub(super) fn now(&self, clock: &Clock) -> f64 {
        self.at(clock.unix_s())
    }

    pub(super) fn at(&self, unix: f64) -> f64 {
        self.created + self.rate * (unix - self.created)
    }
}

/// `true` if a time is later than `now`, s, by more than the tolerance of clocks.
pub(super) fn is_ahead(time: f64, now: f64) -> bool {
    now + AHEAD_MAX < time
}

/// Detects steps of this machine's clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClockWatch {
    unix: f64,
    instant: Instant,
}

impl ClockWatch {
    pub(super) fn new(clock: &Clock) -> Self {
        Self { unix: clock.unix_s(), instant: clock.now() }
    }

    /// The step of the clock since the last call, s, positive forward. Slewing is no step.
    pub(super) fn set_by(&mut self, clock: &Clock) -> Option<f64> {
        let now = Self::new(clock);
        let before = std::mem::replace(self, now);
        let by = (now.unix - before.unix) - (now.instant - before.instant).as_secs_f64();
        (SET_MIN < by.abs()).then_some(by)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_step_of_the_clock_is_noticed_once_and_drift_is_not() {
        let clock = Clock::simulated(1e9);
        let mut watch = ClockWatch::new(&clock);
        let mut after = async |set_by: f64| {
            clock.sleep(Duration::from_secs(10)).await;
            clock.set_by(set_by);
            watch.set_by(&clock)
        };
        assert_eq!(after(0.5).await, None);
        assert_eq!(after(-7_200.0).await, Some(-7_200.0));
        assert_eq!(after(0.0).await, None);
    }
}
