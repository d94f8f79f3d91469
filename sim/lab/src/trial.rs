//! A simulated sea trial: half an hour of manoeuvres that identify a craft.
//!
//! Zig-zag and turning circle follow the IMO's *Standards for ship manoeuvrability* (resolution
//! MSC.137(76), 2002), scaled down, with references instead of rudder angles. Speed and heading
//! steps identify the response model, the drift test the current.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{angle::Heading, los::Reference, snapshot::Limits};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::identify::LogRow;
use sim::{
    fault::Faults,
    inner_loop::{DragFeedForward, PERIOD, SurfaceAutopilot},
    observe::{SensorSetup, SurfaceSensors},
    scenario::{Scenario, ScenarioError},
    surface_craft::{SurfaceClass, SurfaceHull},
    water::{Water, WaterSetup},
    world::{SurfaceCraft, World},
};

/// Inner-loop periods from one row of a log to the next: five rows a second.
const PERIODS_PER_ROW: u32 = 2;

/// Working speed, as a share of the top speed.
const WORKING: f64 = 0.5;
/// Heading of the way back, rad: less than a half turn, whose side would be arbitrary.
const BACK: f64 = 170.0 / 180.0 * std::f64::consts::PI;

/// Current of a trial (north, east), m/s: separates speed through water and over ground.
const CURRENT: Vector2<f64> = Vector2::new(0.12, 0.09);

/// Turns of a circle: over one despite the craft's lag, without a half turn on the way back.
const ROUNDS: f64 = 1.3;

/// A part of a trial with one speed and one turn rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialLeg {
    /// Duration, s.
    pub duration: f64,
    /// Speed reference, m/s.
    pub speed: f64,
    /// Heading reference at its start, rad.
    pub heading: f64,
    /// Rate of turn of the heading reference, rad/s.
    pub turn_rate: f64,
}

/// The legs of a trial, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The legs.
    pub legs: Vec<TrialLeg>,
}

impl Trial {
    /// Half an hour for a craft with that top speed, m/s, and largest turn rate, rad/s.
    pub(crate) fn half_hour(speed_max: f64, turn_rate_max: f64) -> Self {
        let mut legs = Vec::new();
        let mut leg = |duration, speed: f64, heading, turn_rate| {
            legs.push(TrialLeg { duration, speed: speed * speed_max, heading, turn_rate });
        };
        leg(60.0, WORKING, 0.0, 0.0);
        // Speed steps on both courses: small ones for the time constant, large ones for the limits.
        for heading in [0.0, BACK] {
            leg(30.0, WORKING, heading, 0.0);
            for speed in [0.6, 0.5, 0.4, 0.5] {
                leg(30.0, speed, heading, 0.0);
            }
            for speed in [0.25, 0.85, 0.25, 0.85, 0.25] {
                leg(45.0, speed, heading, 0.0);
            }
        }
        leg(40.0, WORKING, BACK, 0.0);
        // Heading steps, then a zig-zag.
        for degrees in [10.0_f64, 0.0, -30.0, 0.0, 60.0, 0.0, 90.0, 180.0, -20.0, 0.0] {
            leg(35.0, WORKING, BACK + degrees.to_radians(), 0.0);
        }
        for degrees in [20.0_f64, -20.0, 20.0, -20.0, 45.0, -45.0, 45.0, -45.0, 0.0] {
            leg(15.0, WORKING, BACK + degrees.to_radians(), 0.0);
        }
        // Circles at half of the fastest turn: the reference is followed all the way round.
        for turn_rate in [0.5 * turn_rate_max, -0.5 * turn_rate_max] {
            leg(ROUNDS * TAU / turn_rate.abs(), WORKING, BACK, turn_rate);
            leg(30.0, WORKING, BACK, 0.0);
        }
        // Drift.
        leg(120.0, 0.0, BACK, 0.0);
        Self { legs }
    }

    /// Its duration, s.
    pub fn duration(&self) -> f64 {
        self.legs.iter().map(|leg| leg.duration).sum()
    }

    /// Speed and heading reference at `time` s after its start; the last leg continues.
    pub fn reference(&self, time: f64) -> (f64, f64) {
        let mut begin = 0.0;
        for leg in &self.legs {
            if time < begin + leg.duration {
                return (leg.speed, leg.heading + leg.turn_rate * (time - begin));
            }
            begin += leg.duration;
        }
        self.legs.last().map_or((0.0, 0.0), |leg| (leg.speed, leg.heading + leg.turn_rate * leg.duration))
    }
}

/// A trial with its craft and water.
#[derive(Clone, Debug)]
pub struct TrialSetup {
    /// The manoeuvres.
    pub trial: Trial,
    world: World,
}

