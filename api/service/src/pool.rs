//! Threads for work that any client may ask for: below the priority of the threads that plan for missions.

use std::{
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak},
    thread,
};

use prometheus_client::metrics::gauge::Gauge;
use tokio::sync::oneshot;
use tracing::{Span, info_span};

/// How much lower these threads' priority is, in steps of `nice`: beside a thread that plans for a mission one of these
/// gets a quarter of a processor, and all of it when no mission plans.
const NICE: i32 = 5;

/// Queued jobs of a lane beyond which those that were given up are looked for.
const LOOK_FOR_ABANDONED: usize = 256;

type Work = Box<dyn FnOnce() + Send>;

/// Work that waits for its turn, for as long as its caller holds this: what is given up holds no memory.
pub(crate) struct Job(Mutex<Option<Work>>);

/// Who asks, in the order in which they are served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// A mission, or a client that reports to one.
    Mission,
    /// Another request with a short body.
    Short,
    /// Another request with a long body.
    Long,
}

/// Some threads and their queue. Clones share them; they end with the last clone.
#[derive(Clone, Debug)]
pub(crate) struct Pool(Arc<Owner>);

#[derive(Debug)]
struct Owner(Arc<Shared>);

#[derive(Default)]
struct Shared {
    queues: Mutex<Queues>,
    /// Lengths of the queues, by lane.
    waiting: [Gauge; 3],
    wake: Condvar,
}

#[derive(Default)]
struct Queues {
    /// By lane.
    jobs: [VecDeque<Weak<Job>>; 3],
    closed: bool,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Lane {
    /// In the order in which they are served.
    pub(crate) const ALL: [Self; 3] = [Self::Mission, Self::Short, Self::Long];

    /// Its name in metrics.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mission => "mission",
            Self::Short => "short",
            Self::Long => "long",
        }
    }
}

impl Pool {
    /// `n` threads called `name`; `waiting` shows the lengths of the queues, by lane.
    pub(crate) fn new(name: &str, n: usize, waiting: [Gauge; 3]) -> Self {
        let shared = Arc::new(Shared {
            waiting,
            ..Shared::default()
        });
        for _ in 0..n {
            let shared = Arc::clone(&shared);
            let thread = thread::Builder::new().name(name.to_owned());
            let started = thread.spawn(move || shared.work());
            started.expect("a service starts before it runs out of threads");
        }
        Self(Arc::new(Owner(shared)))
    }

    /// Has a thread do `work`, unless the job is dropped before it begins. The receiver fails if it panics.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        lane: Lane,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> (oneshot::Receiver<T>, Arc<Job>) {
        let (sender, receiver) = oneshot::channel();
        let (span, queued) = (Span::current(), info_span!("queue"));
        let work = Box::new(move || {
            drop(queued);
            // What the work holds is dropped before its result is seen. The caller may be gone by then.
            let done = span.in_scope(work);
            let _ = sender.send(done);
        });
        let job = Arc::new(Job(Mutex::new(Some(work))));
        let Owner(shared) = &*self.0;
        let mut queues = shared.queues();
        let jobs = &mut queues.jobs[lane as usize];
        if LOOK_FOR_ABANDONED <= jobs.len() {
            jobs.retain(|job| 0 < job.strong_count());
        }
        jobs.push_back(Arc::downgrade(&job));
        shared.waiting[lane as usize].set(length(jobs));
        drop(queues);
        shared.wake.notify_one();
        (receiver, job)
    }
}

impl Pool {
    /// Whether a job waits for a thread. Takes no lock.
    pub(crate) fn has_jobs_waiting(&self) -> bool {
        let Owner(shared) = &*self.0;
        shared.waiting.iter().any(|jobs| 0 < jobs.get())
    }
}

impl Job {
    fn take(&self) -> Option<Work> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        self.0.queues().closed = true;
        self.0.wake.notify_all();
    }
}

impl Shared {
    fn queues(&self) -> MutexGuard<'_, Queues> {
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self) {
        // On Linux the priority is the thread's own.
        if let Err(error) = rustix::process::nice(NICE) {
            tracing::warn!(%error, "requests share the processors with missions as equals");
        }
        while let Some(job) = self.next() {
            let work = job.upgrade().and_then(|job| job.take());
            if let Some(work) = work {
                // The panic hook has told of it; the caller sees that no result came.
                let _ = catch_unwind(AssertUnwindSafe(work));
            }
        }
    }

    /// The next job; none when the pool is dropped.
    fn next(&self) -> Option<Weak<Job>> {
        let mut queues = self.queues();
        loop {
            if queues.closed {
                return None;
            }
            for (jobs, waiting) in queues.jobs.iter_mut().zip(&self.waiting) {
                if let Some(job) = jobs.pop_front() {
                    waiting.set(length(jobs));
                    return Some(job);
                }
            }
            queues = self.wake.wait(queues).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

fn length<T>(queue: &VecDeque<T>) -> i64 {
    i64::try_from(queue.len()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn a_mission_goes_first_a_short_body_next_and_a_panic_takes_no_thread() {
        let pool = Pool::new("test", 1, <[Gauge; 3]>::default());
        let (open, gate) = mpsc::channel::<()>();
        let (begun, begins) = mpsc::channel();
        let wait = move || {
            begun.send(()).expect("is heard");
            gate.recv()
        };
        let (held, _held) = pool.run(Lane::Short, wait);
        begins.recv().expect("begins");
        let (order, done) = mpsc::channel();
        let tell = |what: &'static str| {
            let order = order.clone();
            move || order.send(what).expect("is heard")
        };
        let (long, _long) = pool.run(Lane::Long, tell("long"));
        let (short, _short) = pool.run(Lane::Short, tell("short"));
        let (panicked, _panicked) = pool.run(Lane::Short, || panic!("on purpose"));
        let (mission, _mission) = pool.run(Lane::Mission, tell("mission"));
        drop(pool.run(Lane::Mission, tell("given up")));
        open.send(()).expect("is waited for");
        held.blocking_recv().expect("is done").expect("was opened");
        mission.blocking_recv().expect("is done");
        short.blocking_recv().expect("is done");
        long.blocking_recv().expect("is done");
        assert!(panicked.blocking_recv().is_err());
        let (after, _after) = pool.run(Lane::Short, tell("after"));
        after.blocking_recv().expect("is done");
        assert_eq!(
            done.try_iter().collect::<Vec<_>>(),
            ["mission", "short", "long", "after"]
        );
    }
    #[test]
    fn what_is_given_up_holds_nothing() {
        let pool = Pool::new("test", 1, <[Gauge; 3]>::default());
        let (open, gate) = mpsc::channel::<()>();
        let (_held, _job) = pool.run(Lane::Short, move || gate.recv());
        let held = Arc::new(());
        for _ in 0..3 * LOOK_FOR_ABANDONED {
            let holds = Arc::clone(&held);
            drop(pool.run(Lane::Long, move || drop(holds)));
        }
        assert_eq!(Arc::strong_count(&held), 1);
        let Owner(shared) = &*pool.0;
        assert!(shared.queues().jobs[Lane::Long as usize].len() <= LOOK_FOR_ABANDONED);
        open.send(()).expect("is waited for");
    }
}
