//! Time as an argument: a machine's wall time, running time, timers, and threads for blocking work.
//!
//! ```text
//! machine     unix_s: the wall clock   now, up: the kernel's   timers: Tokio's   work: on threads
//! simulated   unix_s: can be set       now, up: Tokio's paused time; work takes none, and in turn
//! ```
//! Services and bridges take all times from a [`Clock`], so that tests set times and the order of
//! events. Other files of `api/` read no clock and never sleep (`api/clippy.toml`).

#![expect(
    clippy::disallowed_methods,
    reason = "the one place that reads the machine's clocks, sleeps and starts threads"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use std::{io, thread};

use parking_lot::Mutex;
use rustix::time::{ClockId, clock_gettime};
use tokio::{
    runtime, task,
    time::{self, Interval, MissedTickBehavior, error::Elapsed},
};

/// The kernel's clock that no setting changes. Only Linux has one that counts sleep.
const SINCE_BOOT: ClockId = if cfg!(target_os = "linux") { ClockId::Boottime } else { ClockId::Monotonic };

/// Resolution of Tokio's timers plus the wake-up of a thread.
const TIMER_RESOLUTION: Duration = Duration::from_micros(1_500);

/// A step of [`Clock::by`]: the kernel's own delay of a short sleep.
const STEP: Duration = Duration::from_micros(50);

/// The clock of a machine. Clones are the same clock.
#[derive(Clone, Debug)]
pub struct Clock(Option<Arc<SimulatedMachine>>);

/// A machine on Tokio's paused clock.
#[derive(Debug)]
struct SimulatedMachine {
    /// Start of the simulated machine.
    start: Instant,
    settings: Mutex<MachineSettings>,
}

#[derive(Clone, Copy, Debug)]
struct MachineSettings {
    /// Unix time at the start, s, plus all later changes of the wall clock.
    unix_s: f64,
    /// Time that blocking work waits for a thread.
    lag: Duration,
}

/// The work panicked. The panic hook has reported it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work panicked")]
pub struct Panicked;

impl Clock {
    /// The clock of this machine.
    pub fn machine() -> Self {
        Self(None)
    }

    /// The clock of a simulated machine; its Unix time is now `unix_s`, s. Call it in a Tokio
    /// runtime of one thread with paused time.
    pub fn simulated(unix_s: f64) -> Self {
        let lag = Duration::ZERO;
        Self(Some(Arc::new(SimulatedMachine {
            start: time::Instant::now().into_std(),
            settings: Mutex::new(MachineSettings { unix_s, lag }),
        })))
    }

    /// Running time: never set, with an unspecified zero.
    pub fn now(&self) -> Instant {
        match &self.0 {
            None => Instant::now(),
            Some(_) => time::Instant::now().into_std(),
        }
    }

    /// Running time since `earlier`; zero if that is later.
    pub fn since(&self, earlier: Instant) -> Duration {
        self.now().saturating_duration_since(earlier)
    }

