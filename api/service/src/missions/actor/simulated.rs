//! A simulated mission, which runs as fast as its client requests.

use std::collections::BTreeMap;
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clock::Clock;
use parking_lot::Mutex;
use planner::plan::Workspace;

use super::{
    Actor, Checkpoint, Command, Context, FIXED_SETTING, IdempotencyKey, NO_REPORTS, Stored, StoredPlan,
};
use store::{EventReader, StoreError};

use crate::edge::problem::Problem;
use crate::metrics::PlanFor;
use crate::missions::event::Event;
use crate::missions::simulation::{Simulation, Tick};
use crate::planning::pool::Priority;
use wire::mission;

/// Plans that are stored together without a speed factor: some tens of milliseconds of work.
const TICKS_AT_ONCE: usize = 16;

/// Longest work of a job: other simulations and checks of new missions wait for it.
const SLICE: Duration = Duration::from_millis(50);

/// Time for which a request waits before a job that has not begun gives way.
const GRACE: Duration = Duration::from_millis(100);

const PAUSE: Duration = Duration::from_secs(1);
/// Longest pause after failures in a row: each attempt may simulate everything again.
const PAUSE_MAX: Duration = Duration::from_mins(1);

pub(in crate::missions) struct Simulated {
    context: Context,
    config: mission::Simulated,
    /// `None` until needed: then stored events are simulated again.
    progress: Option<RunningSimulation>,
    due: Instant,
    pause: Duration,
}

struct RunningSimulation {
    simulation: Box<Simulation>,
    /// Number of its last stored event.
    sequence: u64,
    /// Later plans, which are not stored yet, and the event of the end, if it came.
    ticks: Vec<Tick>,
    end: Option<Event>,
}

impl Simulated {
    pub(in crate::missions) fn new(context: Context, config: mission::Simulated) -> Self {
        Self { config, progress: None, due: context.clock().now(), context, pause: PAUSE }
    }
}

impl Actor for Simulated {
    fn context(&mut self) -> &mut Context {
        &mut self.context
    }

    fn due(&self) -> Instant {
        self.due
    }

    async fn execute(&mut self, command: Command, key: Option<IdempotencyKey>) -> Result<Vec<u8>, Problem> {
        let at_s = self.context.clock().unix_s();
        let event = match command {
            Command::Report(..) => return Err(Problem::conflict(NO_REPORTS)),
            Command::Change(..) => return Err(Problem::conflict(FIXED_SETTING)),
            Command::Step(_) if self.context.is_running() => {
                return Err(Problem::conflict("the mission is running: pause it first"));
            }
            Command::Step(ticks) => return Ok(self.step(ticks as usize, key).await?.answer),
            Command::Run(speed_factor) => {
                self.due = self.context.clock().now();
                Event::Ran { at_s, speed_factor }
            }
            Command::Pause => Event::Paused { at_s },
            Command::Finish => Event::Finished { at_s },
        };
        Ok(self.context.append(&[event], key, None).await?.answer)
    }

    /// Makes one plan, several without a speed factor, or repeats a part of the stored ones.
    async fn advance(&mut self) {
        let (due, n_ticks) = match self.context.mission.speed_factor {
            Some(factor) => {
                // A late plan delays the later ones: the simulation does not catch up.
                let next = self.due + Duration::from_secs_f64(1.0 / factor);
                (self.context.clock().now().max(next), 1)
            }
            None => (self.due, TICKS_AT_ONCE),
        };
        match self.proceed(n_ticks).await {
            Ok(has_made) => {
                self.pause = PAUSE;
                if has_made {
                    self.due = due;
                }
            }
            Err(problem) => {
                let mission = &self.context.mission.id;
                tracing::warn!(mission, ?problem, "the simulation did not advance");
                self.due = self.context.clock().now() + self.pause;
                self.pause = PAUSE_MAX.min(2 * self.pause);
            }
        }
    }
}

impl Simulated {
    /// Makes at most `n_ticks` plans in one job and stores them. `false` if it made none: it
    /// repeated stored events, or a request came first.
    async fn proceed(&mut self, n_ticks: usize) -> Result<bool, Problem> {
        self.simulate(n_ticks, true).await?;
        let has_made =
            |progress: &mut RunningSimulation| !progress.ticks.is_empty() || progress.end.is_some();
        let Some(progress) = self.progress.take_if(has_made) else {
            return Ok(false);
        };
        self.store(progress, None).await?;
        Ok(true)
    }

    /// Makes `n_ticks` plans, or fewer at the end, in as many jobs as necessary.
    async fn step(&mut self, n_ticks: usize, key: Option<IdempotencyKey>) -> Result<Stored, Problem> {
        loop {
            self.simulate(n_ticks, false).await?;
            if let Some(progress) = self.progress.take_if(|progress| progress.has_made(n_ticks)) {
                return self.store(progress, key).await;
            }
        }
    }

