//! Threads for work that any client may ask for: below the priority of the threads that plan for missions.

use std::{
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread,
};

use tokio::sync::oneshot;

/// How much lower these threads' priority is, in steps of `nice`: beside a thread that plans for a mission one of these
/// gets a quarter of a processor, and all of it when no mission plans.
const NICE: i32 = 5;

type Job = Box<dyn FnOnce() + Send>;

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
    wake: Condvar,
}

#[derive(Default)]
struct Queues {
    /// By lane.
    jobs: [VecDeque<Job>; 3],
    closed: bool,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Pool {
    /// `n` threads called `name`.
    pub(crate) fn new(name: &str, n: usize) -> Self {
        let shared = Arc::new(Shared::default());
        for _ in 0..n {
            let shared = Arc::clone(&shared);
            let thread = thread::Builder::new().name(name.to_owned());
            let started = thread.spawn(move || shared.work());
            started.expect("a service starts before it runs out of threads");
        }
        Self(Arc::new(Owner(shared)))
    }

    /// Has a thread do `work`. The receiver fails if it panics; work whose receiver is dropped before it begins is not
    /// done.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        lane: Lane,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> oneshot::Receiver<T> {
        let (sender, receiver) = oneshot::channel();
        self.push(lane, move || {
            if !sender.is_closed() {
                // The caller may be gone by the end.
                let _ = sender.send(work());
            }
        });
        receiver
    }

    /// Has a thread do `job`.
    pub(crate) fn push(&self, lane: Lane, job: impl FnOnce() + Send + 'static) {
        let Owner(shared) = &*self.0;
        let mut queues = shared.queues();
        queues.jobs[lane as usize].push_back(Box::new(job));
        drop(queues);
        shared.wake.notify_one();
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
            // The panic hook has told of it; the caller sees that no result came.
            let _ = catch_unwind(AssertUnwindSafe(job));
        }
    }

    /// The next job; none when the pool is dropped.
    fn next(&self) -> Option<Job> {
        let mut queues = self.queues();
        loop {
            if queues.closed {
                return None;
            }
            if let Some(job) = queues.jobs.iter_mut().find_map(VecDeque::pop_front) {
                return Some(job);
            }
            queues = self.wake.wait(queues).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn a_mission_goes_first_a_short_body_next_and_a_panic_takes_no_thread() {
        let pool = Pool::new("test", 1);
        let (open, gate) = mpsc::channel::<()>();
        let held = pool.run(Lane::Short, move || gate.recv());
        let (order, done) = mpsc::channel();
        let tell = |what: &'static str| {
            let order = order.clone();
            move || order.send(what).expect("is heard")
        };
        let long = pool.run(Lane::Long, tell("long"));
        let later = [
            pool.run(Lane::Short, tell("short")),
            pool.run(Lane::Short, || panic!("on purpose")),
            pool.run(Lane::Mission, tell("mission")),
        ];
        drop(pool.run(Lane::Mission, tell("given up")));
        open.send(()).expect("is waited for");
        let [short, panicked, mission] = later;
        held.blocking_recv().expect("is done").expect("was opened");
        mission.blocking_recv().expect("is done");
        short.blocking_recv().expect("is done");
        long.blocking_recv().expect("is done");
        assert!(panicked.blocking_recv().is_err());
        pool.run(Lane::Short, tell("after"))
            .blocking_recv()
            .expect("is done");
        assert_eq!(
            done.try_iter().collect::<Vec<_>>(),
            ["mission", "short", "long", "after"]
        );
    }
}