    /// Wall time, Unix time, s. It can be set forward and back.
    pub fn unix_s(&self) -> f64 {
        match &self.0 {
            None => SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64()),
            Some(simulated) => simulated.settings.lock().unix_s + self.since(simulated.start).as_secs_f64(),
        }
    }

    /// Time since the machine was switched on, including sleep.
    pub fn up(&self) -> Duration {
        match &self.0 {
            None => {
                let now = clock_gettime(SINCE_BOOT);
                Duration::new(now.tv_sec.unsigned_abs(), u32::try_from(now.tv_nsec).unwrap_or(0))
            }
            Some(simulated) => self.since(simulated.start),
        }
    }

    /// Waits for `duration`.
    pub async fn sleep(&self, duration: Duration) {
        time::sleep(duration).await;
    }

    /// Waits until the running time `end`.
    pub async fn sleep_until(&self, end: Instant) {
        time::sleep_until(end.into()).await;
    }

    /// Ticks, the first after one `period`. Missed ticks are not made up for.
    pub fn every(&self, period: Duration) -> Interval {
        let mut ticks = time::interval_at(time::Instant::now() + period, period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        ticks
    }

    /// The output of `future`, if it comes within `limit`.
    pub async fn timeout<F: Future>(&self, limit: Duration, future: F) -> Result<F::Output, Elapsed> {
        time::timeout(limit, future).await
    }

    /// The output of `future`, if it comes by `end`, within the resolution of timers.
    pub async fn timeout_at<F: Future>(&self, end: Instant, future: F) -> Result<F::Output, Elapsed> {
        time::timeout_at(end.into(), future).await
    }

    /// Calls `poll` until it returns a value, or until `end`, more exactly than a timer.
    pub async fn by<T: Send + 'static>(
        &self,
        end: Instant,
        mut poll: impl FnMut() -> Option<T> + Send + 'static,
    ) -> Option<T> {
        if self.0.is_some() {
            self.sleep_until(end).await;
            return poll();
        }
        let stepwise = move || {
            loop {
                if let Some(output) = poll() {
                    return Some(output);
                }
                if end <= Instant::now() {
                    return None;
                }
                thread::sleep(STEP);
            }
        };
        self.run_blocking(stepwise).await.unwrap_or(None)
    }

    /// End of the wait on a timer for an event at `end`; after it, [`Self::by`] is more exact.
    pub fn last_stretch(&self, end: Instant) -> Instant {
        match &self.0 {
            None => end.checked_sub(TIMER_RESOLUTION).unwrap_or(end),
            Some(_) => end,
        }
    }

    /// Does `work`, which blocks or computes for long, without delaying tasks.
    pub async fn run_blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Panicked> {
        match &self.0 {
            None => task::spawn_blocking(work).await.map_err(|_| Panicked),
            Some(simulated) => {
                simulated.wait_for_thread().await;
                catch_unwind(AssertUnwindSafe(work)).map_err(|_| Panicked)
            }
        }
    }

    /// As [`Self::run_blocking`], for work without a waiting caller.
    pub fn spawn_blocking(&self, work: impl FnOnce() + Send + 'static) {
        match &self.0 {
            None => drop(task::spawn_blocking(work)),
            Some(simulated) => {
                let simulated = Arc::clone(simulated);
                task::spawn(async move {
                    simulated.wait_for_thread().await;
                    work();
                });
            }
        }
    }

    /// Runs a future that sometimes blocks on its own thread, called `name`.
    pub fn spawn_thread(
        &self,
        name: &str,
        future: impl Future<Output = ()> + Send + 'static,
    ) -> io::Result<()> {
        if self.0.is_some() {
            task::spawn(future);
            return Ok(());
        }
        let runtime = runtime::Builder::new_current_thread().enable_time().build()?;
        let thread = thread::Builder::new().name(name.to_owned());
        thread.spawn(move || runtime.block_on(future)).map(drop)
    }

    /// `true` for a simulated machine, which has no threads.
    pub fn is_simulated(&self) -> bool {
        self.0.is_some()
    }

    /// Sets the wall clock of a simulated machine forward or back by `seconds`.
    pub fn set_by(&self, seconds: f64) {
        if let Some(simulated) = &self.0 {
            simulated.settings.lock().unix_s += seconds;
        }
    }

    /// Lets later blocking work of a simulated machine wait `lag` for a thread.
    pub fn delay_threads(&self, lag: Duration) {
        if let Some(simulated) = &self.0 {
            simulated.settings.lock().lag = lag;
        }
    }
}

impl SimulatedMachine {
    async fn wait_for_thread(&self) {
        let lag = self.settings.lock().lag;
        if lag.is_zero() {
            // Other tasks may run first, as with a thread.
            task::yield_now().await;
        } else {
            time::sleep(lag).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn simulated_time_passes_while_all_tasks_wait_and_only_the_wall_clock_can_be_set() {
        let clock = Clock::simulated(1e9);
        let start = clock.now();
        clock.sleep(Duration::from_hours(1)).await;
        assert_eq!(clock.since(start), Duration::from_hours(1));
        clock.set_by(-7_200.0);
        assert_eq!(clock.unix_s(), 1e9 + 3_600.0 - 7_200.0);
        assert_eq!(clock.up(), Duration::from_hours(1));
    }

    #[tokio::test(start_paused = true)]
    async fn blocking_work_takes_only_the_wait_for_a_thread_and_reports_its_panics() {
        let clock = Clock::simulated(0.0);
        let start = clock.now();
        assert_eq!(clock.run_blocking(|| 7).await, Ok(7));
        assert_eq!(clock.since(start), Duration::ZERO);
        clock.delay_threads(Duration::from_millis(300));
        let panics = clock.run_blocking(|| panic!("a test wants this panic"));
        assert_eq!(panics.await, Err::<(), _>(Panicked));
        assert_eq!(clock.since(start), Duration::from_millis(300));
    }

    #[tokio::test(start_paused = true)]
    async fn polling_ends_with_a_value_or_at_its_end() {
        let clock = Clock::simulated(0.0);
        let end = clock.now() + Duration::from_secs(1);
        assert_eq!(clock.by(end, || None::<()>).await, None);
        assert_eq!(clock.now(), end);
        assert_eq!(clock.by(end, || Some(1)).await, Some(1));
    }

    #[test]
    fn the_machine_runs_blocking_work_on_threads_and_polls_in_time() {
        let runtime = runtime::Builder::new_current_thread().enable_time().build();
        runtime.expect("starts").block_on(async {
            let clock = Clock::machine();
            assert!(1.7e9 < clock.unix_s());
            assert_eq!(clock.run_blocking(|| 7).await, Ok(7));
            assert_eq!(clock.by(clock.now(), || Some(1)).await, Some(1));
            let (sender, receiver) = tokio::sync::oneshot::channel();
            let named = async move { drop(sender.send(thread::current().name().map(str::to_owned))) };
            clock.spawn_thread("named", named).expect("starts");
            assert_eq!(receiver.await, Ok(Some("named".to_owned())));
        });
    }
}
