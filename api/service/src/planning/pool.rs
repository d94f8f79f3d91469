//! Threads for the work of any client, at a lower priority than the threads that plan for missions.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Weak};
use std::{array, thread};

use clock::Clock;
use crossbeam_channel::{Receiver, Sender, select_biased, unbounded};
use parking_lot::Mutex;
use prometheus_client::metrics::gauge::Gauge;
use tokio::sync::oneshot;
use tracing::{Span, info_span};

/// Steps of `nice` by which these threads' priority is lower: beside a planning thread of a
/// mission, one gets a quarter of a processor, and otherwise all of it.
const NICE: i32 = 5;

type Work = Box<dyn FnOnce() + Send>;

/// Work that waits for a thread while its caller holds this. Dropping it frees the work's memory;
/// the queue keeps an empty entry until a thread comes by.
pub(crate) struct Job(Mutex<Option<Work>>);

#[derive(Clone, Debug)]
pub(crate) struct Caller(Option<Weak<Job>>);

/// The order in which jobs are served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Priority {
    /// A mission, or a client that reports to one.
    Mission,
    /// Another request with a short body.
    Short,
    /// Another request with a long body.
    Long,
}

/// Some threads and their queues. Clones share them; the threads end with the last clone.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    clock: Clock,
    queues: [Sender<Weak<Job>>; 3],
    /// Lengths of the queues, by priority.
    waiting: Arc<[Gauge; 3]>,
}

impl Priority {
    /// Every priority, the highest first.
    pub(crate) const ALL: [Self; 3] = [Self::Mission, Self::Short, Self::Long];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mission => "mission",
            Self::Short => "short",
            Self::Long => "long",
        }
    }
}

impl Pool {
    /// `n` threads called `name`; `waiting` shows the lengths of the queues, by priority.
    pub(crate) fn new(name: &str, n: usize, waiting: [Gauge; 3], clock: &Clock) -> Self {
        let waiting = Arc::new(waiting);
        let channels: [_; 3] = array::from_fn(|_| unbounded());
        // A simulated machine has no threads: it does one job after the other.
        let n_threads = if clock.is_simulated() { 0 } else { n };
        for _ in 0..n_threads {
            let of_each = |(_, jobs): &(_, Receiver<_>)| jobs.clone();
            let jobs = channels.each_ref().map(of_each);
            let waiting = Arc::clone(&waiting);
            let thread = thread::Builder::new().name(name.to_owned());
            #[expect(
                clippy::disallowed_methods,
                reason = "these threads wait for jobs and compute: `Clock::spawn_thread` runs futures"
            )]
            let started = thread.spawn(move || work(&jobs, &waiting));
            started.expect("a service starts before it runs out of threads");
        }
        let queues = channels.map(|(queue, _)| queue);
        Self { clock: clock.clone(), queues, waiting }
    }

    /// Gives `work` to a thread, unless the job is dropped first. Long work checks if its caller is
    /// gone. The receiver fails if the work panics.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        priority: Priority,
        work: impl FnOnce(Caller) -> T + Send + 'static,
    ) -> (oneshot::Receiver<T>, Arc<Job>) {
        let (sender, receiver) = oneshot::channel();
        let (span, queued) = (Span::current(), info_span!("queue"));
        let job = Arc::new_cyclic(|job| {
            let caller = Caller(Some(Weak::clone(job)));
            let work = move || {
                drop(queued);
                // The work's data are dropped before its result is seen. The caller may be gone.
                let done = span.in_scope(|| work(caller));
                let _ = sender.send(done);
            };
            Job(Mutex::new(Some(Box::new(work))))
        });
        if self.clock.is_simulated() {
            let queued = Arc::downgrade(&job);
            self.clock.spawn_blocking(move || carry_out(&queued));
            return (receiver, job);
        }
        self.waiting[priority as usize].inc();
        let queued = self.queues[priority as usize].send(Arc::downgrade(&job));
        queued.expect("the threads live as long as the pool");
        (receiver, job)
    }
}

