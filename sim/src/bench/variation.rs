//! The planner without one of its parts, or under circumstances that it was not tuned for.

use nalgebra::Vector2;
use planner::{
    los::LosLaw,
    policy::Policy,
    snapshot::{Goal, Observation, Snapshot, VehicleId},
};

use super::contender::{AUTO, Contender, Paths, Pilot};
use crate::{
    guide::{Guidance, Guide, GuideError},
    scenario::{
        CurrentKnowledge, FaultFile, FaultKindFile, GoalFile, Quantity, Scenario, Start, SurfaceClassFile,
    },
    surface_craft::{Drag, SurfaceHull},
};

/// What is other than the scenario says, or than the craft is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Twist {
    /// Masses, inertia and drags of the surface craft's hull are this many times theirs; what it is said to be able
    /// to do stays.
    Hull(f64),
    /// An Otter in place of a MEDUSA.
    Otter,
    /// This is added to every current that is told (north, east), m/s.
    WrongCurrent(f64, f64),
    /// The surface craft's clock is ahead by this, s.
    ClockAhead(f64),
    /// A fix is known later than the scenario says, by this, s.
    LateReports(f64),
    /// The guide is told that the surge loop has no lag.
    NoSurgeLag,
    /// The guide is told that the craft turns as fast as any may.
    NoTurnRate,
    /// The guide is told to follow the vehicle whose turn it is, and of no turn to come.
    NoPreview,
    /// The guide is asked every so many seconds, and its answer is held meanwhile.
    Seldom(u32),
}

/// Fastest turn that a snapshot may say of its craft, rad/s.
const TURN_RATE_ANY: f64 = 3.0;

impl Twist {
    /// Whether it makes a difference in `scenario`.
    pub(super) fn applies(self, scenario: &Scenario) -> bool {
        let craft = scenario.surface_craft.as_ref();
        match self {
            Self::Otter => craft.is_some_and(|craft| craft.class != SurfaceClassFile::Otter),
            Self::WrongCurrent(..) => scenario.knowledge.current == CurrentKnowledge::Known,
            Self::LateReports(_) => scenario.knowledge.acoustics.is_some(),
            Self::NoPreview => craft.is_some_and(|craft| matches!(craft.goal, GoalFile::Intermittent { .. })),
            Self::Hull(_) | Self::ClockAhead(_) | Self::NoSurgeLag | Self::NoTurnRate | Self::Seldom(_) => {
                true
            }
        }
    }

    pub(super) fn twist_scenario(self, scenario: &mut Scenario) {
        match self {
            Self::Otter => {
                if let Some(craft) = &mut scenario.surface_craft {
                    craft.class = SurfaceClassFile::Otter;
                }
            }
            Self::ClockAhead(by) => scenario.faults.push(FaultFile {
                from_s: Quantity::fixed(0.0),
                until_s: None,
                what: FaultKindFile::ClockOffset {
                    offset_s: Quantity::fixed(by),
                },
            }),
            Self::LateReports(by) => {
                if let Some(acoustics) = &mut scenario.knowledge.acoustics {
                    acoustics.latency_s = Quantity::fixed(acoustics.latency_s.most() + by);
                }
            }
            _ => {}
        }
    }

    pub(super) fn twist_start(self, start: &mut Start) {
        if let (Self::Hull(factor), Some(craft)) = (self, &mut start.world.surface_craft) {
            craft.hull = heavier(&craft.hull, factor);
        }
    }

    fn twist_observation(self, observation: &mut Observation) {
        match self {
            Self::WrongCurrent(north, east) => {
                if let Some(current) = &mut observation.current {
                    *current += Vector2::new(north, east);
                }
            }
            Self::NoSurgeLag => observation.limits.surge_lag = 0.0,
            Self::NoTurnRate => observation.limits.turn_rate_max = TURN_RATE_ANY,
            Self::NoPreview => {
                if let Goal::Intermittent { auvs, dwell, epoch } = &observation.goal {
                    observation.goal = Goal::Track {
                        auv: in_turn(auvs, (observation.time - epoch) / dwell),
                    };
                }
            }
            _ => {}
        }
    }

    /// `guide`, seeing what this leaves it.
    pub(super) fn around(self, guide: Box<dyn Guide>) -> Box<dyn Guide> {
        Box::new(Twisted {
            guide,
            twist: self,
            asked: 0,
            held: None,
        })
    }
}

/// Whose turn it is after so many dwells.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "a mission has few dwells, and rem_euclid is never negative"
)]
fn in_turn(auvs: &[VehicleId], dwells: f64) -> VehicleId {
    auvs[(dwells.floor() as i64).rem_euclid(auvs.len() as i64) as usize].clone()
}

