//! The planners of the service, for missions and for requests. Every answer comes by its deadline.
//!
//! ```text
//! request ──► admission ──► reading (pool) ──► planning (pool) ──► answer, or lower level when due
//! mission ────────────────► planning, at a higher priority than either pool
//! ```

use std::sync::Arc;
use std::time::Duration;

use clock::Clock;
use parking_lot::Mutex;
use planner::{
    parameters::Parameters,
    plan::{Plan, Workspace, plan_until},
    snapshot::Snapshot,
    stop::Stop,
};
use store::StoreMetrics;
use tokio::sync::{
    Semaphore,
    oneshot::{self, Receiver, error::TryRecvError},
};
use tracing::{Instrument as _, Span, info_span};

use crate::edge::arrival::Arrival;
use crate::edge::problem::Problem;
use crate::limits::{IDLE_BYTES_MAX, SHORT_BYTES_MAX};
use crate::metrics::{Metrics, PlanFor, Shed};
use crate::planning::admission::{Admission, Permit, Work};
use crate::planning::deadline::Deadline;
use crate::planning::pool::{Caller, Job, Pool, Priority};
use crate::settings::{PlanFn, Settings};

/// The planners, with their workspaces. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Planners {
    plan: PlanFn,
    pub(crate) parameters: Arc<Parameters>,
    /// Idle workspaces of requests, and of missions: no request can use up a mission's.
    idle: Arc<[Mutex<Vec<Workspace>>; 2]>,
    /// Requests with short bodies, and those with long ones: neither kind displaces the other.
    short: Admission,
    long: Admission,
    /// Reads and checks bodies.
    reading: Pool,
    planning: Pool,
    /// Limits the plans for missions to one for each processor.
    missions: Arc<Semaphore>,
    /// Simulates on half of the processors, so that plans do not wait for simulations.
    simulating: Pool,
    pub(crate) deadline: Duration,
    pub(crate) clock: Clock,
    pub(crate) metrics: Metrics,
}

/// The plan of a snapshot, and its solve time.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) snapshot: Arc<Snapshot>,
    pub(crate) plan: Plan,
    pub(crate) solve_time: Duration,
}

impl AsRef<Plan> for Planned {
    fn as_ref(&self) -> &Plan {
        &self.plan
    }
}

impl Planners {
    pub(crate) fn new(settings: &Settings, store: &StoreMetrics) -> Self {
        let (planners, waiting, clock) = (settings.planners, settings.waiting, &settings.clock);
        let metrics = Metrics::new(&settings.connections, store, settings.log_lines_dropped);
        let waiting_in = |pool| Priority::ALL.map(|priority| metrics.waiting(pool, priority.name()));
        Self {
            plan: settings.plan,
            parameters: Arc::new(Parameters::default()),
            idle: Arc::default(),
            short: Admission::new(planners, waiting, metrics.admitted("short")),
            long: Admission::new(planners, waiting, metrics.admitted("long")),
            reading: Pool::new("read", planners, waiting_in("read"), clock),
            planning: Pool::new("plan", planners, waiting_in("plan"), clock),
            missions: Arc::new(Semaphore::new(planners)),
            simulating: Pool::new("simulate", (planners / 2).max(1), waiting_in("simulate"), clock),
            deadline: settings.deadline,
            clock: clock.clone(),
            metrics,
        }
    }

    /// Admits a request for `work` with `bytes` of body. Fails if it cannot be done in time.
    pub(crate) fn admit(&self, work: Work, bytes: usize) -> Result<Arc<Permit>, Problem> {
        let (admission, priority) = if bytes <= SHORT_BYTES_MAX {
            (&self.short, Priority::Short)
        } else {
            (&self.long, Priority::Long)
        };
        let now = self.clock.now();
        let admitted = admission.admit(now, (work, bytes), priority, now + self.deadline);
        admitted.inspect_err(|_| self.metrics.shed(Shed::Admission))
    }

