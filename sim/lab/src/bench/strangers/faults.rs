//! Breakdowns under way: how soon the planner says that its craft does not follow.

use planner::{craft::Craft, path::Side, policy::Policy};

use super::{BenchError, Knowledge, failed, flight::fly_planner};
use crate::strangers::{Stranger, StrangerMission};
use sim::{
    fault::{Fault, FaultKind},
    guide::MpcGuide,
    mission::Mission,
    scenario::Scenario,
    surface_craft::SurfaceClass,
};

/// When something breaks, s.
pub(crate) const FAULT_AT: f64 = 300.0;
/// How long the mission lasts, s.
const DURATION: f64 = 600.0;
/// Random craft, the first of the bench, beside the classes that are known.
pub const RANDOM_CRAFT: u64 = 10;
/// The missions.
pub(crate) const MISSIONS: [StrangerMission; 2] = [StrangerMission::FastAuv, StrangerMission::Switching];
/// Seed of the missions of the classes that are known.
const SEED: u64 = 1;
/// How much slower the heading loop becomes.
const SLOWED: f64 = 2.0;
/// How far off its reference a heading comes to rest, rad: 10°.
const OFFSET: f64 = 0.174_532_925_199_432_95;
/// Where a rudder is stuck, as a share of the largest moment: 10° of the usual 35°.
const STUCK: f64 = 10.0 / 35.0;

/// What breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breakdown {
    /// Nothing: what the others are compared with.
    Nothing,
    /// The heading loop has twice its lag.
    SlowHeadingLoop,
    /// The port thruster is lost.
    ThrusterLost,
    /// The rudder is stuck 10° to starboard.
    RudderStuck,
    /// The craft comes to rest 10° to starboard of its heading reference.
    HeadingOffset,
}

/// What came of one breakdown.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultTrial {
    /// The craft.
    pub craft: String,
    /// The mission.
    pub mission: StrangerMission,
    /// What broke.
    pub what: Breakdown,
    /// What was declared to the planner.
    pub knowledge: Knowledge,
    /// Alarms before anything broke.
    pub alarms_before: usize,
    /// Whether the alarm stood already when it broke.
    pub alarmed_already: bool,
    /// Until the alarm, s; none if it was not raised by the end.
    pub detected_after_s: Option<f64>,
    /// Root mean square distance to the goal over the whole mission, m.
    pub rms_m: f64,
}

impl Breakdown {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Nothing,
        Self::SlowHeadingLoop,
        Self::ThrusterLost,
        Self::RudderStuck,
        Self::HeadingOffset,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::SlowHeadingLoop => "heading lag doubled",
            Self::ThrusterLost => "port thruster lost",
            Self::RudderStuck => "rudder stuck at 10°",
            Self::HeadingOffset => "heading 10° off its reference",
        }
    }

    fn kind(self) -> Option<FaultKind> {
        match self {
            Self::Nothing => None,
            Self::SlowHeadingLoop => Some(FaultKind::SlowHeadingLoop(SLOWED)),
            Self::ThrusterLost => Some(FaultKind::Thruster {
                side: Side::Port,
                share: 0.0,
            }),
            Self::RudderStuck => Some(FaultKind::RudderStuck(STUCK)),
            Self::HeadingOffset => Some(FaultKind::HeadingOffset(OFFSET)),
        }
    }
}

/// A breakdown to be flown.
pub(super) struct Trial<'a> {
    craft: Flyer<'a>,
    mission: StrangerMission,
    what: Breakdown,
    knowledge: Knowledge,
    duration: f64,
}

#[derive(Clone, Copy)]
enum Flyer<'a> {
    Class(SurfaceClass),
    Random(&'a Stranger),
}

/// Every breakdown of every craft, in missions of `duration` s at most. Of random craft the first [`RANDOM_CRAFT`].
pub(super) fn trials(strangers: &[Stranger], duration: f64) -> Vec<Trial<'_>> {
    let classes = [SurfaceClass::Medusa, SurfaceClass::Otter].map(Flyer::Class);
    let random = strangers
        .iter()
        .zip(0..RANDOM_CRAFT)
        .map(|(stranger, _)| stranger);
    let mut trials = vec![];
    for craft in classes.into_iter().chain(random.map(Flyer::Random)) {
        for mission in MISSIONS {
            for what in Breakdown::ALL {
                for knowledge in Knowledge::ALL {
                    trials.push(Trial {
                        craft,
                        mission,
                        what,
                        knowledge,
                        duration: duration.min(DURATION),
                    });
                }
            }
        }
    }
    trials
}

impl Flyer<'_> {
    fn name(self) -> String {
        match self {
            Self::Class(SurfaceClass::Medusa) => "MEDUSA".to_owned(),
            Self::Class(SurfaceClass::Otter) => "Otter".to_owned(),
            Self::Random(stranger) => stranger.seed.to_string(),
        }
    }

    fn scenario(self, mission: StrangerMission) -> Scenario {
        match self {
            Self::Class(class) => mission.for_class(class),
            Self::Random(stranger) => stranger.scenario(mission),
        }
    }

    fn seed(self) -> u64 {
        match self {
            Self::Class(_) => SEED,
            Self::Random(stranger) => stranger.seed,
        }
    }

    fn craft(self) -> Craft {
        match self {
            Self::Class(class) => class.craft().craft(),
            Self::Random(stranger) => stranger.craft.tested.craft,
        }
    }
}

impl Trial<'_> {
    pub(super) fn run(&self) -> Result<FaultTrial, BenchError> {
        let scenario = self.craft.scenario(self.mission).lasting(self.duration);
        let seed = self.craft.seed();
        let mut guide = MpcGuide::new(Policy::default());
        let flight = self
            .knowledge
            .start(&scenario, seed)
            .and_then(|mut start| {
                start.world.faults.0.extend(self.what.kind().map(|what| Fault {
                    from: FAULT_AT,
                    until: f64::INFINITY,
                    what,
                }));
                let mission = Mission::from_start(start, &scenario, self.knowledge.name(), seed);
                fly_planner(mission, &mut guide, &self.craft.craft())
            })
            .map_err(|error| failed(&scenario, self.knowledge.name(), seed, error))?;
        let (before, after): (Vec<f64>, Vec<f64>) =
            flight.alarms_at_s.iter().partition(|time| **time < FAULT_AT);
        Ok(FaultTrial {
            craft: self.craft.name(),
            mission: self.mission,
            what: self.what,
            knowledge: self.knowledge,
            alarms_before: before.len(),
            alarmed_already: flight.alarmed_at(FAULT_AT),
            detected_after_s: after.first().map(|time| time - FAULT_AT),
            rms_m: flight.rms_m,
        })
    }
}