    /// A job of the simulation that makes up to `n_ticks` plans. If it `gives_way`, a request that
    /// comes before it begins cancels it. An error drops the simulation.
    async fn simulate(&mut self, n_ticks: usize, gives_way: bool) -> Result<(), Problem> {
        let (config, store) = (self.config.clone(), self.context.store.clone());
        let (clock, number) = (self.context.clock().clone(), self.context.number);
        let last = self.context.mission.sequence;
        let waiting = Arc::new(Mutex::new(self.progress.take()));
        let (begun, planners) = (Arc::clone(&waiting), self.context.planners.clone());
        let (mut worked, job) = self.context.planners.simulate(Priority::Long, move || {
            let begun = begun.lock().take();
            let progress = begun.map_or_else(|| RunningSimulation::new(&config, &clock), Ok)?;
            let reader = || Ok((store.reader()?, number));
            planners.with_workspace(PlanFor::Simulated, |workspace| {
                progress.until(last, n_ticks, &clock, reader, workspace)
            })
        });
        if gives_way {
            let clock = self.context.clock().clone();
            let called = async {
                clock.sleep(GRACE).await;
                self.context.called().await;
            };
            let worked = tokio::select! {
                biased;
                worked = &mut worked => Some(worked),
                () = called => None,
            };
            if let Some(worked) = worked {
                self.progress = Some(worked.map_err(|_| Problem::Panicked)??);
                return Ok(());
            }
            if job.give_up() {
                self.progress = waiting.lock().take();
                return Ok(());
            }
        }
        self.progress = Some(worked.await.map_err(|_| Problem::Panicked)??);
        Ok(())
    }

    /// Stores the new plans. An error drops the simulation.
    async fn store(
        &mut self,
        mut progress: RunningSimulation,
        key: Option<IdempotencyKey>,
    ) -> Result<Stored, Problem> {
        let ticks = mem::take(&mut progress.ticks);
        let n_plans = ticks.len() as u64;
        let plan = ticks.last().map(|tick| {
            Arc::new(StoredPlan {
                craft: None,
                sequence: self.context.mission.sequence + n_plans,
                time: tick.planned.t_s,
                late: 0.0,
                answer: tick.answer.clone(),
                heard: BTreeMap::new(),
                made: None,
            })
        });
        let metrics = &self.context.planners.metrics;
        for Tick { made, .. } in &ticks {
            metrics.plan(PlanFor::Simulated, &made.plan, made.solve_time);
        }
        let planned = |tick: Tick| Event::Planned(Box::new(tick.planned));
        let events: Vec<_> = ticks.into_iter().map(planned).chain(progress.end.take()).collect();
        let checkpoint = plan.as_ref().map(|plan| Checkpoint::new(None, std::slice::from_ref(plan)));
        let stored = self.context.append(&events, key, checkpoint).await?;
        if stored.is_new {
            progress.sequence = self.context.mission.sequence;
            self.progress = Some(progress);
            if let Some(plan) = plan {
                self.context.show(vec![plan], vec![]);
            }
        }
        Ok(stored)
    }
}

impl RunningSimulation {
    fn new(config: &mission::Simulated, clock: &Clock) -> Result<Self, StoreError> {
        Ok(Self {
            simulation: Box::new(Simulation::new(config, clock).map_err(StoreError::Damaged)?),
            sequence: 0,
            ticks: vec![],
            end: None,
        })
    }

    fn has_made(&self, n_ticks: usize) -> bool {
        self.ticks.len() == n_ticks || self.end.is_some()
    }

    /// Continues for [`SLICE`]: repeats the events stored up to `last`, from the reader and by the
    /// mission's number, then makes new plans until there are `n_ticks`.
    fn until(
        mut self,
        last: u64,
        n_ticks: usize,
        clock: &Clock,
        stored: impl FnOnce() -> Result<(EventReader, u64), StoreError>,
        workspace: &mut Workspace,
    ) -> Result<Self, StoreError> {
        let begun = clock.now();
        let has_time = || clock.since(begun) < SLICE;
        if self.sequence < last {
            let (reader, number) = stored()?;
            while self.sequence < last && has_time() {
                reader.each(number, self.sequence, self.sequence + 1, &mut |stored| {
                    if let Event::Planned(planned) = Event::read(stored)? {
                        let ticked = self.simulation.tick(Some(&planned), workspace);
                        ticked.map_err(|error| StoreError::Damaged(error.to_string()))?;
                    }
                    Ok(())
                })?;
                self.sequence += 1;
            }
        }
        while self.sequence == last && !self.has_made(n_ticks) && has_time() {
            match self.simulation.tick(None, workspace) {
                Ok(tick) => self.ticks.push(tick),
                Err(error) => {
                    self.end = Some(Event::Failed { at_s: clock.unix_s(), reason: error.to_string() });
                }
            }
            if self.end.is_none() && self.simulation.is_over() {
                self.end = Some(Event::Finished { at_s: clock.unix_s() });
            }
        }
        Ok(self)
    }
}
