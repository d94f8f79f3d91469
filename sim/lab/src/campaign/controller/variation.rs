//! Variations: differences from the scenario or the craft for one controller.

use planner::path::Side;
use planner::snapshot::{Goal, PlanRequest};
use schemars::JsonSchema;
use serde::Deserialize;
use sim::fault::{Fault, FaultKind};
use sim::mission::in_turn;
use sim::scenario::{CurrentKnowledge, FaultFile, FaultKindFile, Quantity, Scenario, Start};
use sim::surface_craft::{Drag, SurfaceHull};

/// A difference from the scenario or from the craft.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Variation {
    /// Factor of the hull's masses, inertia and drags; the declared limits stay.
    Hull(f64),
    /// Error added to every known current (north, east), m/s.
    WrongCurrentMps([f64; 2]),
    /// The surface craft's clock is ahead by this, s.
    ClockAheadS(f64),
    /// Delay of every fix beyond the scenario's, s.
    LateReportsS(f64),
    /// The controller assumes a surge loop without lag.
    NoSurgeLag,
    /// The controller assumes the largest turn rate that can be declared.
    NoTurnRate,
    /// The controller follows the goal's present AUV and does not foresee the next hand-over.
    NoPreview,
    /// The controller answers once in this time, s; its answer is held meanwhile.
    AskedEveryS(u32),
    /// A permanent breakdown of the surface craft.
    Breakdown {
        /// The broken part.
        what: Breakdown,
        /// Time of the breakdown, s.
        at_s: f64,
    },
}

/// A breakdown of the surface craft.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Breakdown {
    /// The heading loop has twice its lag.
    SlowHeadingLoop,
    /// The port thruster is lost.
    PortThrusterLost,
    /// The rudder is stuck 10° to starboard, of 35° at most.
    RudderStuck,
    /// The craft comes to rest 10° to starboard of its heading reference.
    HeadingOffset,
}

/// Factor of the heading loop's lag.
const SLOWED: f64 = 2.0;
/// Steady offset of the heading from its reference, rad: 10°.
const OFFSET: f64 = 0.174_532_925_199_432_95;
/// Position of a stuck rudder, as a share of the largest moment: 10° of the usual 35°.
const STUCK: f64 = 10.0 / 35.0;

impl Breakdown {
    fn kind(self) -> FaultKind {
        match self {
            Self::SlowHeadingLoop => FaultKind::SlowHeadingLoop(SLOWED),
            Self::PortThrusterLost => FaultKind::Thruster { side: Side::Port, share: 0.0 },
            Self::RudderStuck => FaultKind::RudderStuck(STUCK),
            Self::HeadingOffset => FaultKind::HeadingOffset(OFFSET),
        }
    }
}

/// Largest turn rate that a snapshot may declare, rad/s.
const TURN_RATE_ANY: f64 = 3.0;

impl Variation {
    /// `true` if it has an effect in `scenario`.
    pub(super) fn applies(self, scenario: &Scenario) -> bool {
        let craft = scenario.surface_craft.first();
        match self {
            Self::WrongCurrentMps(_) => scenario.knowledge.current == CurrentKnowledge::Known,
            Self::LateReportsS(_) => scenario.knowledge.acoustics.is_some(),
            Self::NoPreview => craft.is_some_and(|craft| matches!(craft.goal, Goal::Intermittent { .. })),
            Self::Hull(_)
            | Self::ClockAheadS(_)
            | Self::NoSurgeLag
            | Self::NoTurnRate
            | Self::AskedEveryS(_)
            | Self::Breakdown { .. } => true,
        }
    }

    pub(super) fn vary_scenario(self, scenario: &mut Scenario) {
        match self {
            Self::ClockAheadS(by) => scenario.faults.push(FaultFile {
                from_s: Quantity::fixed(0.0),
                until_s: None,
                craft: None,
                what: FaultKindFile::ClockOffset { offset_s: Quantity::fixed(by) },
            }),
            Self::LateReportsS(by) => {
                if let Some(acoustics) = &mut scenario.knowledge.acoustics {
                    acoustics.latency_s = Quantity::fixed(acoustics.latency_s.most() + by);
                }
            }
            _ => {}
        }
    }

    pub(super) fn vary_start(self, start: &mut Start) {
        match self {
            Self::Hull(factor) => {
                if let Some(craft) = &mut start.world.surface_craft {
                    craft.hull = heavier(&craft.hull, factor);
                }
            }
            Self::Breakdown { what, at_s } => {
                start.world.faults.0.push(Fault { from: at_s, until: f64::INFINITY, what: what.kind() });
            }
            _ => {}
        }
    }

    /// `true` if it changes the craft itself.
    pub(in crate::campaign) fn changes_craft(self) -> bool {
        matches!(self, Self::Hull(_) | Self::Breakdown { .. })
    }

