//! The surge response given to the planner, against the closed loop itself.

use nalgebra::Vector2;
use pilotfish_sim::{
    inner_loop::{AutopilotMemory, DragFeedForward, Measured, PERIOD},
    integrate::rk4,
    surface_craft::{SurfaceClass, SurfaceInput, ThrusterHealth},
};
use planner::{angle::Heading, los::Reference, snapshot::Limits};

/// Largest amount by which the craft falls behind a reference that goes from `from` to `to` at `rate`
/// m/s², in the direction of the change, m/s.
fn furthest_behind(class: SurfaceClass, from: f64, to: f64, rate: f64, mode: DragFeedForward) -> f64 {
    let (hull, autopilot) = (class.hull(), class.autopilot(mode));
    let mut memory = AutopilotMemory::settled_at(&autopilot, hull.drag_surge, from, 0.0);
    let mut state = hull.cruising(&Vector2::zeros(), 0.0, from);
    let (mut time, mut furthest): (f64, f64) = (0.0, 0.0);
    while rate * time < (to - from).abs() {
        let speed = from + (to - from).signum() * rate * time;
        let reference = Reference {
            speed,
            heading: Heading::new(0.0),
        };
        let command = autopilot.command(
            &hull,
            &mut memory,
            &Measured::of(&state, &Vector2::zeros()),
            &reference,
        );
        let steady = hull.thrusters.steady(command, ThrusterHealth::SOUND);
        furthest = furthest.max((speed - state[3]) * (to - from).signum());
        state = rk4(&state, PERIOD, |x| {
            hull.derivative(x, steady, SurfaceInput::default(), &Vector2::zeros())
        });
        time += PERIOD;
    }
    furthest
}

#[test]
fn with_feed_forward_ramps_at_the_promised_rates_are_followed_with_the_presets_time_constant() {
    for class in [SurfaceClass::Medusa, SurfaceClass::Otter] {
        let Limits {
            speed_min,
            speed_max,
            acceleration_max,
            deceleration_max,
            ..
        } = class.limits();
        let time_constant = class.craft().craft().surge.time_constant;
        for (slow, fast) in [(0.3, speed_max), (speed_min, 0.6)] {
            for (from, to, rate) in [(slow, fast, acceleration_max), (fast, slow, deceleration_max)] {
                let behind = furthest_behind(class, from, to, rate, DragFeedForward::On);
                println!(
                    "{class:?} {from} -> {to} at {rate}: {behind:.3} m/s behind, lag {:.1} s",
                    behind / rate
                );
                // A first-order answer follows a ramp at most T × rate behind it, and nearly that far.
                assert!(
                    behind <= time_constant * rate,
                    "{class:?} {from} to {to}: {behind}"
                );
                assert!(
                    behind >= 0.5 * time_constant * rate,
                    "{class:?} {from} to {to}: {behind}"
                );
            }
        }
    }
}

#[test]
fn from_a_steady_speed_either_mode_gives_the_promised_acceleration_once_thrust_is_there() {
    for (class, mode) in [
        (SurfaceClass::Medusa, DragFeedForward::On),
        (SurfaceClass::Medusa, DragFeedForward::Off),
        (SurfaceClass::Otter, DragFeedForward::On),
        (SurfaceClass::Otter, DragFeedForward::Off),
    ] {
        let (hull, autopilot, limits) = (class.hull(), class.autopilot(mode), class.limits());
        for speed in [0.3, 0.7, 1.2, 0.9 * limits.speed_max] {
            let first = |asked: f64| {
                let mut memory = AutopilotMemory::settled_at(&autopilot, hull.drag_surge, speed, 0.0);
                let mut state = hull.cruising(&Vector2::zeros(), 0.0, speed);
                let reference = Reference {
                    speed: asked,
                    heading: Heading::new(0.0),
                };
                let command = autopilot.command(
                    &hull,
                    &mut memory,
                    &Measured::of(&state, &Vector2::zeros()),
                    &reference,
                );
                let steady = hull.thrusters.steady(command, ThrusterHealth::SOUND);
                (state[6], state[7]) = (steady.port, steady.starboard);
                hull.derivative(&state, steady, SurfaceInput::default(), &Vector2::zeros())[3]
            };
            assert!(
                first(speed + 0.5) >= limits.acceleration_max,
                "{class:?} {mode:?} {speed}"
            );
            assert!(
                -first(speed - 0.5) >= limits.deceleration_max,
                "{class:?} {mode:?} {speed}"
            );
        }
    }
}

#[test]
fn without_feed_forward_drag_outruns_the_loop() {
    // What the planner must find by itself: the same ramps leave the loop on its clamp.
    for class in [SurfaceClass::Medusa, SurfaceClass::Otter] {
        let (limits, clamp) = (
            class.limits(),
            class.autopilot(DragFeedForward::Off).surge.error_max,
        );
        for (from, to, rate) in [
            (0.3, limits.speed_max, limits.acceleration_max),
            (limits.speed_max, 0.3, limits.deceleration_max),
        ] {
            assert!(furthest_behind(class, from, to, rate, DragFeedForward::Off) > clamp + 0.1);
        }
    }
}
