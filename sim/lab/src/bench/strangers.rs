//! The board of strangers: craft that the planner was not tuned for, guided by the planner, its response declared and not.
//!
//! ```text
//! craft × missions: laws × grid → the best-tuned law;   that law, the planner, craft declared and undeclared → flights
//! craft × missions × faults × (declared, undeclared)                                                   → detections
//! ```
//! Each craft has its own tuning seed and its own scored one. No clock: the same board on any number of threads.

use std::num::NonZeroUsize;

use planner::{
    craft::{Craft, CraftDescription},
    los::{LosLaw, LosTuning},
    policy::Policy,
    snapshot::Limits,
};

use super::{BenchError, TUNING_SEED, queue::in_parallel};
use crate::{
    strangers::{Stranger, StrangerMission},
    tuning::grid,
};
use sim::{
    guide::{GuideError, LosGuide, MpcGuide},
    mission::Mission,
    scenario::{Scenario, Start},
    surface_craft::random::NoCraft,
};

mod faults;
mod flight;

pub(crate) use faults::MISSIONS as FAULT_MISSIONS;
pub use faults::{Breakdown, FaultTrial, RANDOM_CRAFT as FAULT_CRAFT};
pub(crate) use flight::CHECKPOINTS;
pub use flight::{Estimates, Flight, Learnt};

use flight::{fly_law, fly_planner};

/// The laws that the planner is compared with.
pub(crate) const LAWS: [LosLaw; 2] = [LosLaw::SaturatedLos, LosLaw::TrackerFrame];

/// What one breakdown takes beside the tuning and the flights of one craft in one mission. Measured: 0.3 of it.
const FAULT_TRIAL_COST: f64 = 0.3;

/// What is to be run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrangersBench {
    /// Seed of the first craft, at least 1.
    pub first: u64,
    /// How many craft, from that seed on; the last is below [`TUNING_SEED`].
    pub crafts: u64,
    /// How long each mission lasts, s: [`crate::strangers::DURATION`], or less for a quick look.
    pub duration: f64,
    /// Whether breakdowns are tried too.
    pub faults: bool,
    /// Runs at once.
    pub threads: NonZeroUsize,
}

/// All that came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StrangersBoard {
    /// The craft, by seed.
    pub crafts: Vec<Stranger>,
    /// Every craft in every mission, craft by craft.
    pub flights: Vec<StrangerFlights>,
    /// Every breakdown.
    pub faults: Vec<FaultTrial>,
}

/// One craft in one mission.
#[derive(Clone, Debug, PartialEq)]
pub struct StrangerFlights {
    /// Seed of the craft, and of the mission.
    pub craft: u64,
    /// The mission.
    pub mission: StrangerMission,
    /// The law and the gains that were the nearest on the tuning seed.
    pub nearest: LosTuning,
    /// The flight of that law.
    pub law: Flight,
    /// That of the planner with the craft and its limits declared.
    pub declared: Flight,
    /// That of the planner with its speeds alone declared.
    pub undeclared: Flight,
}

/// What is declared to the planner of its craft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    /// All that its step tests found.
    Declared,
    /// Its least and its largest speed.
    Undeclared,
}

/// Why there is no board.
#[derive(Debug, thiserror::Error)]
pub enum StrangersError {
    /// A craft could not be drawn.
    #[error(transparent)]
    Craft(#[from] NoCraft),
    /// A mission failed.
    #[error(transparent)]
    Mission(#[from] BenchError),
}

impl Knowledge {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Declared, Self::Undeclared];

    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Declared => "declared",
            Self::Undeclared => "undeclared",
        }
    }

    /// The start of a mission, with so much declared to the planner.
    fn start(self, scenario: &Scenario, seed: u64) -> Result<Start, GuideError> {
        let mut start = scenario.start(seed)?;
        if self == Self::Undeclared {
            undeclare(&mut start);
        }
        Ok(start)
    }

    fn mission(self, scenario: &Scenario, seed: u64) -> Result<Mission, GuideError> {
        let start = self.start(scenario, seed)?;
        Ok(Mission::from_start(start, scenario, self.name(), seed))
    }
}

/// Leaves the planner of a mission nothing of its craft but the least and the largest speed.
pub(crate) fn undeclare(start: &mut Start) {
    if let Some(observer) = &mut start.observer {
        let briefing = observer.briefing_mut();
        briefing.craft = CraftDescription::default();
        briefing.limits = Limits {
            speed_min: briefing.limits.speed_min,
            speed_max: briefing.limits.speed_max,
            ..Limits::ANY
        };
    }
}

impl StrangersBoard {
    /// The craft of a seed.
    #[must_use]
    pub fn craft(&self, seed: u64) -> Option<&Stranger> {
        self.crafts.iter().find(|craft| craft.seed == seed)
    }
}

impl StrangerFlights {
    /// The planner's flight.
    #[must_use]
    pub fn planner(&self, knowledge: Knowledge) -> &Flight {
        match knowledge {
            Knowledge::Declared => &self.declared,
            Knowledge::Undeclared => &self.undeclared,
        }
    }
}

enum Job<'a> {
    Fly(&'a Stranger, StrangerMission, f64),
    Break(faults::Trial<'a>),
}

enum Answer {
    Flights(Box<StrangerFlights>),
    Fault(FaultTrial),
}

impl Job<'_> {
    fn cost(&self) -> f64 {
        match self {
            Self::Fly(..) => 1.0,
            Self::Break(_) => FAULT_TRIAL_COST,
        }
    }

    fn work(&self) -> Result<Answer, BenchError> {
        match self {
            Self::Fly(stranger, mission, duration) => {
                flights(stranger, *mission, *duration).map(|all| Answer::Flights(Box::new(all)))
            }
            Self::Break(trial) => trial.run().map(Answer::Fault),
        }
    }
}