    pub(super) fn vary_observation(self, observation: &mut PlanRequest) {
        match self {
            Self::WrongCurrentMps([north, east]) => {
                if let Some(current) = &mut observation.current {
                    current.north_mps += north;
                    current.east_mps += east;
                }
            }
            Self::NoSurgeLag => {
                let craft = observation.craft.get_or_insert_default();
                craft.surge_loop.time_constant_s = Some(0.0);
            }
            Self::NoTurnRate => {
                observation.limits.get_or_insert_default().turn_rate_max_radps = Some(TURN_RATE_ANY);
                let craft = observation.craft.get_or_insert_default();
                craft.heading_loop.rate_max_radps = Some(TURN_RATE_ANY);
            }
            Self::NoPreview => {
                if let Goal::Intermittent { auvs, dwell_s, epoch_s } = &observation.goal.goal {
                    let followed = in_turn(observation.t_s - epoch_s, *dwell_s, auvs.len());
                    observation.goal.goal = Goal::Track { auv: auvs[followed].clone() };
                }
            }
            _ => {}
        }
    }
}

fn heavier(hull: &SurfaceHull, factor: f64) -> SurfaceHull {
    let drag = |drag: Drag| Drag { linear: factor * drag.linear, quadratic: factor * drag.quadratic };
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

#[cfg(test)]
mod tests {
    use planner::los::LosLaw;

    use super::super::Controller;
    use super::*;
    use sim::{mission::run_from, record::Record};

    fn short(name: &str) -> Scenario {
        Scenario::named(name).expect("exists").lasting(60.0)
    }

    fn varied(variation: Variation, scenario: &Scenario) -> Record {
        let mut controller = Controller::law(LosLaw::SaturatedLos);
        controller.entry.variation = Some(variation);
        fly(&controller, scenario)
    }

    fn plain(scenario: &Scenario) -> Record {
        fly(&Controller::law(LosLaw::SaturatedLos), scenario)
    }

    fn fly(controller: &Controller, scenario: &Scenario) -> Record {
        let scenario = controller.scenario(scenario);
        let mut start = scenario.start(1).expect("starts");
        controller.vary_start(&mut start);
        let mut guide = controller.guide(controller.grid()[0]);
        run_from(start, &scenario, guide.as_mut(), 1, &mut |_| {}).expect("runs")
    }

    #[test]
    fn a_variation_that_changes_nothing_changes_nothing() {
        let scenario = short("cross-current");
        let usual = plain(&scenario).rows;
        for variation in [
            Variation::Hull(1.0),
            Variation::WrongCurrentMps([0.0, 0.0]),
            Variation::ClockAheadS(0.0),
            Variation::AskedEveryS(1),
        ] {
            assert_eq!(varied(variation, &scenario).rows, usual, "{variation:?}");
        }
    }

    #[test]
    fn every_variation_of_the_world_changes_the_run() {
        let scenario = short("noisy-fixes");
        let usual = plain(&scenario).rows;
        let breakdowns = [
            Breakdown::SlowHeadingLoop,
            Breakdown::PortThrusterLost,
            Breakdown::RudderStuck,
            Breakdown::HeadingOffset,
        ];
        let others = [
            Variation::Hull(0.7),
            Variation::WrongCurrentMps([0.1, 0.0]),
            Variation::LateReportsS(5.0),
            Variation::AskedEveryS(2),
        ];
        let broken = breakdowns.map(|what| Variation::Breakdown { what, at_s: 5.0 });
        for variation in others.into_iter().chain(broken) {
            assert_ne!(varied(variation, &scenario).rows, usual, "{variation:?}");
        }
    }

    #[test]
    fn a_reference_is_held_between_two_questions() {
        let record = varied(Variation::AskedEveryS(5), &short("paper-tracking"));
        let rows = record.rows.iter();
        let references = rows.map(|row| row.surface_craft.as_ref().expect("has one").reference);
        let references: Vec<_> = references.collect();
        for held in references.chunks(5) {
            assert!(held.iter().all(|reference| *reference == held[0]));
        }
        assert_ne!(references[0], references[5]);
    }

    #[test]
    fn a_goal_without_hand_overs_has_no_preview_to_miss() {
        assert!(Variation::NoPreview.applies(&short("switching")));
        assert!(!Variation::NoPreview.applies(&short("calm")));
    }

    #[test]
    fn a_heavier_hull_is_slower_but_declares_the_same_limits() {
        let scenario = short("paper-tracking");
        let (heavy, usual) = (varied(Variation::Hull(1.3), &scenario), plain(&scenario));
        assert_eq!(heavy.limits, usual.limits);
        let fastest = |record: &Record| record.plant.expect("calm water").speed_max;
        // Quadratic drag: top speed falls with its root.
        let ratio = fastest(&heavy) / fastest(&usual);
        assert!((ratio - 1.3_f64.powf(-0.5)).abs() < 0.02, "{ratio}");
    }
}
