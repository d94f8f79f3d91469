//! The planners behind the service: those for missions, those for requests, and every answer in time.
//!
//! ```text
//! request ──► admission ──► reading (pool) ──► planning (pool) ──► answer, or the lower levels at the deadline
//! mission ────────────────► planning, at a higher priority than either pool
//! ```

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use planner::{
    explain::{Explanation, explain},
    plan::{Plan, Workspace, plan_until},
    policy::Policy,
    snapshot::Snapshot,
    stop::Stop,
};
use tokio::{
    sync::{
        Semaphore,
        oneshot::{self, Receiver, error::TryRecvError},
    },
    task::spawn_blocking,
    time::{timeout, timeout_at},
};
use tracing::{Instrument as _, Span, info_span};

use crate::{
    admission::{Admission, Ticket},
    deadline::{Arrival, Deadline},
    metrics::{Metrics, Shed},
    pool::{Lane, Pool},
    posted::SHORT,
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
    /// Of requests with short bodies and of those with long ones: neither is turned away for the other.
    short: Admission,
    long: Admission,
    /// Reads bodies and builds what they describe.
    reading: Pool,
    /// Plans for requests.
    planning: Pool,
    /// Plans for missions: at most as many at once as there are processors.
    missions: Arc<Semaphore>,
    /// Half of the processors, so that requests for plans do not wait for simulations.
    simulating: Pool,
    deadline: Duration,
    metrics: Metrics,
}

/// A snapshot's plan, and how long it took.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) snapshot: Arc<Snapshot>,
    pub(crate) plan: Plan,
    pub(crate) solve_time: Duration,
}

impl Planners {
    pub(crate) fn new(settings: &Settings, metrics: Metrics) -> Self {
        let &Settings {
            plan,
            planners,
            waiting,
            deadline,
            ..
        } = settings;
        let waiting_in = |pool| Lane::ALL.map(|lane| metrics.waiting(pool, lane.name()));
        Self {
            plan,
            policy: Arc::new(Policy::default()),
            idle: Arc::default(),
            short: Admission::new(planners, waiting, metrics.admitted("short")),
            long: Admission::new(planners, waiting, metrics.admitted("long")),
            reading: Pool::new("read", planners, waiting_in("read")),
            planning: Pool::new("plan", planners, waiting_in("plan")),
            missions: Arc::new(Semaphore::new(planners)),
            simulating: Pool::new("simulate", (planners / 2).max(1), waiting_in("simulate")),
            deadline,
            metrics,
        }
    }

    /// What the service counts.
    pub(crate) fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// What the planners plan by.
    pub(crate) fn policy(&self) -> &Policy {
        &self.policy
    }

    /// Longest time for an answer.
    pub(crate) fn deadline(&self) -> Duration {
        self.deadline
    }

    /// When an answer is due to a request that wants it within so many ms.
    pub(crate) fn due(&self, arrival: Arrival, deadline_ms: Option<f64>) -> Deadline {
        Deadline::new(arrival, deadline_ms, self.deadline)
    }

    /// Takes on a request with a body of `bytes`, which is there. Fails at once when those before it leave no time for it.
    pub(crate) fn admit(&self, bytes: usize) -> Result<Arc<Ticket>, Problem> {
        let (admission, lane) = if bytes <= SHORT {
            (&self.short, Lane::Short)
        } else {
            (&self.long, Lane::Long)
        };
        let admitted = admission.admit(bytes, lane, Instant::now() + self.deadline);
        admitted.inspect_err(|_| self.metrics.shed(Shed::Admission))
    }

