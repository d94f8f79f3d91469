//! The planners behind the service: a few at a time, a short queue, and every answer in time.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use planner::{
    plan::{Plan, Workspace, plan_until},
    policy::Policy,
    snapshot::Snapshot,
    stop::Stop,
};
use tokio::{
    sync::{
        OwnedSemaphorePermit, Semaphore,
        oneshot::{self, Receiver, error::TryRecvError},
    },
    task::spawn_blocking,
    time::timeout_at,
};

use crate::{
    deadline::{Arrival, Deadline},
    problem::Problem,
    settings::{PlanFn, Settings},
};

/// The coarsest that Tokio's timers are, and the wake-up of a thread: the last stretch before a deadline is
/// waited for in shorter steps.
const LAST_STRETCH: Duration = Duration::from_micros(1500);
/// A step of the last stretch: what the kernel adds to a shorter sleep by itself.
const STEP: Duration = Duration::from_micros(50);

/// Planners with their memory. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Planners {
    plan: PlanFn,
    policy: Arc<Policy>,
    /// Memory of planners at rest. Which one a request gets changes its time, never its answer.
    idle: Arc<Mutex<Vec<Workspace>>>,
    running: Arc<Semaphore>,
    admitted: Arc<Semaphore>,
    /// Simulations take half of the processors, so that requests for plans do not wait for them.
    simulating: Arc<Semaphore>,
    deadline: Duration,
}

/// A snapshot's plan, and how long it took.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) snapshot: Arc<Snapshot>,
    pub(crate) plan: Plan,
    pub(crate) solve_time: Duration,
}

impl Planners {
    pub(crate) fn new(settings: &Settings) -> Self {
        let &Settings {
            plan,
            planners,
            waiting,
            deadline,
            ..
        } = settings;
        Self {
            plan,
            policy: Arc::new(Policy::default()),
            idle: Arc::default(),
            running: Arc::new(Semaphore::new(planners)),
            admitted: Arc::new(Semaphore::new(planners + waiting)),
            simulating: Arc::new(Semaphore::new((planners / 2).max(1))),
            deadline,
        }
    }

    /// What the planners plan by.
    pub(crate) fn policy(&self) -> &Policy {
        &self.policy
    }

    /// Plans on a thread of its own, until the sooner of the service's deadline and `deadline_ms` after `arrival`.
    /// When that comes before a planner is free or done, the lower fallback levels answer. Fails at once when
    /// the queue is full.
    pub(crate) async fn plan(
        &self,
        snapshot: Snapshot,
        arrival: Arrival,
        deadline_ms: Option<f64>,
    ) -> Result<Planned, Problem> {
        let admitted = Arc::clone(&self.admitted)
            .try_acquire_owned()
            .map_err(|_| Problem::Overloaded)?;
        let deadline = Deadline::new(arrival, deadline_ms, self.deadline);
        self.plan_by(snapshot, deadline, Some(admitted)).await
    }

    /// Plans for a mission, of which there are not more than the service took on, until `limit` after `due`. Waits for
    /// its turn behind earlier requests.
    pub(crate) async fn plan_in_turn(
        &self,
        snapshot: Snapshot,
        due: Arrival,
        limit: Duration,
    ) -> Result<Planned, Problem> {
        self.plan_by(snapshot, Deadline::new(due, None, limit), None)
            .await
    }

    /// Waits for one of the processors that simulations have.
    pub(crate) async fn simulation(&self) -> OwnedSemaphorePermit {
        let turn = Arc::clone(&self.simulating).acquire_owned().await;
        turn.expect("is never closed")
    }

    async fn plan_by(
        &self,
        snapshot: Snapshot,
        deadline: Deadline,
        admitted: Option<OwnedSemaphorePermit>,
    ) -> Result<Planned, Problem> {
        let last_stretch = deadline.instant().checked_sub(LAST_STRETCH);
        let last_stretch = last_stretch.unwrap_or(deadline.instant()).into();
        let snapshot = Arc::new(snapshot);

        let turn = timeout_at(last_stretch, Arc::clone(&self.running).acquire_owned());
        let Ok(turn) = turn.await else {
            let planners = self.clone();
            let lower_levels = spawn_blocking(move || {
                let _permit = admitted;
                planners.lower_levels(snapshot)
            });
            return lower_levels.await.map_err(|_| Problem::Panicked);
        };
        let running = turn.expect("is never closed");
        let mut planned = self.start(&snapshot, deadline, (admitted, running));
        if let Ok(planned) = timeout_at(last_stretch, &mut planned).await {
            return planned.map_err(|_| Problem::Panicked);
        }
        let planners = self.clone();
        let in_time = spawn_blocking(move || match wait(planned, deadline) {
            Some(planned) => planned,
            None => Ok(planners.lower_levels(snapshot)),
        });
        in_time.await.map_err(|_| Problem::Panicked)?
    }

    /// Starts to plan on a thread. The sender of the answer is dropped if the planner panics.
    fn start(
        &self,
        snapshot: &Arc<Snapshot>,
        deadline: Deadline,
        permits: (Option<OwnedSemaphorePermit>, OwnedSemaphorePermit),
    ) -> Receiver<Planned> {
        let (sender, receiver) = oneshot::channel();
        let (planners, snapshot) = (self.clone(), Arc::clone(snapshot));
        spawn_blocking(move || {
            // Declared before the permits, and so dropped after them if the planner panics: a client that has an answer
            // may ask again at once.
            let sender = sender;
            // Held by the thread: a client that goes away does not free a planner that still works.
            let permits = permits;
            let planned = planners.plan_now(snapshot, &deadline.stop());
            drop(permits);
            // The client may be gone.
            let _ = sender.send(planned);
        });
        receiver
    }

    fn plan_now(&self, snapshot: Arc<Snapshot>, stop: &Stop) -> Planned {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        // A workspace that was in use when a planner panicked is not put back.
        let mut workspace = idle().pop().unwrap_or_default();
        let start = Instant::now();
        let plan = (self.plan)(&snapshot, &self.policy, &mut workspace, stop);
        let solve_time = start.elapsed();
        idle().push(workspace);
        Planned {
            snapshot,
            plan,
            solve_time,
        }
    }

    /// The answer without a program: well under a millisecond of arithmetic.
    fn lower_levels(&self, snapshot: Arc<Snapshot>) -> Planned {
        let start = Instant::now();
        let plan = plan_until(
            &snapshot,
            &self.policy,
            &mut Workspace::default(),
            &Stop::at_once(),
        );
        Planned {
            snapshot,
            plan,
            solve_time: start.elapsed(),
        }
    }
}

/// What comes before the deadline; `None` if nothing does.
fn wait(mut planned: Receiver<Planned>, deadline: Deadline) -> Option<Result<Planned, Problem>> {
    loop {
        match planned.try_recv() {
            Ok(planned) => return Some(Ok(planned)),
            Err(TryRecvError::Closed) => return Some(Err(Problem::Panicked)),
            Err(TryRecvError::Empty) if deadline.instant() <= Instant::now() => return None,
            Err(TryRecvError::Empty) => thread::sleep(STEP),
        }
    }
}
