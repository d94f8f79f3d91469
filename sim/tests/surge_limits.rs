//! What the planner is told of the craft's surge, against the closed loop itself.

use nalgebra::Vector2;
use planner::{angle::Heading, los::Reference, snapshot::Limits};
use sim::{
    inner_loop::{DragFeedForward, PERIOD, SurgeLoop, steer_surface_craft},
    integrate::rk4,
    scenario::{Scenario, SurfaceCraftSetup},
    surface_craft::{SurfaceHull, SurfaceState},
};

fn setup(feed_forward: DragFeedForward) -> SurfaceCraftSetup {
    let tracking = Scenario::named("paper-tracking").expect("exists");
    SurfaceCraftSetup {
        feed_forward,
        ..tracking.surface_craft.expect("has one")
    }
}

/// Largest amount by which the craft falls behind a reference that goes from `from` to `to` at `rate`
/// m/s², in the direction of the change, m/s.
fn furthest_behind(from: f64, to: f64, rate: f64, mode: DragFeedForward) -> f64 {
    let hull = SurfaceHull::MEDUSA;
    let mut surge = SurgeLoop::settled_at(from, mode, hull.drag_surge);
    let mut state = SurfaceState::zeros();
    state[3] = from;
    let (mut time, mut furthest): (f64, f64) = (0.0, 0.0);
    while rate * time < (to - from).abs() {
        let speed = from + (to - from).signum() * rate * time;
        let reference = Reference {
            speed,
            heading: Heading::new(0.0),
        };
        let input = steer_surface_craft(&hull, &mut surge, &state, &reference);
        furthest = furthest.max((speed - state[3]) * (to - from).signum());
        state = rk4(&state, PERIOD, |x| hull.derivative(x, input, &Vector2::zeros()));
        time += PERIOD;
    }
    furthest
}

#[test]
fn with_feed_forward_ramps_at_the_promised_rates_are_followed_with_the_promised_lag() {
    let Limits {
        acceleration_max,
        deceleration_max,
        surge_lag,
        ..
    } = setup(DragFeedForward::On).limits();
    for (slow, fast) in [(0.3, 1.5), (0.05, 0.6)] {
        for (from, to, rate) in [(slow, fast, acceleration_max), (fast, slow, deceleration_max)] {
            let behind = furthest_behind(from, to, rate, DragFeedForward::On);
            println!(
                "{from} -> {to} at {rate}: {behind:.3} m/s behind, lag {:.1} s",
                behind / rate
            );
            // A first-order answer follows a ramp at most lag × rate behind it, and nearly that far.
            assert!(behind <= surge_lag * rate, "{from} to {to}: {behind}");
            assert!(behind >= 0.5 * surge_lag * rate, "{from} to {to}: {behind}");
        }
    }
}

#[test]
fn from_a_steady_speed_either_mode_gives_the_promised_acceleration_at_once() {
    let hull = SurfaceHull::MEDUSA;
    for mode in [DragFeedForward::On, DragFeedForward::Off] {
        let limits = setup(mode).limits();
        for speed in [0.3, 0.7, 1.2] {
            let first = |asked: f64| {
                let mut surge = SurgeLoop::settled_at(speed, mode, hull.drag_surge);
                let state = SurfaceState::new(0.0, 0.0, 0.0, speed, 0.0, 0.0);
                let reference = Reference {
                    speed: asked,
                    heading: Heading::new(0.0),
                };
                let input = steer_surface_craft(&hull, &mut surge, &state, &reference);
                hull.derivative(&state, input, &Vector2::zeros())[3]
            };
            assert!(first(speed + 0.3) >= limits.acceleration_max, "{mode:?} {speed}");
            assert!(-first(speed - 0.3) >= limits.deceleration_max, "{mode:?} {speed}");
        }
    }
}

#[test]
fn without_feed_forward_drag_outruns_the_loop() {
    // What the planner must find by itself: the same ramps leave the loop on its clamp of 0.2 m/s.
    let Limits {
        acceleration_max,
        deceleration_max,
        ..
    } = setup(DragFeedForward::Off).limits();
    for (from, to, rate) in [(0.3, 1.5, acceleration_max), (1.5, 0.3, deceleration_max)] {
        assert!(furthest_behind(from, to, rate, DragFeedForward::Off) > 0.2 + 0.1);
    }
}