    /// Does what a request that was taken on costs before it can be planned, for as long as an answer may take.
    pub(crate) async fn read<T: Send + 'static>(
        &self,
        ticket: &Arc<Ticket>,
        read: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let (lane, ticket) = (ticket.lane, Arc::clone(ticket));
        let read = async {
            let (read, _job) = self.reading.run(lane, move || ticket.work(read));
            timeout(self.deadline, read).await
        };
        let read = read.instrument(info_span!("read")).await;
        read.map_err(|_| self.too_late())?.map_err(|_| Problem::Panicked)
    }

    /// Does what a request about missions costs before a mission hears of it.
    pub(crate) async fn read_for_mission<T: Send + 'static>(
        &self,
        lane: Lane,
        read: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let read = async {
            let (read, _job) = self.reading.run(lane, read);
            read.await
        };
        let read = read.instrument(info_span!("read")).await;
        read.map_err(|_| Problem::Panicked)
    }

    /// Whether a mission, a request or a simulation may have to wait for a processor. Takes no lock.
    pub(crate) fn has_work_waiting(&self) -> bool {
        let pools = [&self.reading, &self.planning, &self.simulating];
        self.missions.available_permits() == 0 || pools.into_iter().any(Pool::has_jobs_waiting)
    }

    /// What a request is told that waited too long for a thread.
    pub(crate) fn too_late(&self) -> Problem {
        self.metrics.shed(Shed::Pool);
        Problem::Overloaded
    }

    /// Plans for a request that was taken on, until the sooner of the service's deadline and `deadline_ms` after
    /// `arrival`. When that comes before a planner is free or done, the lower fallback levels answer.
    pub(crate) async fn plan(
        &self,
        ticket: Arc<Ticket>,
        snapshot: Snapshot,
        arrival: Arrival,
        deadline_ms: Option<f64>,
    ) -> Result<Planned, Problem> {
        let deadline = self.due(arrival, deadline_ms);
        let snapshot = Arc::new(snapshot);
        let (planners, planned) = (self.clone(), Arc::clone(&snapshot));
        // Once it has begun, the thread holds the ticket: a client that goes away does not free a planner that still works.
        let plan = async {
            let (planned, _job) = self.planning.run(ticket.lane, move || {
                ticket.work(|| planners.plan_now(planned, &deadline.stop()))
            });
            self.in_time(planned, snapshot, deadline).await
        };
        plan.instrument(info_span!("plan")).await
    }

    /// Says how the plan of a request that was taken on comes about, in half of the time that is left until `deadline`. None where
    /// that is too short: the answer does not wait for it.
    pub(crate) async fn explain(
        &self,
        ticket: &Arc<Ticket>,
        snapshot: &Arc<Snapshot>,
        deadline: Deadline,
    ) -> Option<Explanation> {
        let deadline = deadline.half_way();
        let (lane, ticket) = (ticket.lane, Arc::clone(ticket));
        let (snapshot, policy, stop) = (Arc::clone(snapshot), Arc::clone(&self.policy), deadline.stop());
        let found = async {
            let (found, _job) = self.planning.run(lane, move || {
                let found = ticket.work(|| explain(&snapshot, &policy, &stop));
                // One that was cut short tells of another plan.
                (!stop.was_due()).then_some(found)
            });
            timeout_at(deadline.instant().into(), found).await
        };
        found.instrument(info_span!("explain")).await.ok()?.ok()?
    }

    /// Plans for a mission, of which there are not more than the service took on, until `limit` after `due`, from what
    /// `facts` makes. Waits for its turn behind other missions.
    pub(crate) async fn plan_in_turn(
        &self,
        facts: impl FnOnce() -> Result<Snapshot, Problem> + Send + 'static,
        due: Arrival,
        limit: Duration,
    ) -> Result<Planned, Problem> {
        let deadline = Deadline::new(due, None, limit);
        let waits = self.metrics.mission_waits();
        let turn = Arc::clone(&self.missions).acquire_owned();
        let turn = turn.instrument(info_span!("queue")).await;
        drop(waits);
        let read = info_span!("read");
        let facts = spawn_blocking(move || (read.in_scope(facts), turn));
        let (snapshot, turn) = facts.await.map_err(|_| Problem::Panicked)?;
        let snapshot = Arc::new(snapshot?);
        let (sender, planned) = oneshot::channel();
        let (planners, facts) = (self.clone(), Arc::clone(&snapshot));
        let span = Span::current();
        spawn_blocking(move || {
            let _in = span.entered();
            // Declared before the turn, and so dropped after it if the planner panics.
            let sender = sender;
            let turn = turn;
            let planned = planners.plan_now(facts, &deadline.stop());
            drop(turn);
            // The mission may be gone.
            let _ = sender.send(planned);
        });
        self.in_time(planned, snapshot, deadline).await
    }

    /// What is planned by the deadline, or else the answer of the lower fallback levels.
    async fn in_time(
        &self,
        mut planned: Receiver<Planned>,
        snapshot: Arc<Snapshot>,
        deadline: Deadline,
    ) -> Result<Planned, Problem> {
        let last_stretch = deadline.instant().checked_sub(LAST_STRETCH);
        let last_stretch = last_stretch.unwrap_or(deadline.instant()).into();
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

    /// Simulates on one of the processors that simulations have, in turn.
    pub(crate) async fn simulate<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let (worked, _job) = self.simulating.run(Lane::Long, work);
        worked.await.map_err(|_| Problem::Panicked)
    }

    fn plan_now(&self, snapshot: Arc<Snapshot>, stop: &Stop) -> Planned {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        // A workspace that was in use when a planner panicked is not put back.
        let mut workspace = idle().pop().unwrap_or_default();
        let start = Instant::now();
        let _solve = info_span!("solve").entered();
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

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::metrics::StoreMetrics;

    #[tokio::test]
    async fn work_waits_while_every_thread_for_it_is_busy_and_not_afterwards() {
        let settings = Settings {
            planners: 1,
            ..Settings::default()
        };
        let metrics = Metrics::new(&settings.connections, &StoreMetrics::default());
        let planners = Planners::new(&settings, metrics);
        let (open, gate) = mpsc::channel::<()>();
        let (begun, begins) = oneshot::channel();
        let hold = planners.read_for_mission(Lane::Long, move || {
            begun.send(()).expect("is waited for");
            gate.recv()
        });
        let next = planners.read_for_mission(Lane::Long, || {});
        let watch = async {
            begins.await.expect("begins");
            while !planners.has_work_waiting() {
                tokio::task::yield_now().await;
            }
            open.send(()).expect("is waited for");
        };
        assert!(!planners.has_work_waiting());
        let (held, next, ()) = tokio::join!(hold, next, watch);
        assert!(held.is_ok_and(|opened| opened.is_ok()) && next.is_ok());
        assert!(!planners.has_work_waiting());
        let turn = planners.missions.acquire().await;
        assert!(planners.has_work_waiting());
        drop(turn);
        assert!(!planners.has_work_waiting());
    }
}