/// Does one job after another, until the pool is dropped.
fn work([mission, short, long]: &[Receiver<Weak<Job>>; 3], waiting: &[Gauge; 3]) {
    lower_priority();
    loop {
        let (job, priority) = select_biased! {
            recv(mission) -> job => (job, Priority::Mission),
            recv(short) -> job => (job, Priority::Short),
            recv(long) -> job => (job, Priority::Long),
        };
        let Ok(job) = job else { return };
        waiting[priority as usize].dec();
        carry_out(&job);
    }
}

/// Lowers the priority of this thread below that of missions.
pub(crate) fn lower_priority() {
    // On Linux, priorities belong to threads.
    if let Err(error) = rustix::process::nice(NICE) {
        tracing::warn!(%error, "cannot lower the priority of requests: they compete with missions for the processors");
    }
}

/// Does the work, unless its caller is gone.
fn carry_out(job: &Weak<Job>) {
    if let Some(work) = job.upgrade().and_then(|job| job.take()) {
        // The panic hook has reported it; the caller sees that no result came.
        let _ = catch_unwind(AssertUnwindSafe(work));
    }
}

impl Caller {
    pub(crate) const STAYS: Self = Self(None);

    /// `true` once no caller holds the job.
    pub(crate) fn is_gone(&self) -> bool {
        self.0.as_ref().is_some_and(|job| job.strong_count() == 0)
    }
}

impl Job {
    /// Cancels the job, unless it has begun. `true` if it is cancelled.
    pub(crate) fn give_up(&self) -> bool {
        self.take().is_some()
    }

    fn take(&self) -> Option<Work> {
        self.0.lock().take()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn missions_come_first_then_short_bodies_and_threads_survive_panics() {
        let pool = Pool::new("test", 1, <[Gauge; 3]>::default(), &Clock::machine());
        let (open, gate) = mpsc::channel::<()>();
        let (begun, begins) = mpsc::channel();
        let wait = move |_| {
            begun.send(()).expect("is heard");
            gate.recv()
        };
        let (held, _held) = pool.run(Priority::Short, wait);
        begins.recv().expect("begins");
        let (order, done) = mpsc::channel();
        let tell = |what: &'static str| {
            let order = order.clone();
            move |_| order.send(what).expect("is heard")
        };
        let (long, _long) = pool.run(Priority::Long, tell("long"));
        let (short, _short) = pool.run(Priority::Short, tell("short"));
        let (panicked, _panicked) = pool.run(Priority::Short, |_| panic!("on purpose"));
        let (mission, _mission) = pool.run(Priority::Mission, tell("mission"));
        drop(pool.run(Priority::Mission, tell("given up")));
        open.send(()).expect("is waited for");
        held.blocking_recv().expect("is done").expect("was opened");
        mission.blocking_recv().expect("is done");
        short.blocking_recv().expect("is done");
        long.blocking_recv().expect("is done");
        assert!(panicked.blocking_recv().is_err());
        let (after, _after) = pool.run(Priority::Short, tell("after"));
        after.blocking_recv().expect("is done");
        assert_eq!(done.try_iter().collect::<Vec<_>>(), ["mission", "short", "long", "after"]);
    }

    #[test]
    fn work_notices_that_its_caller_is_gone() {
        let pool = Pool::new("test", 1, <[Gauge; 3]>::default(), &Clock::machine());
        let (open, gate) = mpsc::channel::<()>();
        let (tell, told) = mpsc::channel();
        let (_done, job) = pool.run(Priority::Short, move |caller| {
            tell.send(caller.is_gone()).expect("is heard");
            gate.recv().expect("is opened");
            tell.send(caller.is_gone()).expect("is heard");
        });
        assert_eq!(told.recv(), Ok(false));
        drop(job);
        open.send(()).expect("is waited for");
        assert_eq!(told.recv(), Ok(true));
        assert!(!Caller::STAYS.is_gone());
    }

    #[test]
    fn a_dropped_job_holds_nothing() {
        let pool = Pool::new("test", 1, <[Gauge; 3]>::default(), &Clock::machine());
        let (open, gate) = mpsc::channel::<()>();
        let (_held, _job) = pool.run(Priority::Short, move |_| gate.recv());
        let held = Arc::new(());
        for _ in 0..1000 {
            let holds = Arc::clone(&held);
            drop(pool.run(Priority::Long, move |_| drop(holds)));
        }
        assert_eq!(Arc::strong_count(&held), 1);
        open.send(()).expect("is waited for");
    }
}