    /// Reads the body of an admitted request, if a thread is free within the deadline. Long
    /// readings check the time and whether the caller is gone.
    pub(crate) async fn read<T: Send + 'static>(
        &self,
        permit: &Arc<Permit>,
        read: impl FnOnce(Caller) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let (priority, permit, clock) = (permit.priority, Arc::clone(permit), self.clock.clone());
        let read = async {
            let work = move |caller| permit.work(&clock, || read(caller));
            let (mut read, job) = self.reading.run(priority, work);
            match self.clock.timeout(self.deadline, &mut read).await {
                Err(_) if job.give_up() => return Err(self.too_late()),
                Err(_) => read.await,
                Ok(read) => read,
            }
            .map_err(|_| Problem::Panicked)
        };
        read.instrument(info_span!("read")).await
    }

    /// Reads a body of `bytes` about missions: where it arrived, if it is short.
    pub(crate) async fn read_body_for_mission<T: Send + 'static>(
        &self,
        priority: Priority,
        bytes: usize,
        read: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        if bytes <= SHORT_BYTES_MAX {
            return Ok(read());
        }
        self.read_for_mission(priority, read).await
    }

    /// Reads or computes something for a request about missions.
    pub(crate) async fn read_for_mission<T: Send + 'static>(
        &self,
        priority: Priority,
        read: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let read = async {
            let (read, _job) = self.reading.run(priority, |_| read());
            read.await
        };
        let read = read.instrument(info_span!("read")).await;
        read.map_err(|_| Problem::Panicked)
    }

    /// The problem of a request that waited too long for a thread.
    pub(crate) fn too_late(&self) -> Problem {
        self.metrics.shed(Shed::Pool);
        Problem::Overloaded
    }

    /// Plans for an admitted request until `deadline`, and writes the `answer`, which may check the
    /// time. If no plan is ready by then, lower fallback levels answer. Ends with its caller.
    pub(crate) async fn plan<T: Send + 'static>(
        &self,
        permit: Arc<Permit>,
        snapshot: Snapshot,
        deadline: Deadline,
        answer: impl Fn(&Planned, &Stop) -> T + Send + Sync + 'static,
    ) -> Result<(Planned, T), Problem> {
        let snapshot = Arc::new(snapshot);
        let answered = Arc::new(move |planned: Planned, stop: &Stop| {
            let answer = answer(&planned, stop);
            (planned, answer)
        });
        let (planners, planned, answer) = (self.clone(), Arc::clone(&snapshot), Arc::clone(&answered));
        // A working thread holds the permit: it is busy even if its client disconnects.
        let plan = async {
            let (made, _job) = self.planning.run(permit.priority, move |caller| {
                permit.work(&planners.clock, || {
                    let stop = deadline.stop(&planners.clock, caller);
                    answer(planners.plan_now(PlanFor::Request, planned, &stop), &stop)
                })
            });
            let (planners, span) = (self.clone(), Span::current());
            let lower = move || {
                let lower_levels = || answered(planners.lower_levels(snapshot), &Stop::at_once());
                span.in_scope(lower_levels)
            };
            self.in_time(made, deadline, lower).await
        };
        plan.instrument(info_span!("plan")).await
    }

    /// Plans for a mission until `limit` after `due`, and returns the facts, too. `facts` may check
    /// the time by the stop signals of its parts, and `plan` makes plans of snapshots, one after the
    /// other, if so many are left. Waits behind other missions, whose number is limited.
    pub(crate) async fn plan_in_turn<F: Send + Sync + 'static, T: Send + 'static>(
        &self,
        facts: impl FnOnce(&dyn Fn(usize) -> Stop) -> Result<F, Problem> + Send + 'static,
        plan: impl Fn(&F, &mut dyn FnMut(Arc<Snapshot>, usize) -> Planned) -> T + Copy + Send + 'static,
        due: Arrival,
        limit: Duration,
    ) -> Result<(Arc<F>, T), Problem> {
        let deadline = Deadline::new(due, None, limit);
        let waits = self.metrics.mission_waits();
        let turn = Arc::clone(&self.missions).acquire_owned();
        let turn = turn.instrument(info_span!("queue")).await;
        drop(waits);
        let clock = self.clock.clone();
        let share = move |parts: usize| deadline.share(&clock, parts).stop(&clock, Caller::STAYS);
        let (read, until) = (info_span!("read"), share.clone());
        let facts = move || (read.in_scope(|| facts(&until)), turn);
        let facts = self.clock.run_blocking(facts);
        let (facts, turn) = facts.await.map_err(|_| Problem::Panicked)?;
        let facts = Arc::new(facts?);
        let (sender, planned) = oneshot::channel();
        let (planners, known) = (self.clone(), Arc::clone(&facts));
        let span = Span::current();
        self.clock.spawn_blocking(move || {
            let _in = span.entered();
            // Dropped after the turn if the planner panics, because it is declared before it.
            let sender = sender;
            let turn = turn;
            let planned =
                plan(&known, &mut |snapshot, left| planners.plan_now(PlanFor::Live, snapshot, &share(left)));
            drop(turn);
            // Fails if the mission is gone.
            let _ = sender.send(planned);
        });
        let (planners, known) = (self.clone(), Arc::clone(&facts));
        let lower = move || plan(&known, &mut |snapshot, _| planners.lower_levels(snapshot));
        Ok((facts, self.in_time(planned, deadline, lower).await?))
    }

    /// The plan, if it is made by the deadline; otherwise that of the `lower` fallback levels.
    async fn in_time<T: Send + 'static>(
        &self,
        mut planned: Receiver<T>,
        deadline: Deadline,
        lower: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let last_stretch = self.clock.last_stretch(deadline.instant());
        if let Ok(planned) = self.clock.timeout_at(last_stretch, &mut planned).await {
            return planned.map_err(|_| Problem::Panicked);
        }
        let arrived = move || match planned.try_recv() {
            Ok(planned) => Some(Ok(planned)),
            Err(TryRecvError::Closed) => Some(Err(Problem::Panicked)),
            Err(TryRecvError::Empty) => None,
        };
        if let Some(planned) = self.clock.by(deadline.instant(), arrived).await {
            return planned;
        }
        self.clock.run_blocking(lower).await.map_err(|_| Problem::Panicked)
    }

    /// Waits until a thread of each pool for requests is free.
    pub(crate) async fn try_pools(&self) -> Result<(), Problem> {
        for pool in [&self.reading, &self.planning] {
            let (done, _job) = pool.run(Priority::Mission, |_| ());
            done.await.map_err(|_| Problem::Panicked)?;
        }
        Ok(())
    }

    /// Simulates after earlier simulations while the job is held. Work of [`Priority::Long`] is
    /// short too: others wait for it.
    pub(crate) fn simulate<T: Send + 'static>(
        &self,
        priority: Priority,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> (Receiver<T>, Arc<Job>) {
        self.simulating.run(priority, |_| work())
    }

    fn plan_now(&self, purpose: PlanFor, snapshot: Arc<Snapshot>, stop: &Stop) -> Planned {
        let start = self.clock.now();
        let _solve = info_span!("solve").entered();
        let (plan, solve_time) = self.with_workspace(purpose, |workspace| {
            let plan = (self.plan)(&snapshot, &self.parameters, workspace, stop);
            (plan, self.clock.since(start))
        });
        Planned { snapshot, plan, solve_time }
    }

    /// Does `work` in an idle workspace. The choice changes the time of a plan, never the answer.
    pub(crate) fn with_workspace<T>(&self, purpose: PlanFor, work: impl FnOnce(&mut Workspace) -> T) -> T {
        let idle = &self.idle[usize::from(purpose == PlanFor::Live)];
        let idle = || idle.lock();
        // A panic drops the workspace.
        let mut workspace = idle().pop().unwrap_or_default();
        let done = work(&mut workspace);
        workspace.shrink();
        let mut idle = idle();
        idle.push(workspace);
        // The last returned workspace is the first to be reused.
        while IDLE_BYTES_MAX < idle.iter().map(Workspace::bytes).sum() {
            idle.remove(0);
        }
        done
    }

    /// The plan without a program: well under a millisecond.
    fn lower_levels(&self, snapshot: Arc<Snapshot>) -> Planned {
        let start = self.clock.now();
        let plan = plan_until(&snapshot, &self.parameters, &mut Workspace::default(), &Stop::at_once());
        Planned { snapshot, plan, solve_time: self.clock.since(start) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::examples::EXAMPLES;

    /// The machine's threads run, and every machine meets the deadline.
    #[tokio::test]
    async fn requests_that_hold_every_planner_keep_no_mission_waiting() {
        let settings = Settings { planners: 1, ..Settings::default() };
        let planners = Planners::new(&settings, &StoreMetrics::default());
        let (open, gate) = mpsc::channel::<()>();
        let gate = Arc::new(Mutex::new(gate));
        let held = [&planners.reading, &planners.planning].map(|pool| {
            let gate = Arc::clone(&gate);
            pool.run(Priority::Short, move |_| {
                let _ = gate.lock().recv();
            })
        });
        let request = wire::read(EXAMPLES[0].body.as_bytes()).expect("is JSON");
        let facts =
            |_: &dyn Fn(usize) -> Stop| wire::snapshot(request).map(Arc::new).map_err(Problem::Invalid);
        let plan = |facts: &Arc<Snapshot>, plan: &mut dyn FnMut(Arc<Snapshot>, usize) -> Planned| {
            plan(Arc::clone(facts), 1)
        };
        let due = Arrival(planners.clock.now());
        let planned = planners.plan_in_turn(facts, plan, due, Duration::from_hours(1)).await;
        assert_eq!(planned.expect("is planned for").1.plan.degraded, None);
        drop(open);
        for (done, _job) in held {
            done.await.expect("was held until then");
        }
    }
}
