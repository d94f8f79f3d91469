//! Which requests are taken on: those that can be answered in time. Others are turned away before they cost anything.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use prometheus_client::metrics::gauge::Gauge;

use crate::{pool::Lane, problem::Problem};

/// Work that every request costs, in bytes of a body.
const COST_MIN: f64 = 4096.0;

/// Share of the newest request in the estimate of what a byte costs.
const NEWEST: f64 = 0.05;

/// Work on one request that the estimate follows at most, s: the rest is another request's deadline.
const BUSY_MAX: f64 = 1.0;

/// How long a queue may stand before it counts as one that does not go away: a burst is over sooner.
/// Source: Nichols and Jacobson, "Controlling Queue Delay", 2012: the interval of `CoDel`.
const STANDING: Duration = Duration::from_millis(100);

/// A queue that was cut stays short until none has been turned away for so long: else the next long queue would grow at
/// once, and under an overload that goes on most of what is taken on would wait in one.
const CUT: Duration = Duration::from_secs(1);

/// Wait that counts as one in a queue that stands, in mean times of work: up to sixteen steady clients of a service with two
/// threads are all served, though each waits for some others.
const LONG_WAIT: f64 = 7.0;

/// The same once the queue was cut. What is taken on then waits little longer than without overload; twice as many requests
/// as threads still wait for none.
const SHORT_WAIT: f64 = 0.6;

/// Mean time of work that these count in at least, s.
const BUSY_MIN: f64 = 2e-3;

/// Decides on admission. Clones share what it knows.
#[derive(Clone, Debug)]
pub(crate) struct Admission(Arc<Mutex<Load>>);

/// A request that was taken on, until it is dropped.
#[derive(Debug)]
pub(crate) struct Ticket {
    /// Where its work waits.
    pub(crate) lane: Lane,
    admission: Admission,
    cost: f64,
    busy: Mutex<Duration>,
}

#[derive(Debug)]
struct Load {
    n_threads: f64,
    n_max: usize,
    /// Requests taken on.
    n: usize,
    /// Their cost, in bytes.
    cost: f64,
    /// What a byte costs, s of a thread.
    rate: f64,
    /// Mean work on a request, s.
    busy: f64,
    /// Since when the queue has been longer than it should stand.
    standing_since: Option<Instant>,
    /// Until when no longer queue is let grow.
    cut_until: Option<Instant>,
    /// Shows `n`.
    gauge: Gauge,
}

impl Admission {
    /// For `n_threads`, with at most `n_waiting` more requests than threads; `gauge` shows how many there are.
    pub(crate) fn new(n_threads: usize, n_waiting: usize, gauge: Gauge) -> Self {
        Self(Arc::new(Mutex::new(Load {
            n_threads: float(n_threads),
            n_max: n_threads + n_waiting,
            n: 0,
            cost: 0.0,
            rate: 0.0,
            busy: 0.0,
            standing_since: None,
            cut_until: None,
            gauge,
        })))
    }

    /// Takes on a request with a body of `bytes`, due at `due`, if those before it leave the time for it.
    pub(crate) fn admit(&self, bytes: usize, lane: Lane, due: Instant) -> Result<Arc<Ticket>, Problem> {
        self.admit_at(Instant::now(), bytes, lane, due)
    }

    fn admit_at(&self, now: Instant, bytes: usize, lane: Lane, due: Instant) -> Result<Arc<Ticket>, Problem> {
        let cost = COST_MIN + float(bytes);
        let mut load = self.load();
        let waits = load.rate * load.cost / load.n_threads;
        let is_cut = load.cut_until.is_some_and(|until| now < until);
        let wait = if is_cut { SHORT_WAIT } else { LONG_WAIT };
        let stands = load.n_threads <= float(load.n) && (1.0 + wait) * load.busy.max(BUSY_MIN) < waits;
        let since = stands.then(|| *load.standing_since.get_or_insert(now));
        if !stands {
            load.standing_since = None;
        }
        let too_long = since.is_some_and(|since| is_cut || STANDING < now.saturating_duration_since(since));
        if too_long {
            load.cut_until = Some(now + CUT);
        }
        let hopeless = due.saturating_duration_since(now).as_secs_f64() <= waits;
        if load.n_max <= load.n || too_long || (0 < load.n && hopeless) {
            return Err(Problem::Overloaded);
        }
        load.n += 1;
        load.gauge.inc();
        load.cost += cost;
        drop(load);
        Ok(Arc::new(Ticket {
            lane,
            admission: self.clone(),
            cost,
            busy: Mutex::default(),
        }))
    }

