//! The planners behind the service: a few at a time, a short queue, and no answer rather than a late one.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use planner::{
    plan::{Plan, Workspace},
    policy::Policy,
    snapshot::Snapshot,
};
use tokio::sync::Semaphore;

use crate::problem::Problem;

/// What makes a plan of a snapshot: [`planner::plan::plan`], or in tests something that fails on purpose.
pub type PlanFn = fn(&Snapshot, &Policy, &mut Workspace) -> Plan;

/// Planners with their memory. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Planners {
    plan: PlanFn,
    policy: Arc<Policy>,
    /// Memory of planners at rest. Which one a request gets changes its time, never its answer.
    idle: Arc<Mutex<Vec<Workspace>>>,
    running: Arc<Semaphore>,
    admitted: Arc<Semaphore>,
}

/// A snapshot's plan, and how long it took.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) snapshot: Snapshot,
    pub(crate) plan: Plan,
    pub(crate) solve_time: Duration,
}

impl Planners {
    /// `at_once` planners, and room for `waiting` requests more.
    pub(crate) fn new(plan: PlanFn, at_once: usize, waiting: usize) -> Self {
        Self {
            plan,
            policy: Arc::new(Policy::default()),
            idle: Arc::default(),
            running: Arc::new(Semaphore::new(at_once)),
            admitted: Arc::new(Semaphore::new(at_once + waiting)),
        }
    }

    /// Plans on a thread of its own. Fails at once when the queue is full.
    pub(crate) async fn plan(&self, snapshot: Snapshot) -> Result<Planned, Problem> {
        let admitted = Arc::clone(&self.admitted)
            .try_acquire_owned()
            .map_err(|_| Problem::Overloaded)?;
        let running = Arc::clone(&self.running)
            .acquire_owned()
            .await
            .expect("is never closed");
        let planners = self.clone();
        let task = tokio::task::spawn_blocking(move || {
            // Held by the thread: a client that goes away does not free a planner that still works.
            let _permits = (admitted, running);
            planners.plan_now(snapshot)
        });
        task.await.map_err(|_| Problem::Panicked)
    }

    fn plan_now(&self, snapshot: Snapshot) -> Planned {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        // A workspace that was in use when a planner panicked is not put back.
        let mut workspace = idle().pop().unwrap_or_default();
        let start = Instant::now();
        let plan = (self.plan)(&snapshot, &self.policy, &mut workspace);
        let solve_time = start.elapsed();
        idle().push(workspace);
        Planned {
            snapshot,
            plan,
            solve_time,
        }
    }
}
