//! The time by which tokens expire and old missions are deleted. A wrong clock must cause neither.
//!
//! ```text
//! same boot:     trusted += running time          (the kernel's, which no clock setting changes)
//! after a boot:  trusted += clock's difference    if that is at most a day
//! at any time:   trusted  = max(trusted, clock)   if clock and running time agreed for three days
//! ```
//! It never goes back. After a jump forward, or a long time without power, it lags behind the clock
//! for three days or until a person sets it.

use std::sync::Arc;
use std::time::Instant;

use clock::Clock;
use parking_lot::Mutex;

use super::error::StoreError;
use super::rows::{Param, Rows};

/// Running time after which an agreeing clock is trusted, s.
const AGREED: f64 = 3.0 * 86_400.0;

/// Largest difference between two readings without a jump, s: slewing and drift are far smaller.
const JUMP: f64 = 60.0;

/// Longest time without power that is trusted at once, s: a night.
const NIGHT: f64 = 86_400.0;

/// A reading of the machine's clocks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    clock: f64,
    /// Time since boot, s. A smaller one than before is from another boot. A larger one may
    /// also be; then the time without power does not count.
    up: f64,
}

impl Reading {
    fn now(clock: &Clock) -> Self {
        Self { clock: clock.unix_s(), up: clock.up().as_secs_f64() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrustedTime {
    /// Unix time, s.
    trusted: f64,
    /// Running time of agreement with the clock, s.
    agreed: f64,
    seen: Reading,
}

impl TrustedTime {
    /// For [`Self::write`].
    pub(super) const WRITE: &str = "UPDATE guards SET trusted_s = ?1, agreed_s = ?2, clock_s = ?3, up_s = ?4";

    /// The stored time. A new store trusts the clock, an older one its newest order.
    pub(super) fn read(rows: &dyn Rows) -> Result<Self, StoreError> {
        rows.one("SELECT trusted_s, agreed_s, clock_s, up_s FROM guards", |row| {
            Ok(Self::of([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?]))
        })
    }

    fn of([trusted, agreed, clock, up]: [f64; 4]) -> Self {
        let seen = Reading { clock, up };
        Self { trusted, agreed, seen }
    }

    pub(super) fn write(&self, to: &dyn Rows, statement: &str) -> Result<(), StoreError> {
        let Reading { clock, up } = &self.seen;
        let params: [&dyn Param; 4] = [&self.trusted, &self.agreed, clock, up];
        to.change(statement, &params).map(drop)
    }

    /// Advances to the start of a service.
    pub(super) fn resume(&mut self, clock: &Clock) {
        self.advance_to(Reading::now(clock), false);
    }

    /// Advances to the start of a service after another machine may have written the store, by its
    /// own clock and boot: by at most a night, and not beyond this machine's clock.
    pub(super) fn adopt(&mut self, clock: &Clock) {
        let seen = Reading::now(clock);
        let by_clock = seen.clock - self.seen.clock;
        if self.trusted == 0.0 {
            self.trusted = seen.clock;
        } else if (0.0..=NIGHT).contains(&by_clock) {
            self.trusted = self.trusted.max(seen.clock.min(self.trusted + by_clock));
        }
        (self.agreed, self.seen) = (0.0, seen);
    }

    /// Advances to `now`; `running` if this process made the last reading.
    fn advance_to(&mut self, now: Reading, running: bool) {
        let by_clock = now.clock - self.seen.clock;
        let elapsed = now.up - self.seen.up;
        if self.trusted == 0.0 {
            self.trusted = now.clock;
        } else if 0.0 <= elapsed {
            // The files may come from another machine: the shorter time is safe.
            let longest = if running { elapsed } else { by_clock.max(0.0) };
            self.trusted += elapsed.min(longest);
            let agrees = (by_clock - elapsed).abs() <= JUMP;
            self.agreed = if agrees { self.agreed + elapsed } else { 0.0 };
        } else if (0.0..=NIGHT).contains(&by_clock) {
            self.trusted += by_clock;
        } else {
            self.agreed = 0.0;
        }
        if AGREED <= self.agreed {
            self.trusted = self.trusted.max(now.clock);
        }
        self.seen = now;
    }
}

/// The trusted time as it passes. Clones share it.
#[derive(Clone, Debug)]
pub struct TrustedClock {
    pub(super) machine: Clock,
    /// The time, and the running time of its reading.
    time: Arc<Mutex<(TrustedTime, Instant)>>,
}

impl TrustedClock {
    pub(super) fn new(time: TrustedTime, machine: &Clock) -> Self {
        Self { machine: machine.clone(), time: Arc::new(Mutex::new((time, machine.now()))) }
    }

    /// Trusted time now, Unix time, s.
    pub fn now_s(&self) -> f64 {
        let (time, read) = &*self.time.lock();
        time.trusted + self.machine.since(*read).as_secs_f64()
    }

    /// Reads the machine's clocks, and returns the time to store.
    pub(super) fn read_clocks(&self) -> TrustedTime {
        let (time, read) = &mut *self.time.lock();
        time.advance_to(Reading::now(&self.machine), true);
        *read = self.machine.now();
        *time
    }

    /// Lead of the machine's clock at the last reading, s; negative for a lag.
    pub fn clock_ahead_s(&self) -> f64 {
        let (TrustedTime { trusted, seen, .. }, _) = &*self.time.lock();
        seen.clock - trusted
    }

    /// Takes the machine's time, because a person has confirmed it. Returns the time to store.
    pub(super) fn believe_clock(&self) -> TrustedTime {
        let (time, read) = &mut *self.time.lock();
        *read = self.machine.now();
        time.seen = Reading::now(&self.machine);
        time.trusted = time.seen.clock;
        *time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: f64 = 86_400.0;
    const START: f64 = 1.7e9;

    #[test]
    fn a_store_of_another_machine_advances_by_at_most_a_night() {
        let machine = Clock::machine();
        let now = machine.unix_s();
        // Lags of the trusted time and of the other clock behind this clock; the time that passes.
        for (before, clock, passed) in [
            (30.0 * DAY, 20.0 * DAY, 0.0),
            (30.0 * DAY, -20.0 * DAY, 0.0),
            (30.0 * DAY, 0.5 * DAY, 0.5 * DAY),
            (0.25 * DAY, 0.5 * DAY, 0.25 * DAY),
            (-0.5 * DAY, 0.5 * DAY, 0.0),
        ] {
            let mut time = TrustedTime::of([now - before, AGREED, now - clock, 1e-3]);
            time.adopt(&machine);
            let believed = time.trusted - (now - before);
            assert!((believed - passed).abs() < 60.0, "{believed}");
            assert_eq!(time.agreed, 0.0);
        }
    }

    fn reading(clock: f64, up: f64) -> Reading {
        Reading { clock, up }
    }

    fn started() -> TrustedTime {
        TrustedTime::of([START, 0.0, START, 1_000.0])
    }

    /// Reads the clocks every ten minutes for `days`, with a clock that is `ahead`.
    fn run(time: &mut TrustedTime, days: f64, ahead: f64) {
        let Reading { up, .. } = time.seen;
        let start = time.trusted + ahead;
        let mut passed = 0.0;
        while passed < days * DAY {
            passed += 600.0;
            time.advance_to(reading(start + passed, up + passed), true);
        }
    }

    #[test]
    fn a_clock_that_jumps_ahead_is_believed_after_three_days_and_not_before() {
        let mut time = started();
        run(&mut time, 5.0, 0.0);
        assert!((time.trusted - START - 5.0 * DAY).abs() < 1.0);
        run(&mut time, 2.9, 365.0 * DAY);
        assert!((time.trusted - START - 7.9 * DAY).abs() < 700.0, "{time:?}");
        run(&mut time, 0.2, 365.0 * DAY);
        assert!(365.0 * DAY < time.trusted - START);
    }

    #[test]
    fn the_time_never_goes_back_and_runs_on_while_the_clock_is_behind() {
        let mut time = started();
        run(&mut time, 10.0, -400.0 * DAY);
        assert!((time.trusted - START - 10.0 * DAY).abs() < 1.0, "{time:?}");
        time.advance_to(reading(0.0, 5.0), false);
        assert!((time.trusted - START - 10.0 * DAY).abs() < 1.0, "{time:?}");
    }

    /// The kernel's time of another boot, or of a machine that has run for longer.
    #[test]
    fn a_night_without_power_counts_at_once_by_the_clock_and_a_year_does_not() {
        for (off, up, believed) in [
            (0.6 * DAY, 20.0, 0.6 * DAY),
            (365.0 * DAY, 20.0, 0.0),
            (-DAY, 20.0, 0.0),
            (DAY, 400.0 * DAY, DAY),
        ] {
            let mut time = started();
            time.advance_to(reading(START + off, up), false);
            assert!((time.trusted - START - believed).abs() < 1.0, "{off}: {time:?}");
        }
    }
}