fn heavier(hull: &SurfaceHull, factor: f64) -> SurfaceHull {
    let drag = |drag: Drag| Drag {
        linear: factor * drag.linear,
        quadratic: factor * drag.quadratic,
    };
    let mut heavier = *hull;
    heavier.mass_surge *= factor;
    heavier.mass_sway *= factor;
    heavier.inertia_yaw *= factor;
    heavier.coriolis.surge *= factor;
    heavier.coriolis.sway *= factor;
    heavier.drag_surge = drag(hull.drag_surge);
    heavier.drag_sway = drag(hull.drag_sway);
    heavier.drag_yaw = drag(hull.drag_yaw);
    heavier
}

struct Twisted {
    guide: Box<dyn Guide>,
    twist: Twist,
    asked: u32,
    held: Option<Guidance>,
}

impl Guide for Twisted {
    fn name(&self) -> &'static str {
        self.guide.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let every = if let Twist::Seldom(every) = self.twist {
            every
        } else {
            1
        };
        let due = self.asked.is_multiple_of(every);
        self.asked += 1;
        if let Some(held) = self.held.filter(|_| !due) {
            return Ok(held);
        }
        let mut observation = Observation::clone(snapshot);
        self.twist.twist_observation(&mut observation);
        let guidance = self.guide.guide(&Snapshot::try_from(observation)?)?;
        self.held = Some(guidance);
        Ok(guidance)
    }
}

/// The planner as it is, and without each of its parts in turn.
#[must_use]
pub fn ablations() -> Vec<Contender> {
    let whole = Policy::default();
    let mut contenders = vec![planner(AUTO, &whole, None)];
    for (name, twist) in [
        ("no surge lag", Twist::NoSurgeLag),
        ("no turn-rate row", Twist::NoTurnRate),
        ("no preview of hand-overs", Twist::NoPreview),
    ] {
        contenders.push(planner(name, &whole, Some(twist)));
    }
    let mut without = |name: &str, change: &dyn Fn(&mut Policy)| {
        let mut policy = whole.clone();
        change(&mut policy);
        if policy != whole {
            contenders.push(planner(name, &policy, None));
        }
    };
    without("no Δa penalty", &|policy| {
        policy.weights.acceleration_change = 0.0;
    });
    without("no trust cone", &|policy| policy.trust_cone_tangent = NO_CONE);
    without("one pass", &|policy| policy.passes = 1);
    without("no range doubt", &|policy| policy.range_doubt = 0.0);
    without("no choice by merit", &|policy| policy.merit_decides = false);
    without("no energy term", &|policy| policy.weights.energy = 0.0);
    for weight in ENERGY_WEIGHTS {
        without(&format!("energy at {weight}/J"), &|policy| {
            policy.weights.energy = weight;
        });
    }
    contenders
}

/// A tangent that leaves a cone of 89°.
const NO_CONE: f64 = 57.0;

/// Prices of propulsion energy, 1/J: over the default horizon of 78 s, 0.2 m/s take 17 J and a distance of 1 m
/// costs 78.
const ENERGY_WEIGHTS: [f64; 3] = [0.1, 1.0, 10.0];

/// The planner and the two nearest laws under each circumstance; the planner with other horizons, grids and
/// intervals.
#[must_use]
pub fn sensitivity() -> Vec<Contender> {
    let policy = Policy::default();
    let mut contenders = vec![planner(AUTO, &policy, None)];
    contenders.extend(LAWS.map(Contender::law));
    for (name, twist) in [
        ("hull × 0.7", Twist::Hull(0.7)),
        ("hull × 1.3", Twist::Hull(1.3)),
        ("Otter", Twist::Otter),
        ("current wrong by 0.1 m/s north", Twist::WrongCurrent(0.1, 0.0)),
        ("current wrong by 0.1 m/s east", Twist::WrongCurrent(0.0, 0.1)),
        ("clock 5 s ahead", Twist::ClockAhead(5.0)),
        ("fixes 5 s later", Twist::LateReports(5.0)),
    ] {
        contenders.push(planner(name, &policy, Some(twist)));
        contenders.extend(LAWS.map(|law| Contender {
            name: format!("{}, {name}", law.name()),
            twist: Some(twist),
            ..Contender::law(law)
        }));
    }
    contenders.push(planner("asked every 2 s", &policy, Some(Twist::Seldom(2))));
    contenders.push(planner("asked every 5 s", &policy, Some(Twist::Seldom(5))));
    for (name, parts) in GRIDS {
        let steps = parts.iter().flat_map(|(n, step)| vec![*step; *n]).collect();
        contenders.push(planner(
            name,
            &Policy {
                steps,
                ..policy.clone()
            },
            None,
        ));
    }
    contenders
}