    fn load(&self) -> MutexGuard<'_, Load> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Counts and lengths here are far below where this rounds.
#[expect(clippy::cast_precision_loss, reason = "bodies and queues are limited")]
fn float(count: usize) -> f64 {
    count as f64
}

impl Ticket {
    /// Does `work` for the request, and takes the time of it.
    pub(crate) fn work<T>(&self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        *self.busy.lock().unwrap_or_else(PoisonError::into_inner) += start.elapsed();
        done
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        let busy = self.busy.get_mut().unwrap_or_else(PoisonError::into_inner);
        let busy = busy.as_secs_f64().min(BUSY_MAX);
        let mut load = self.admission.load();
        load.n -= 1;
        load.gauge.dec();
        // Sums of floats do not come back to nothing.
        load.cost = if load.n == 0 {
            0.0
        } else {
            (load.cost - self.cost).max(0.0)
        };
        if 0.0 < busy {
            load.rate += NEWEST * (busy / self.cost - load.rate);
            load.busy += NEWEST * (busy - load.busy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One thread that takes 10 ms for each request of 4 KiB.
    fn slow() -> Admission {
        let admission = Admission::new(1, 64, Gauge::default());
        let mut load = admission.load();
        load.rate = 10e-3 / (2.0 * COST_MIN);
        load.busy = 10e-3;
        drop(load);
        admission
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_request_that_cannot_be_in_time_is_turned_away_and_a_patient_one_is_not() {
        let (admission, now) = (slow(), Instant::now());
        let admit = |due| admission.admit_at(now, 4096, Lane::Short, now + ms(due));
        let _working: Vec<_> = (0..3).map(|_| admit(1000).expect("has time")).collect();
        assert_eq!(admit(29).err(), Some(Problem::Overloaded));
        admit(31).expect("has time");
    }

    #[test]
    fn a_burst_waits_and_a_queue_that_stands_is_cut_to_its_least() {
        let (admission, start) = (slow(), Instant::now());
        let admit = |at| admission.admit_at(start + ms(at), 4096, Lane::Short, start + ms(at + 1000));
        let mut waiting: Vec<_> = (0..10).map(|_| admit(0).expect("is a burst")).collect();
        waiting.push(admit(90).expect("may still go away"));
        assert_eq!(admit(101).err(), Some(Problem::Overloaded));
        waiting.truncate(1);
        drop(admit(102).expect("is worked off"));
    }

    #[test]
    fn a_queue_that_was_cut_does_not_grow_again_while_requests_are_turned_away() {
        let (admission, start) = (slow(), Instant::now());
        let admit = |at| admission.admit_at(start + ms(at), 4096, Lane::Short, start + ms(at + 1000));
        let mut waiting: Vec<_> = (0..10).map(|_| admit(0).expect("is a burst")).collect();
        assert_eq!(admit(101).err(), Some(Problem::Overloaded));
        waiting.clear();
        // One may wait behind another: the third would stand, and is not waited for.
        let short: Vec<_> = (0..2).map(|_| admit(600).expect("the queue is short")).collect();
        assert_eq!(admit(600).err(), Some(Problem::Overloaded));
        drop(short);
        // The overload is over for a second: the next burst may wait.
        waiting.extend((0..10).map_while(|_| admit(1601).ok()));
        assert_eq!(waiting.len(), 10);
    }

    #[test]
    fn an_idle_service_takes_on_whatever_comes() {
        let (admission, now) = (slow(), Instant::now());
        drop(
            admission
                .admit_at(now, 1 << 20, Lane::Long, now + ms(1))
                .expect("nothing is before it"),
        );
        assert_eq!(admission.load().cost, 0.0);
    }
}
