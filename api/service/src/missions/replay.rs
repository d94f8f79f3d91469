//! Repeats every plan of a mission from its stored events, and compares the answers.

use std::time::Duration;

use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Workspace, plan},
};

use super::clock::MissionClock;
use super::event::{Event, Planned, StoredAnswer, answer, created, parsed, previous};
use super::simulation::Simulation;
use super::state::MissionState;
use store::{EventReader, StoreError};

use crate::planning::planners;
use wire::{PreviousPlan, mission::Mission};

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
        (Some(config), _) => RepeatedMission::Live(Box::new(MissionState::new(config)), Box::default()),
        (None, Some(config)) => {
            let simulation = Simulation::new(&config, &Clock::machine()).map_err(StoreError::Damaged)?;
            RepeatedMission::Simulated(Box::new(simulation), Box::default())
        }
        (None, None) => return Err(StoreError::Damaged(format!("{id} is neither live nor simulated"))),
    };
    let mut replayed = Replayed::default();
    reader.each(listed.number, 0, mission.sequence, &mut |stored| {
        replayed.events = stored.sequence;
        progress(stored.sequence, mission.sequence);
        match (Event::read(stored)?, &mut run) {
            (Event::Planned(planned), run) => match run.plan(&planned)? {
                None => replayed.cut_short += 1,
                Some(answer) if answer.digest() == planned.answer_sha256 => replayed.equal += 1,
                Some(_) => replayed.different.push(stored.sequence),
            },
            (event, RepeatedMission::Live(state, _)) => state.apply(&event, &clock),
            (_, RepeatedMission::Simulated(..)) => {}
        }
        Ok(())
    })?;
    Ok(Some(replayed))
}

enum RepeatedMission {
    Live(Box<MissionState>, Box<Workspace>),
    Simulated(Box<Simulation>, Box<Workspace>),
}

impl RepeatedMission {
    /// The repeated answer; `None` if a deadline cut it short.
    fn plan(&mut self, logged: &Planned) -> Result<Option<StoredAnswer>, StoreError> {
        match self {
            Self::Live(state, workspace) => {
                if let Some(previous) = &logged.cut_short {
                    state.replace_previous_plan(Some(PreviousPlan::clone(previous)));
                    return Ok(None);
                }
                let damaged =
                    |what: &str| StoreError::Damaged(format!("the plan at {} s: {what}", logged.t_s));
                let snapshot = state
                    .snapshot(logged.t_s, &logged.own_craft, &|| false)
                    .ok_or_else(|| damaged("the events before it have too few reports"))?
                    .map_err(|_| damaged("the events before it make no valid snapshot"))?;
                let plan = plan(&snapshot, &Parameters::default(), workspace);
                let made = planners::Planned {
                    snapshot: snapshot.into(),
                    plan,
                    solve_time: Duration::from_nanos(logged.solve_time_ns),
                };
                state.replace_previous_plan(Some(previous(&made, state.origin())));
                Ok(Some(answer(&made, state.origin())))
            }
            Self::Simulated(simulation, workspace) => {
                let ticked = simulation.tick(Some(logged), workspace);
                let tick = ticked.map_err(|error| StoreError::Damaged(error.to_string()))?;
                Ok(Some(tick.answer))
            }
        }
    }
}
