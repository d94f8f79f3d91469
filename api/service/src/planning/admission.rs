//! Admission: accepts only requests that can be answered in time, and refuses others at once.

use std::sync::Arc;
use std::time::{Duration, Instant};

use clock::Clock;
use parking_lot::Mutex;
use prometheus_client::metrics::gauge::Gauge;

use crate::edge::problem::Problem;
use crate::limits::{
    CUT_QUEUE_TIME, CUT_QUEUE_WAIT_MAX, NEWEST_WEIGHT, QUEUE_WAIT_MAX, REQUEST_COST, STANDING_QUEUE_TIME,
    WORK_MAX, WORK_MIN,
};
use crate::planning::pool::Priority;

/// The kind of work of an admitted request. The time for a byte depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Work {
    Plan,
    /// The plans of all laws.
    Comparison,
    Batch,
    /// The assignment and the plans of a fleet.
    Fleet,
    /// A check of a snapshot, a route of a file or the scene of a mission.
    Reading,
}

const KINDS: usize = 5;

/// Decides on admission. Clones share the state.
#[derive(Clone, Debug)]
pub(crate) struct Admission(Arc<Mutex<Load>>);

/// An admitted request; dropping it ends its admission.
#[derive(Debug)]
pub(crate) struct Permit {
    /// The queue of its work.
    pub(crate) priority: Priority,
    admission: Admission,
    work: Work,
    cost: f64,
    busy: Mutex<Duration>,
}

#[derive(Debug, Default)]
struct Load {
    n_threads: f64,
    n_max: usize,
    /// Number of admitted requests.
    n: usize,
    /// Their cost, in bytes, by kind.
    cost: [f64; KINDS],
    /// Time of a thread for a byte, s, by kind.
    rate: [f64; KINDS],
    /// Mean time of work on a request, s.
    busy: f64,
    /// Time since which the queue has been too long.
    standing_since: Option<Instant>,
    /// Time until which the queue stays short.
    cut_until: Option<Instant>,
    gauge: Gauge,
}

impl Admission {
    /// For `n_threads`, with at most `n_waiting` more requests; `gauge` shows the number of all.
    pub(crate) fn new(n_threads: usize, n_waiting: usize, gauge: Gauge) -> Self {
        Self(Arc::new(Mutex::new(Load {
            n_threads: n_threads as f64,
            n_max: n_threads + n_waiting,
            gauge,
            ..Load::default()
        })))
    }

    /// Admits a request for `work` with `bytes` of body, if it can be done by `due`.
    pub(crate) fn admit(
        &self,
        now: Instant,
        (work, bytes): (Work, usize),
        priority: Priority,
        due: Instant,
    ) -> Result<Arc<Permit>, Problem> {
        let cost = REQUEST_COST + bytes as f64;
        let mut load = self.0.lock();
        let waits = load.waits();
        let is_cut = load.cut_until.is_some_and(|until| now < until);
        let wait = if is_cut { CUT_QUEUE_WAIT_MAX } else { QUEUE_WAIT_MAX };
        let stands = load.n_threads <= load.n as f64 && (1.0 + wait) * load.busy.max(WORK_MIN) < waits;
        let since = stands.then(|| *load.standing_since.get_or_insert(now));
        if !stands {
            load.standing_since = None;
        }
        let too_long =
            since.is_some_and(|since| is_cut || STANDING_QUEUE_TIME < now.saturating_duration_since(since));
        if too_long {
            load.cut_until = Some(now + CUT_QUEUE_TIME);
        }
        let hopeless = due.saturating_duration_since(now).as_secs_f64() <= waits;
        if load.n_max <= load.n || too_long || (0 < load.n && hopeless) {
            return Err(Problem::Overloaded);
        }
        load.n += 1;
        load.gauge.inc();
        load.cost[work as usize] += cost;
        drop(load);
        Ok(Arc::new(Permit { priority, admission: self.clone(), work, cost, busy: Mutex::default() }))
    }
}

impl Load {
    /// Time until the admitted work is done, s.
    fn waits(&self) -> f64 {
        let costs = self.rate.iter().zip(&self.cost);
        costs.map(|(rate, cost)| rate * cost).sum::<f64>() / self.n_threads
    }
}

