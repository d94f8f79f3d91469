//! Repeats every plan of a mission from its stored events, and compares the answers.

use std::time::Duration;

use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Workspace, plan},
    stop::Stop,
};

use super::clock::MissionClock;
use super::craft_state::Left;
use super::event::{Event, Planned, created, parsed};
use super::facts::{CraftPlan, Facts};
use super::simulation::Simulation;
use super::state::MissionState;
use store::{EventReader, StoreError};

use crate::planning::planners;
use wire::mission::Mission;

/// The result of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Number of events, which are complete and as stored.
    pub events: u64,
    /// Plans with the same answer, to the byte.
    pub equal: u64,
    /// Plans that a deadline cut short. They cannot be repeated and are taken as stored.
    pub cut_short: u64,
    /// Numbers of the events whose plans have another answer.
    pub different: Vec<u64>,
}

/// Repeats every plan of the mission `id`. `progress` gets the numbers of the current and the last
/// event. `None` if there is no such mission.
pub fn replay(
    reader: &EventReader,
    id: &str,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Option<Replayed>, StoreError> {
    let Some(listed) = reader.mission(id)? else {
        return Ok(None);
    };
    let mission: Mission = parsed(listed.summary()?)?;
    let created = created(reader, listed.number)?;
    let clock = MissionClock::new(mission.created_s, created.live.as_ref());
    let mut run = match (created.live, created.simulated) {
        (Some(config), _) => RepeatedMission::Live { state: Box::new(MissionState::new(config)), tick: None },
        (None, Some(config)) => {
            let simulation = Simulation::new(&config, &Clock::machine()).map_err(StoreError::Damaged)?;
            RepeatedMission::Simulated(Box::new(simulation))
        }
        (None, None) => return Err(StoreError::Damaged(format!("{id} is neither live nor simulated"))),
    };
    let (mut replayed, mut workspace) = (Replayed::default(), Workspace::default());
    reader.each(listed.number, 0, mission.sequence, &mut |stored| {
        replayed.events = stored.sequence;
        progress(stored.sequence, mission.sequence);
        let event = Event::read(stored)?;
        match (&event, &mut run) {
            (Event::Planned(planned), run) => match run.plan(planned, &mut workspace)? {
                None => replayed.cut_short += 1,
                Some(digest) if digest == planned.answer_sha256 => replayed.equal += 1,
                Some(_) => replayed.different.push(stored.sequence),
            },
            (event, RepeatedMission::Live { state, tick, .. }) => {
                if let Event::Assigned(logged) = event
                    && !logged.cut_short
                    && tick.as_ref().and_then(|tick| tick.facts.assigned()) != Some(logged)
                {
                    replayed.different.push(stored.sequence);
                }
                state.apply(event, &clock);
                *tick = None;
            }
            (_, RepeatedMission::Simulated(_)) => {}
        }
        Ok(())
    })?;
    Ok(Some(replayed))
}

enum RepeatedMission {
    Live { state: Box<MissionState>, tick: Option<Box<Tick>> },
    Simulated(Box<Simulation>),
}

/// The plans of all craft at one time.
struct Tick {
    facts: Facts,
    time: f64,
    plans: Vec<CraftPlan>,
}

impl RepeatedMission {
    /// The digest of the repeated answer; `None` if a deadline cut it short.
    fn plan(&mut self, logged: &Planned, workspace: &mut Workspace) -> Result<Option<String>, StoreError> {
        match self {
            Self::Live { state, tick } => {
                if tick.as_ref().is_none_or(|tick| tick.time != logged.t_s || logged.craft.is_none()) {
                    let new = Tick::new(state, logged, workspace)?;
                    state.replace_absences(new.facts.absences());
                    *tick = Some(Box::new(new));
                }
                let tick = tick.as_mut().expect("was made just now");
                let craft = tick.plans.iter_mut().find(|craft| craft.id == logged.craft);
                let craft =
                    craft.ok_or_else(|| damaged(logged, "the events before it have no such craft"))?;
                // The answer has the time that its plan took.
                craft.made.solve_time = Duration::from_nanos(logged.solve_time_ns);
                let written = tick.facts.written(craft, state.origin());
                let digest = written.answer.digest();
                let cut_short = logged.cut_short.as_deref();
                let follows = match cut_short.and(logged.prediction.as_ref()) {
                    Some(prediction) => prediction.craft.follows,
                    None => written.answer.answer.craft_estimate.follows,
                };
                let previous = cut_short.cloned().unwrap_or(written.previous);
                if let Some(known) = state.craft_mut(logged.craft.as_deref()) {
                    let strays = logged.craft.is_some() && !follows;
                    known.replace_left(Left { previous_plan: Some(previous), strays });
                }
                Ok(cut_short.is_none().then_some(digest))
            }
            Self::Simulated(simulation) => {
                let ticked = simulation.tick(Some(logged), workspace);
                let tick = ticked.map_err(|error| StoreError::Damaged(error.to_string()))?;
                Ok(Some(tick.answer.digest()))
            }
        }
    }
}

impl Tick {
    /// The plans of all craft at the time of the `logged` one, which is the first of them.
    fn new(state: &MissionState, logged: &Planned, workspace: &mut Workspace) -> Result<Self, StoreError> {
        let (parameters, never) = (Parameters::default(), |_| Stop::never());
        let facts = Facts::of(state, (logged.t_s, &logged.own_craft), &parameters, &never)
            .ok_or_else(|| damaged(logged, "the events before it have too few reports"))?
            .map_err(|_| damaged(logged, "the events before it make no valid snapshot"))?;
        let plans = facts.plans(|snapshot, _| {
            let plan = plan(&snapshot, &parameters, workspace);
            planners::Planned { snapshot, plan, solve_time: Duration::ZERO }
        });
        Ok(Self { facts, time: logged.t_s, plans })
    }
}

fn damaged(logged: &Planned, what: &str) -> StoreError {
    StoreError::Damaged(format!("the plan at {} s: {what}", logged.t_s))
}