/// A trial cannot start.
#[derive(Debug, thiserror::Error)]
pub enum NoTrial {
    /// The scenario has no surface craft.
    #[error("the scenario has no surface craft")]
    NoSurfaceCraft,
    /// The scenario does not start.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

impl TrialSetup {
    /// A craft of that class, with drag feed-forward; current 0.15 m/s.
    pub fn of_class(class: SurfaceClass) -> Self {
        let autopilot = class.autopilot(DragFeedForward::On);
        Self::with(class.hull(), autopilot, &class.limits())
    }

    /// A craft with that hull and autopilot, likewise.
    pub fn with(hull: SurfaceHull, autopilot: SurfaceAutopilot, limits: &Limits) -> Self {
        let trial = Trial::half_hour(limits.speed_max, limits.turn_rate_max);
        let (speed, heading) = trial.reference(0.0);
        let craft = SurfaceCraft::cruising(hull, autopilot, &Vector2::zeros(), heading, speed);
        let water = Water::new(&WaterSetup::constant(CURRENT), ChaCha8Rng::seed_from_u64(0));
        Self { world: World::new(Some(craft), Vec::new(), water, Faults(Vec::new())), trial }
    }

    /// The surface craft of `scenario` in its water.
    pub fn of(scenario: &Scenario, seed: u64) -> Result<Self, NoTrial> {
        let start = scenario.start(seed)?;
        let limits = start.limits.ok_or(NoTrial::NoSurfaceCraft)?;
        let mut world = start.world;
        world.auvs.clear();
        Ok(Self { trial: Trial::half_hour(limits.speed_max, limits.turn_rate_max), world })
    }

    /// The log of the trial by a small craft's sensors, whose errors `seed` draws.
    pub fn fly(&self, seed: u64) -> Vec<LogRow> {
        let mut sensors = SurfaceSensors::new(SensorSetup::SMALL_CRAFT, ChaCha8Rng::seed_from_u64(seed));
        let (mut world, mut rows, mut energy) = (self.world.clone(), Vec::new(), 0.0);
        while world.time() < self.trial.duration() {
            let (speed, heading) = self.trial.reference(world.time());
            let reference = Reference { speed, heading: Heading::new(heading) };
            if let Some(craft) = &world.surface_craft
                && world.periods().is_multiple_of(PERIODS_PER_ROW)
            {
                let interval = f64::from(PERIODS_PER_ROW) * PERIOD;
                let current = world.water.current(&craft.position(), 0.0);
                let works = world.faults.gnss_works(world.time());
                let measured = sensors.measure(craft, &current, works, interval);
                rows.push(LogRow {
                    time: world.time(),
                    speed_reference: speed,
                    heading_reference: reference.heading.radians(),
                    heading: measured.heading().radians(),
                    surge: Some(measured.speed_mps),
                    sway: Some(measured.sway_mps),
                    ground_velocity: measured.ground_velocity(),
                    position: Some(measured.position()),
                    power: (!rows.is_empty()).then_some((craft.energy - energy) / interval),
                });
                energy = craft.energy;
            }
            world.step(Some(&reference));
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_lasts_half_an_hour_and_no_step_of_heading_is_a_half_turn() {
        for (speed_max, turn_rate_max) in [(1.5, 0.3), (2.0, 0.2), (1.0, 0.1)] {
            let trial = Trial::half_hour(speed_max, turn_rate_max);
            let minutes = trial.duration() / 60.0;
            assert!((25.0..=36.0).contains(&minutes), "{minutes}");
            for two in trial.legs.windows(2) {
                let before = two[0].heading + two[0].turn_rate * two[0].duration;
                let step = planner::angle::wrap(two[1].heading - before);
                assert!(step.abs() < 172.0_f64.to_radians(), "{two:?}");
            }
        }
    }

    #[test]
    fn references_are_those_of_the_leg_and_go_round_in_a_circle() {
        let trial = Trial::half_hour(1.5, 0.3);
        assert_eq!(trial.reference(0.0), (0.75, 0.0));
        let mut begin = 0.0;
        for leg in &trial.legs {
            let (speed, heading) = trial.reference(begin + 0.5 * leg.duration);
            assert_eq!(speed, leg.speed);
            assert!((heading - leg.heading - 0.5 * leg.turn_rate * leg.duration).abs() < 1e-9);
            begin += leg.duration;
        }
        assert_eq!(trial.reference(begin + 100.0).0, 0.0, "the drift test goes on");
    }

    #[test]
    fn a_log_has_five_rows_a_second_and_follows_from_its_seed() {
        let setup = TrialSetup::of_class(SurfaceClass::Medusa);
        let log = setup.fly(3);
        assert_eq!(log, setup.fly(3));
        assert_ne!(log, setup.fly(4));
        assert!((log[5].time - log[0].time - 1.0).abs() < 1e-9);
        let rows = 5.0 * setup.trial.duration();
        assert!((rows - f64::from(u32::try_from(log.len()).expect("thousands"))).abs() <= 1.0);
    }
}
