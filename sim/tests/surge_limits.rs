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
fn ramps_at_the_promised_rates_are_followed_with_the_promised_lag() {
    for (mode, slow, fast) in [
        (DragFeedForward::On, 0.3, 1.5),
        (DragFeedForward::On, 0.05, 0.6),
        (DragFeedForward::Off, 0.05, 0.6),
    ] {
        let Limits {
            acceleration_max,
            deceleration_max,
            surge_lag,
            ..
        } = setup(mode).limits();
        for (from, to, rate) in [(slow, fast, acceleration_max), (fast, slow, deceleration_max)] {
            let behind = furthest_behind(from, to, rate, mode);
            println!(
                "{mode:?} {from} -> {to} at {rate}: {behind:.3} m/s behind, lag {:.1} s",
                behind / rate
            );
            // A first-order answer follows a ramp at most lag × rate behind it.
            assert!(behind <= surge_lag * rate, "{mode:?} {from} to {to}: {behind}");
            assert!(
                behind >= 0.5 * surge_lag * rate,
                "{mode:?} {from} to {to}: {behind}"
            );
        }
    }
}

#[test]
fn without_feed_forward_the_promised_rate_keeps_the_loop_off_its_clamp_and_twice_the_rate_does_not() {
    let limits = setup(DragFeedForward::Off).limits();
    for (from, to) in [(0.3, 1.5), (1.5, 0.3)] {
        let rate = limits.acceleration_max;
        assert!(furthest_behind(from, to, rate, DragFeedForward::Off) < 0.2);
        assert!(furthest_behind(from, to, 2.0 * rate, DragFeedForward::Off) > 0.2);
    }
}
