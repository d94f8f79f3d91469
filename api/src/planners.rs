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

use crate::{Settings, problem::Problem};

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
    time_limit: Duration,
}

/// A snapshot's plan, and how long it took.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) snapshot: Snapshot,
    pub(crate) plan: Plan,
    pub(crate) solve_time: Duration,
}

impl Planners {
    pub(crate) fn new(settings: &Settings) -> Self {
        let &Settings {
            plan,
            planners,
            waiting,
            time_limit,
            ..
        } = settings;
        Self {
            plan,
            policy: Arc::new(Policy::default()),
            idle: Arc::default(),
            running: Arc::new(Semaphore::new(planners)),
            admitted: Arc::new(Semaphore::new(planners + waiting)),
            time_limit,
        }
    }

    /// What the planners plan by.
    pub(crate) fn policy(&self) -> &Policy {
        &self.policy
    }

    /// Plans on a thread of its own. Fails at once when the queue is full, and after the time limit.
    pub(crate) async fn plan(&self, snapshot: Snapshot) -> Result<Planned, Problem> {
        tokio::time::timeout(self.time_limit, self.plan_in_turn(snapshot))
            .await
            .unwrap_or(Err(Problem::TimedOut))
    }

    async fn plan_in_turn(&self, snapshot: Snapshot) -> Result<Planned, Problem> {
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
