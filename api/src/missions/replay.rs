//! Every plan of a mission made again from what its log says was known, and compared with what was answered then.

use std::time::Duration;

use planner::{
    plan::{Workspace, plan},
    policy::Policy,
};
use serde_json::Map;

use super::{
    clock::Clock,
    event::{Event, Planned, digest},
    known::Known,
    log::{LogError, Reader},
    registry,
    simulation::Simulation,
};
use crate::{
    planners,
    planning::answer,
    wire::{PlanResponse, PreviousPlan},
};

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Events in the log, without a gap and each as it was stored.
    pub events: u64,
    /// Plans that came out the same, to the byte.
    pub equal: u64,
    /// Plans that a deadline cut short, which cannot be made again: taken as they were stored.
    pub cut_short: u64,
    /// Numbers of the events whose plans came out otherwise.
    pub different: Vec<u64>,
}

/// Makes every plan of the mission called `id` again. `progress` is told the number of the event that it is at, and of
/// the last.
pub fn replay(
    reader: &Reader,
    id: &str,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Option<Replayed>, LogError> {
    let Some(listed) = reader.mission(id)? else {
        return Ok(None);
    };
    let mission: crate::wire::mission::Mission = registry::parsed(&listed.summary)?;
    let created = registry::created(reader, listed.number)?;
    let clock = Clock {
        created: mission.created_s,
        rate: created.live.as_ref().map_or(1.0, |live| live.clock_rate),
    };
    let mut again = match (created.live, created.simulated) {
        (Some(config), _) => Again::Live(Box::new(Known::new(config)), Box::default()),
        (None, Some(config)) => {
            Again::Simulated(Box::new(Simulation::new(&config).map_err(LogError::Damaged)?))
        }
        (None, None) => return Err(LogError::Damaged(format!("{id} is of no kind"))),
    };
    let mut replayed = Replayed::default();
    reader.each(listed.number, 0, mission.sequence, &mut |stored| {
        replayed.events = stored.sequence;
        progress(stored.sequence, mission.sequence);
        match (Event::read(stored)?, &mut again) {
            (Event::Reported { heard, at_s }, Again::Live(known, _)) => known.hear(&heard, clock.at(at_s)),
            (Event::Planned(planned), again) => match again.plan(&planned)? {
                None => replayed.cut_short += 1,
                Some(answer) if digest(&answer) == planned.answer_sha256 => replayed.equal += 1,
                Some(_) => replayed.different.push(stored.sequence),
            },
            _ => {}
        }
        Ok(())
    })?;
    Ok(Some(replayed))
}

/// A mission on its way through its log.
enum Again {
    Live(Box<Known>, Box<Workspace>),
    Simulated(Box<Simulation>),
}

impl Again {
    /// The answer, made again; none where a deadline cut it short.
    fn plan(&mut self, logged: &Planned) -> Result<Option<PlanResponse>, LogError> {
        match self {
            Self::Live(known, workspace) => {
                if let Some(previous) = &logged.cut_short {
                    known.answered(PreviousPlan::clone(previous));
                    return Ok(None);
                }
                let damaged = |what: &str| LogError::Damaged(format!("the plan at {} s: {what}", logged.t_s));
                let snapshot = known
                    .snapshot(logged.t_s)
                    .ok_or_else(|| damaged("nothing was known that it could rest on"))?
                    .map_err(|_| damaged("what was known makes no snapshot"))?;
                let plan = plan(&snapshot, &Policy::default(), workspace);
                let made = planners::Planned {
                    snapshot: snapshot.into(),
                    plan,
                    solve_time: Duration::from_nanos(logged.solve_time_ns),
                };
                let metadata = Map::new();
                let answer = answer(&made, &metadata).planned();
                known.answered(PreviousPlan::from(&answer));
                Ok(Some(answer))
            }
            Self::Simulated(simulation) => {
                let ticked = simulation.tick(Some(logged));
                let tick = ticked.map_err(|error| LogError::Damaged(error.to_string()))?;
                Ok(Some(tick.answer))
            }
        }
    }
}
