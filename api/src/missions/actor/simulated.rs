//! A mission of the simulator: each result goes back to the planner, as fast as it was asked for.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use tokio::task::spawn_blocking;

use super::{Actor, Desk, Key, Order, Plan, Snapshot, Stored, json, work};
use crate::{
    missions::{
        clock::unix_now,
        event::Event,
        log::LogError,
        simulation::{Simulation, Tick},
    },
    problem::Problem,
    wire::mission::{self, Status},
};

/// Plans that are stored together where nobody waits for each: some tens of milliseconds of work.
const TICKS_AT_ONCE: u32 = 16;

/// When to try again what the disk did not take.
const PATIENCE: Duration = Duration::from_secs(1);
/// After failures in a row, at the latest: each time everything may have to be simulated again.
const PATIENCE_MAX: Duration = Duration::from_mins(1);

pub(in crate::missions) struct Simulated {
    desk: Desk,
    config: mission::Simulated,
    /// None until it is needed: it is simulated again up to where the log is.
    simulation: Option<Box<Simulation>>,
    due: Instant,
    patience: Duration,
}

impl Simulated {
    pub(in crate::missions) fn new(desk: Desk, config: mission::Simulated) -> Self {
        Self {
            desk,
            config,
            simulation: None,
            due: Instant::now(),
            patience: PATIENCE,
        }
    }

    pub(in crate::missions) async fn run(self) {
        work(self).await;
    }
}

impl Actor for Simulated {
    fn desk(&mut self) -> &mut Desk {
        &mut self.desk
    }

    fn due(&self) -> Instant {
        self.due
    }

    async fn carry_out(&mut self, order: Order, key: Option<Key>) -> Result<Vec<u8>, Problem> {
        let at_s = unix_now();
        let running = self.desk.book.mission.status == Status::Running;
        let event = match order {
            Order::Hear(_) => {
                let why = "a simulated mission hears its own vehicles; reports are for live ones";
                return Err(Problem::conflict(why));
            }
            Order::Step(_) if running => {
                return Err(Problem::conflict("the mission is running: pause it first"));
            }
            Order::Step(ticks) => {
                return self.step(ticks, key).await.map(Stored::answer);
            }
            Order::Run(speed_factor) => {
                self.due = Instant::now();
                Event::Ran { at_s, speed_factor }
            }
            Order::Pause => Event::Paused { at_s },
            Order::Finish => Event::Finished { at_s },
        };
        let stored = self.desk.book.store(vec![event], key, None).await?;
        Ok(stored.answer())
    }

    /// A plan, or some where there is no clock to wait for.
    async fn go_on(&mut self) {
        let ticks = match self.desk.book.mission.speed_factor {
            Some(factor) => {
                // What is late stays late: nothing is made up for in a hurry.
                self.due = Instant::now().max(self.due + Duration::from_secs_f64(1.0 / factor));
                1
            }
            None => TICKS_AT_ONCE,
        };
        if let Err(problem) = self.step(ticks, None).await {
            tracing::warn!(mission = self.desk.book.mission.id, ?problem, "did not go on");
            self.due = Instant::now() + self.patience;
            self.patience = PATIENCE_MAX.min(2 * self.patience);
        } else {
            self.patience = PATIENCE;
        }
    }
}

impl Simulated {
    /// Goes on for `ticks` plans, or to the end. What the disk does not take has not happened.
    async fn step(&mut self, ticks: u32, key: Option<Key>) -> Result<Stored, Problem> {
        let simulation = match self.simulation.take() {
            Some(simulation) => simulation,
            None => self.again().await?,
        };
        let turn = self.desk.planners.simulation().await;
        let worked = spawn_blocking(move || {
            let _turn = turn;
            simulate(simulation, ticks)
        });
        let (simulation, ticked, end) = worked.await.map_err(|_| Problem::Panicked)?;
        let n_plans = ticked.len() as u64;
        let plan = ticked.last().map(|tick| {
            Arc::new(Plan {
                sequence: self.desk.book.mission.sequence + n_plans,
                time: tick.planned.t_s,
                late: 0.0,
                answer: tick.answer.clone(),
                heard: BTreeMap::new(),
            })
        });
        let kept = Snapshot { known: None, plan };
        let mut events: Vec<Event> = ticked
            .into_iter()
            .map(|tick| Event::Planned(Box::new(tick.planned)))
            .collect();
        events.extend(end);
        let snapshot = kept.plan.is_some().then(|| json(&kept));
        let stored = self.desk.book.store(events, key, snapshot).await?;
        if let Stored::Now(_) = stored {
            self.simulation = Some(simulation);
            if kept.plan.is_some() {
                self.desk.book.show(kept.plan);
            }
        }
        Ok(stored)
    }

    /// The simulation as far as the log goes.
    async fn again(&self) -> Result<Box<Simulation>, Problem> {
        let (log, config) = (self.desk.book.log.clone(), self.config.clone());
        let (number, sequence) = (self.desk.book.number, self.desk.book.mission.sequence);
        let turn = self.desk.planners.simulation().await;
        let again = spawn_blocking(move || {
            let _turn = turn;
            let mut simulation = Simulation::new(&config).map_err(LogError::Damaged)?;
            log.reader()?.each(number, 0, sequence, &mut |stored| {
                if let Event::Planned(planned) = Event::read(stored)? {
                    let ticked = simulation.tick(Some(&planned));
                    ticked.map_err(|error| LogError::Damaged(error.to_string()))?;
                }
                Ok(())
            })?;
            Ok::<_, LogError>(Box::new(simulation))
        });
        Ok(again.await.map_err(|_| Problem::Panicked)??)
    }
}

/// Some plans, and the event of the end where that came.
fn simulate(mut simulation: Box<Simulation>, ticks: u32) -> (Box<Simulation>, Vec<Tick>, Option<Event>) {
    let mut ticked = vec![];
    let mut end = None;
    for _ in 0..ticks {
        match simulation.tick(None) {
            Ok(tick) => ticked.push(tick),
            Err(error) => {
                end = Some(Event::Failed {
                    at_s: unix_now(),
                    reason: error.to_string(),
                });
                break;
            }
        }
        if simulation.is_over() {
            end = Some(Event::Finished { at_s: unix_now() });
            break;
        }
    }
    (simulation, ticked, end)
}