impl StrangersBench {
    /// Runs everything. `progress` gets the fraction done, by expected work.
    pub fn run(&self, progress: &mut (dyn FnMut(f64) + Send)) -> Result<StrangersBoard, StrangersError> {
        let drawn = if self.faults {
            self.crafts.max(FAULT_CRAFT)
        } else {
            self.crafts
        };
        let seeds: Vec<u64> = (self.first..self.first + drawn).collect();
        let mut crafts = in_parallel(&seeds, self.threads, |seed| Stranger::draw(*seed), &mut |_, _| {})?;
        let is_flown = |craft: &Stranger| craft.seed < self.first + self.crafts;
        let flown = crafts.iter().filter(|craft| is_flown(craft));
        let mut jobs: Vec<Job> = flown
            .flat_map(|craft| StrangerMission::ALL.map(|mission| Job::Fly(craft, mission, self.duration)))
            .collect();
        if self.faults {
            jobs.extend(faults::trials(&crafts, self.duration).into_iter().map(Job::Break));
        }
        let all: f64 = jobs.iter().map(Job::cost).sum();
        let mut done = 0.0;
        let answers = in_parallel(&jobs, self.threads, Job::work, &mut |job, _| {
            done += job.cost() / all;
            progress(done.min(1.0));
        })?;
        let (mut flights, mut faults) = (vec![], vec![]);
        for answer in answers {
            match answer {
                Answer::Flights(all) => flights.push(*all),
                Answer::Fault(trial) => faults.push(trial),
            }
        }
        crafts.retain(is_flown);
        Ok(StrangersBoard {
            crafts,
            flights,
            faults,
        })
    }
}

fn flights(
    stranger: &Stranger,
    mission: StrangerMission,
    duration: f64,
) -> Result<StrangerFlights, BenchError> {
    let scenario = stranger.scenario(mission).lasting(duration);
    let craft = stranger.craft.tested.craft;
    let nearest = nearest_law(&scenario, &craft, TUNING_SEED + stranger.seed)?;
    let seed = stranger.seed;
    let planner = |knowledge: Knowledge| {
        let mut guide = MpcGuide::new(Policy::default());
        knowledge
            .mission(&scenario, seed)
            .and_then(|start| fly_planner(start, &mut guide, &craft))
            .map_err(|error| failed(&scenario, knowledge.name(), seed, error))
    };
    Ok(StrangerFlights {
        craft: stranger.seed,
        mission,
        nearest,
        law: law_flight(&scenario, &craft, nearest, seed)?,
        declared: planner(Knowledge::Declared)?,
        undeclared: planner(Knowledge::Undeclared)?,
    })
}

/// The law and the gains of the least root mean square distance; of equals the first.
fn nearest_law(scenario: &Scenario, craft: &Craft, seed: u64) -> Result<LosTuning, BenchError> {
    let mut tunings = LAWS.into_iter().flat_map(grid);
    let mut best = tunings.next().expect("a grid has points");
    let mut least = law_flight(scenario, craft, best, seed)?.rms_m;
    for tuning in tunings {
        let rms = law_flight(scenario, craft, tuning, seed)?.rms_m;
        if rms < least {
            (best, least) = (tuning, rms);
        }
    }
    Ok(best)
}

fn law_flight(
    scenario: &Scenario,
    craft: &Craft,
    tuning: LosTuning,
    seed: u64,
) -> Result<Flight, BenchError> {
    let mut guide = LosGuide::tuned(tuning);
    Knowledge::Declared
        .mission(scenario, seed)
        .and_then(|mission| fly_law(mission, &mut guide, craft))
        .map_err(|error| failed(scenario, tuning.law.name(), seed, error))
}

fn failed(scenario: &Scenario, contender: &str, seed: u64, source: GuideError) -> BenchError {
    BenchError::Mission {
        scenario: format!("{} ({})", scenario.name, scenario.title),
        contender: contender.to_owned(),
        seed,
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bench(first: u64, threads: usize) -> StrangersBoard {
        let bench = StrangersBench {
            first,
            crafts: 1,
            duration: 30.0,
            faults: false,
            threads: NonZeroUsize::new(threads).expect("is above 0"),
        };
        bench
            .run(&mut |done| assert!((0.0..=1.0).contains(&done)))
            .expect("runs")
    }

    #[test]
    fn threads_change_no_result_and_another_first_seed_is_another_craft() {
        let board = bench(7, 1);
        assert_eq!(board, bench(7, 2));
        assert_eq!(board.crafts.len(), 1);
        assert_eq!(board.flights.len(), StrangerMission::ALL.len());
        for flights in &board.flights {
            assert_eq!(flights.craft, 7);
            let law = &flights.law;
            assert!(0.0 < law.rms_m && law.late_rms_m.is_finite(), "{law:?}");
            // Declared or not, the same start: the distance at the beginning is most of so short a flight.
            let (declared, undeclared) = (flights.declared.rms_m, flights.undeclared.rms_m);
            assert!(
                declared < 1.5 * law.rms_m + 1.0 && undeclared < 1.5 * law.rms_m + 1.0,
                "{flights:?}"
            );
        }
        assert_ne!(board.crafts, bench(8, 2).crafts);
    }
}