/// The laws beside which the planner is set under circumstances.
const LAWS: [LosLaw; 2] = [LosLaw::SaturatedLos, LosLaw::TrackerFrame];

type Grid = (&'static str, &'static [(usize, f64)]);

/// Intervals: how many, and of how many seconds. The default is 6 of 1 s, 12 of 2 s and 12 of 4 s.
const GRIDS: [Grid; 4] = [
    ("horizon 42 s", &[(6, 1.0), (12, 2.0), (3, 4.0)]),
    ("horizon 126 s", &[(6, 1.0), (12, 2.0), (24, 4.0)]),
    ("grid half as fine", &[(3, 2.0), (6, 4.0), (6, 8.0)]),
    ("grid twice as fine", &[(12, 0.5), (24, 1.0), (24, 2.0)]),
];

fn planner(name: &str, policy: &Policy, twist: Option<Twist>) -> Contender {
    Contender {
        pilot: Pilot::Planner {
            policy: Box::new(policy.clone()),
            forecast: None,
        },
        twist,
        ..Contender::planner(name, Paths::AsScenario, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bench::fly, record::Record};

    fn short(name: &str) -> Scenario {
        Scenario::named(name).expect("exists").lasting(60.0)
    }

    fn twisted(twist: Twist, scenario: &Scenario) -> Record {
        let contender = Contender {
            twist: Some(twist),
            ..Contender::law(LosLaw::SaturatedLos)
        };
        fly(&contender, None, scenario, 1).expect("runs")
    }

    fn plain(scenario: &Scenario) -> Record {
        fly(&Contender::law(LosLaw::SaturatedLos), None, scenario, 1).expect("runs")
    }

    #[test]
    fn names_are_unique_and_each_part_is_left_out_of_one_contender_only() {
        for contenders in [ablations(), sensitivity()] {
            for (i, contender) in contenders.iter().enumerate() {
                let before = &contenders[..i];
                assert!(
                    before.iter().all(|other| other.name != contender.name),
                    "{}",
                    contender.name
                );
                let same =
                    |other: &Contender| other.pilot == contender.pilot && other.twist == contender.twist;
                assert!(!before.iter().any(same), "{} differs from none", contender.name);
            }
        }
    }

    #[test]
    fn a_twist_that_changes_nothing_changes_nothing() {
        let scenario = short("cross-current");
        for twist in [
            Twist::Hull(1.0),
            Twist::WrongCurrent(0.0, 0.0),
            Twist::ClockAhead(0.0),
            Twist::Seldom(1),
        ] {
            assert_eq!(twisted(twist, &scenario).rows, plain(&scenario).rows, "{twist:?}");
        }
    }

    #[test]
    fn every_twist_of_the_world_changes_the_run() {
        let scenario = short("noisy-fixes");
        for twist in [
            Twist::Hull(0.7),
            Twist::Otter,
            Twist::WrongCurrent(0.1, 0.0),
            Twist::LateReports(5.0),
            Twist::Seldom(2),
        ] {
            assert_ne!(twisted(twist, &scenario).rows, plain(&scenario).rows, "{twist:?}");
        }
    }

    #[test]
    fn a_reference_is_held_between_two_questions() {
        let record = twisted(Twist::Seldom(5), &short("paper-tracking"));
        let references = record
            .rows
            .iter()
            .map(|row| row.surface_craft.as_ref().expect("has one").reference);
        let references: Vec<_> = references.collect();
        for held in references.chunks(5) {
            assert!(held.iter().all(|reference| *reference == held[0]));
        }
        assert_ne!(references[0], references[5]);
    }

    #[test]
    fn a_guide_without_preview_follows_whose_turn_it_is() {
        let auvs = ["a", "b"].map(|id| VehicleId(id.to_owned()));
        let turns = [-0.5, 0.0, 0.99, 1.0, 2.0].map(|dwells| in_turn(&auvs, dwells).0);
        assert_eq!(turns, ["b", "a", "a", "b", "a"]);
        assert!(Twist::NoPreview.applies(&short("switching")));
        assert!(!Twist::NoPreview.applies(&short("calm")));
    }

    #[test]
    fn a_heavier_hull_is_slower_to_move_but_told_the_same_limits() {
        let scenario = short("paper-tracking");
        let (heavy, usual) = (twisted(Twist::Hull(1.3), &scenario), plain(&scenario));
        assert_eq!(heavy.limits, usual.limits);
        let fastest = |record: &Record| record.plant.expect("calm water").speed_max;
        // Quadratic drag: top speed falls with its root.
        let ratio = fastest(&heavy) / fastest(&usual);
        assert!((ratio - 1.3_f64.powf(-0.5)).abs() < 0.02, "{ratio}");
    }
}
