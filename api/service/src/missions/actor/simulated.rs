//! A simulated mission: it runs as fast as the client asked for.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use clock::Clock;

use super::{
    Actor, Checkpoint, Command, Context, FIXED_SETTING, IdempotencyKey, NO_REPORTS, Stored, StoredPlan,
};
use store::StoreError;

use crate::{
    metrics::PlanFor,
    missions::{
        event::Event,
        simulation::{Simulation, Tick},
    },
    problem::Problem,
};
use wire::mission;

/// Plans that are stored together without a speed factor: some tens of milliseconds of work.
const TICKS_AT_ONCE: u32 = 16;

/// Pause after a failure.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest pause after failures in a row: each attempt may simulate everything again.
const PATIENCE_MAX: Duration = Duration::from_mins(1);

pub(in crate::missions) struct Simulated {
    context: Context,
    config: mission::Simulated,
    /// None until it is needed: then it is simulated again up to the last stored event.
    simulation: Option<Box<Simulation>>,
    due: Instant,
    patience: Duration,
}

impl Simulated {
    pub(in crate::missions) fn new(context: Context, config: mission::Simulated) -> Self {
        Self {
            config,
            simulation: None,
            due: context.clock().now(),
            context,
            patience: PATIENCE,
        }
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
            Command::Step(ticks) => return Ok(self.step(ticks, key).await?.answer),
            Command::Run(speed_factor) => {
                self.due = self.context.clock().now();
                Event::Ran { at_s, speed_factor }
            }
            Command::Pause => Event::Paused { at_s },
            Command::Finish => Event::Finished { at_s },
        };
        Ok(self.context.append(vec![event], key, None).await?.answer)
    }

    /// Makes one plan, or several without a speed factor.
    async fn advance(&mut self) {
        let ticks = match self.context.mission.speed_factor {
            Some(factor) => {
                // A late plan delays the later ones: the simulation does not catch up.
                self.due = self
                    .context
                    .clock()
                    .now()
                    .max(self.due + Duration::from_secs_f64(1.0 / factor));
                1
            }
            None => TICKS_AT_ONCE,
        };
        if let Err(problem) = self.step(ticks, None).await {
            tracing::warn!(
                mission = self.context.mission.id,
                ?problem,
                "the simulation did not advance"
            );
            self.due = self.context.clock().now() + self.patience;
            self.patience = PATIENCE_MAX.min(2 * self.patience);
        } else {
            self.patience = PATIENCE;
        }
    }
}

impl Simulated {
    /// Makes `ticks` plans, or fewer at the end. If their events are not stored, the simulation is dropped.
    async fn step(&mut self, ticks: u32, key: Option<IdempotencyKey>) -> Result<Stored, Problem> {
        let simulation = match self.simulation.take() {
            Some(simulation) => simulation,
            None => self.simulate_again().await?,
        };
        let clock = self.context.clock().clone();
        let worked = self
            .context
            .planners
            .simulate(move || simulate(simulation, ticks, &clock));
        let (simulation, ticks, end) = worked.await?;
        let n_plans = ticks.len() as u64;
        let plan = ticks.last().map(|tick| {
            Arc::new(StoredPlan {
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
        let events = ticks.into_iter().map(planned).chain(end).collect();
        let checkpoint = plan.is_some().then(|| Checkpoint::json(None, plan.clone()));
        let stored = self.context.append(events, key, checkpoint).await?;
        if stored.is_new {
            self.simulation = Some(simulation);
            if plan.is_some() {
                self.context.show(plan);
            }
        }
        Ok(stored)
    }

    /// The simulation as it was after the last stored event.
    async fn simulate_again(&self) -> Result<Box<Simulation>, Problem> {
        let (store, config) = (self.context.store.clone(), self.config.clone());
        let clock = self.context.clock().clone();
        let (number, sequence) = (self.context.number, self.context.mission.sequence);
        let again = self.context.planners.simulate(move || {
            let mut simulation = Simulation::new(&config, &clock).map_err(StoreError::Damaged)?;
            store.reader()?.each(number, 0, sequence, &mut |stored| {
                if let Event::Planned(planned) = Event::read(stored)? {
                    let ticked = simulation.tick(Some(&planned));
                    ticked.map_err(|error| StoreError::Damaged(error.to_string()))?;
                }
                Ok(())
            })?;
            Ok::<_, StoreError>(Box::new(simulation))
        });
        Ok(again.await??)
    }
}

/// Makes up to `n_ticks` plans. The event is that of the end, if it came.
fn simulate(
    mut simulation: Box<Simulation>,
    n_ticks: u32,
    clock: &Clock,
) -> (Box<Simulation>, Vec<Tick>, Option<Event>) {
    let mut ticks = vec![];
    for _ in 0..n_ticks {
        match simulation.tick(None) {
            Ok(tick) => ticks.push(tick),
            Err(error) => {
                let reason = error.to_string();
                let at_s = clock.unix_s();
                return (simulation, ticks, Some(Event::Failed { at_s, reason }));
            }
        }
        if simulation.is_over() {
            return (simulation, ticks, Some(Event::Finished { at_s: clock.unix_s() }));
        }
    }
    (simulation, ticks, None)
}
