//! The only gate from truth to knowledge: what the vehicles report of themselves.
//!
//! A guidance law sees a [`Snapshot`] and nothing else, and every law sees the same one.

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading, direction},
    snapshot::{
        AscState, Auv, Fallback, ForecastChoice, HoldStyle, InvalidObservation, Observation, Snapshot,
    },
};

use crate::{
    scenario::SurfaceCraftSetup,
    world::{Diver, SurfaceCraft, World},
};

mod acoustics;
mod noise;
mod sensors;
mod setup;

pub use acoustics::{Acoustics, AcousticsSetup, Emission, Fix, Tally};
pub use sensors::{SensorSetup, SurfaceSensors, SurfaceTruth};
pub use setup::InvalidSetup;

/// What is known at `time` s: every vehicle's state without noise or delay, and the current.
pub fn observe(
    world: &World,
    craft: &SurfaceCraft,
    setup: &SurfaceCraftSetup,
    time: f64,
) -> Result<Snapshot, InvalidObservation> {
    Snapshot::try_from(Observation {
        time,
        asc: surface_craft(craft, &world.current),
        auvs: world
            .divers
            .iter()
            .map(|diver| underwater_vehicle(diver, &world.current))
            .collect(),
        goal: setup.goal.clone(),
        current: Some(world.current),
        limits: setup.limits(),
        forecast: ForecastChoice::Auto,
        fallback: Fallback::Ladder,
        hold: HoldStyle::SlowTurn,
        previous_plan: None,
    })
}

fn surface_craft(craft: &SurfaceCraft, current: &Vector2<f64>) -> AscState {
    let state = &craft.state;
    let through_water = planner::angle::ned_from_body(state[2]) * Vector2::new(state[3], state[4]);
    AscState {
        position: craft.position(),
        heading: Heading::new(state[2]),
        surge: state[3],
        sway: state[4],
        yaw_rate: state[5],
        ground_velocity: Some(through_water + current),
    }
}

/// A diver's report: ground track as its navigation gives it, and the course's rate of turn.
///
/// ```text
/// g = u_h [cosψ, sinψ] + v_c        χ̇ = ψ̇ u_h (g · [cosψ, sinψ]) / ‖g‖²
/// ```
/// The rate is that of a turn at steady speed, from the gyroscope: in a current the course also swings
/// for a few seconds whenever a pitch reversal changes `u_h`, which is no turn and is not reported as one.
fn underwater_vehicle(diver: &Diver, current: &Vector2<f64>) -> Auv {
    let bow = direction(diver.heading());
    let u_h = diver.horizontal_speed();
    let ground = bow * u_h + current;
    let speed = ground.norm();
    // Standing still over ground there is no course to turn.
    let turn_rate = if speed < f64::EPSILON {
        0.0
    } else {
        diver.heading_rate() * u_h * ground.dot(&bow) / (speed * speed)
    };
    Auv {
        id: diver.id.clone(),
        position: diver.position(),
        depth: diver.depth(),
        course: Course::of(&ground),
        speed,
        // The snapshot accepts ±1 rad/s; almost at rest over ground the quotient has no bound.
        turn_rate: turn_rate.clamp(-1.0, 1.0),
        age: 0.0,
        path: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    #[test]
    fn the_reported_course_and_turn_rate_are_those_of_the_ground_track() {
        let scenario = Scenario::named("cross-current").expect("exists");
        let mut world = scenario.world(1);
        let mut turning = 0;
        for _ in 0..6_000 {
            let before = underwater_vehicle(&world.divers[0], &world.current);
            let start = world.divers[0].clone();
            world.step(None);
            let diver = &world.divers[0];
            let moved = (diver.position() - start.position()) / crate::inner_loop::PERIOD;
            assert!((moved - before.velocity()).norm() < 0.02);
            let after = underwater_vehicle(diver, &world.current);
            let steady = (diver.horizontal_speed() - start.horizontal_speed()).abs() < 1e-5;
            if steady && before.turn_rate.abs() > 0.005 {
                turning += 1;
                let turned = planner::angle::wrap(after.course.radians() - before.course.radians());
                let rate = turned / crate::inner_loop::PERIOD;
                // The mean of both ends: the trapezium's error is of second order in the period.
                assert!(
                    (rate - 0.5 * (before.turn_rate + after.turn_rate)).abs() < 1e-3,
                    "{rate}"
                );
            }
        }
        assert!(turning > 100, "{turning}");
    }
}