impl Permit {
    /// Does `work` for the request and measures its time.
    pub(crate) fn work<T>(&self, clock: &Clock, work: impl FnOnce() -> T) -> T {
        let start = clock.now();
        let done = work();
        *self.busy.lock() += clock.since(start);
        done
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let busy = self.busy.get_mut().as_secs_f64().min(WORK_MAX);
        let mut load = self.admission.0.lock();
        load.n -= 1;
        load.gauge.dec();
        // A sum of floats need not return to 0.
        let (kind, all_done) = (self.work as usize, load.n == 0);
        load.cost[kind] = (load.cost[kind] - self.cost).max(0.0);
        if all_done {
            load.cost = [0.0; KINDS];
        }
        if 0.0 < busy {
            load.rate[kind] += NEWEST_WEIGHT * (busy / self.cost - load.rate[kind]);
            load.busy += NEWEST_WEIGHT * (busy - load.busy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One thread that takes 10 ms for each request of 4 KiB.
    fn slow() -> Admission {
        let admission = Admission::new(1, 64, Gauge::default());
        let mut load = admission.0.lock();
        load.rate[Work::Plan as usize] = 10e-3 / (2.0 * REQUEST_COST);
        load.busy = 10e-3;
        drop(load);
        admission
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// A plan asked for at `at` that may take a second.
    fn with_a_second(admission: &Admission, at: Instant) -> Result<Arc<Permit>, Problem> {
        admission.admit(at, (Work::Plan, 4096), Priority::Short, at + ms(1000))
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_that_would_be_late_is_refused_and_one_with_more_time_is_admitted() {
        let (admission, now) = (slow(), Clock::simulated(0.0).now());
        let admit = |due| admission.admit(now, (Work::Plan, 4096), Priority::Short, now + ms(due));
        let _working: Vec<_> = (0..3).map(|_| admit(1000).expect("has time")).collect();
        assert_eq!(admit(29).err(), Some(Problem::Overloaded));
        admit(31).expect("has time");
    }

    #[tokio::test(start_paused = true)]
    async fn a_burst_waits_and_a_standing_queue_is_cut() {
        let (admission, start) = (slow(), Clock::simulated(0.0).now());
        let admit = |at| with_a_second(&admission, start + ms(at));
        let mut waiting: Vec<_> = (0..10).map(|_| admit(0).expect("is a burst")).collect();
        waiting.push(admit(90).expect("may still go away"));
        assert_eq!(admit(101).err(), Some(Problem::Overloaded));
        waiting.truncate(1);
        drop(admit(102).expect("is worked off"));
    }

    #[tokio::test(start_paused = true)]
    async fn a_queue_that_was_cut_stays_short_while_requests_are_refused() {
        let (admission, start) = (slow(), Clock::simulated(0.0).now());
        let admit = |at| with_a_second(&admission, start + ms(at));
        let mut waiting: Vec<_> = (0..10).map(|_| admit(0).expect("is a burst")).collect();
        assert_eq!(admit(101).err(), Some(Problem::Overloaded));
        waiting.clear();
        // One may wait behind another; a third is refused.
        let short: Vec<_> = (0..2).map(|_| admit(600).expect("the queue is short")).collect();
        assert_eq!(admit(600).err(), Some(Problem::Overloaded));
        drop(short);
        // A second after the overload, the next burst may wait.
        waiting.extend((0..10).map_while(|_| admit(1601).ok()));
        assert_eq!(waiting.len(), 10);
    }

    #[tokio::test(start_paused = true)]
    async fn each_kind_of_work_has_its_own_cost() {
        let (admission, now) = (slow(), Clock::simulated(0.0).now());
        let admit = |work, due| admission.admit(now, (work, 4096), Priority::Short, now + ms(due));
        let _reading: Vec<_> = (0..3).map(|_| admit(Work::Reading, 1000).expect("has time")).collect();
        let _plan = admit(Work::Plan, 1).expect("reading takes no time");
        assert_eq!(admit(Work::Reading, 9).err(), Some(Problem::Overloaded));
    }

    #[tokio::test(start_paused = true)]
    async fn an_idle_service_admits_every_request() {
        let (admission, now) = (slow(), Clock::simulated(0.0).now());
        drop(
            admission
                .admit(now, (Work::Plan, 1 << 20), Priority::Long, now + ms(1))
                .expect("nothing is before it"),
        );
        assert_eq!(admission.0.lock().cost, [0.0; KINDS]);
    }
}
