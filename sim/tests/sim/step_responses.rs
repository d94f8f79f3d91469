//! Closed-loop surface craft: steps and ramps of speed and heading, and the declared limits.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use pilotfish_sim::{
    inner_loop::{AutopilotMemory, DragFeedForward, PERIOD},
    integrate::rk4,
    surface_craft::{
        SurfaceClass, SurfaceHull, SurfaceInput, SurfaceState, Thrust, ThrusterHealth, Thrusters,
    },
    world::{Sea, SurfaceCraft},
};
use planner::{angle::Heading, los::Reference};

use crate::near;

use DragFeedForward::{Off, On};
use SurfaceClass::{Medusa, Otter};

/// A craft at the end of each period since its speed and heading reference.
struct Trial {
    hull: SurfaceHull,
    class: SurfaceClass,
    mode: DragFeedForward,
    memory: AutopilotMemory,
    state: SurfaceState,
}

impl Trial {
    /// Steady on a straight course to the north.
    fn steady(class: SurfaceClass, mode: DragFeedForward, speed: f64) -> Self {
        let hull = class.hull();
        Self {
            hull,
            class,
            mode,
            memory: AutopilotMemory::settled_at(&class.autopilot(mode), hull.drag_surge, speed, 0.0),
            state: hull.cruising(&Vector2::zeros(), 0.0, speed),
        }
    }

    /// The thrust asked for by the loops now, with these references.
    fn thrust(&mut self, speed: f64, heading: f64) -> Thrust {
        let reference = reference(speed, heading);
        let (autopilot, still) = (self.class.autopilot(self.mode), Vector2::zeros());
        let command = autopilot.command(&self.hull, &mut self.memory, &self.state, &still, &reference);
        self.hull.thrusters.steady(command, ThrusterHealth::SOUND)
    }

    /// States at the beginning of every period of `duration` s with these references.
    fn follow(&mut self, speed: f64, heading: f64, duration: f64) -> Vec<SurfaceState> {
        let mut states = vec![];
        let mut time = 0.0;
        while time < duration {
            states.push(self.state);
            let steady = self.thrust(speed, heading);
            // A fifth of the period: fine enough for a lag of a fifth of a period.
            for _ in 0..5 {
                self.state = rk4(&self.state, 0.2 * PERIOD, |x| {
                    self.hull.derivative(x, steady, SurfaceInput::default(), &Vector2::zeros())
                });
            }
            time += PERIOD;
        }
        states
    }
}

fn reference(speed: f64, heading: f64) -> Reference {
    let heading = Heading::new(heading);
    Reference { speed, heading }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::MIN, f64::max)
}

/// Time of the period with that index, s.
fn time(index: usize) -> f64 {
    PERIOD * f64::from(u32::try_from(index).expect("trials are short"))
}

fn time_to_63_percent(class: SurfaceClass, from: f64, to: f64, mode: DragFeedForward) -> f64 {
    let level = from + 0.632 * (to - from);
    let states = Trial::steady(class, mode, from).follow(to, 0.0, 120.0);
    let there = states.iter().position(|state| (state[3] - level) * (to - from).signum() >= 0.0);
    time(there.expect("the loop gets there"))
}

#[test]
fn drag_feed_forward_speeds_up_the_medusa_s_surge() {
    for (from, to, mode, published) in
        [(0.3, 0.7, Off, 4.9), (0.3, 1.5, Off, 39.0), (0.3, 0.7, On, 2.3), (0.3, 1.5, On, 5.7)]
    {
        near(time_to_63_percent(Medusa, from, to, mode) / published, 1.0, 0.15);
    }
}

/// Time until the heading stays within 5 % of a right-angle step, s, and the overshoot, rad.
fn right_angle(class: SurfaceClass, thrusters: Thrusters, speed: f64) -> (f64, f64) {
    let mut trial = Trial::steady(class, Off, speed);
    trial.hull.thrusters = thrusters;
    let states = trial.follow(speed, FRAC_PI_2, 40.0);
    let is_outside = |state: &SurfaceState| (state[2] - FRAC_PI_2).abs() > 0.05 * FRAC_PI_2;
    let settled = time(states.iter().rposition(is_outside).expect("starts outside") + 1);
    (settled, largest(states.iter().map(|state| state[2])) - FRAC_PI_2)
}

#[test]
fn the_medusa_turns_a_right_angle_in_three_seconds_with_or_without_lag() {
    let thrusters = Medusa.hull().thrusters;
    // 0.02 s is next to none.
    let settled = [0.02, 0.1, 0.2].map(|lag| right_angle(Medusa, Thrusters { lag, ..thrusters }, 0.3));
    near(settled[1].0 / 3.1, 1.0, 0.15);
    assert!(settled.is_sorted_by(|shorter, longer| shorter.1 <= longer.1), "{settled:?}");
}

#[test]
fn the_otter_answers_like_a_heavier_medusa() {
    // The small step with feed-forward is the scaled loop's: the MEDUSA's, within rounding.
    let [otter, medusa] = [Otter, Medusa].map(|class| time_to_63_percent(class, 0.3, 0.5, On));
    near(otter / medusa, 1.0, 0.1);
    let (settled, overshoot) = right_angle(Otter, Otter.hull().thrusters, 1.0);
    // The drag's 1 + 10 |r| holds it to 0.36 rad/s: 1.4 rad of the step at that rate are 4 s.
    assert!((4.0..7.0).contains(&settled), "{settled} s");
    assert!(overshoot < 0.05 * FRAC_PI_2, "{overshoot} rad");
}

#[test]
fn a_saturated_surge_loop_does_not_wind_up() {
    for (class, flat_out) in [(Medusa, (72.0_f64 / 27.5).sqrt()), (Otter, 6.0 * 0.5144)] {
        for mode in [On, Off] {
            let mut trial = Trial::steady(class, mode, 0.3);
            // Out of reach for ten minutes: nothing of that may be stored.
            let asked = trial.follow(2.0 * flat_out, 0.0, 600.0);
            near(asked.last().expect("some")[3], flat_out, 1e-2 * flat_out);
            // A loop that had wound up would need as long again.
            let wanted = 0.8 * flat_out;
            let mut slower = trial.follow(wanted, 0.0, 30.0).into_iter();
            assert!(slower.any(|state| state[3] < wanted + 0.2), "{class:?} {mode:?}");
        }
    }
}

#[test]
fn a_surge_loop_without_thrust_in_a_turn_does_not_wind_up() {
    let fastest_at_2 = |mut trial: Trial| {
        let straight = trial.follow(2.0, trial.state[2], 60.0);
        largest(straight.iter().map(|state| state[3]))
    };
    let mut turning = Trial::steady(Otter, On, 2.0);
    for _ in 0..400 {
        // Always 1.2 rad ahead: the moment stays at its limit, and surge gets no thrust.
        let _ = turning.follow(2.0, turning.state[2] + 1.2, PERIOD);
    }
    let starved = turning.state[3];
    assert!(starved < 1.0, "{starved}");
    let from_straight = fastest_at_2(Trial::steady(Otter, On, starved));
    // 0.4 m/s over forty seconds at 5.1 N/m would store 82 N, another metre per second.
    near(fastest_at_2(turning), from_straight, 0.05);
}

#[test]
fn a_slow_craft_keeps_its_speed_despite_the_dead_zone() {
    // 0.1 m/s needs 0.14 N of each thruster, less than their least: they must switch.
    let states = Trial::steady(Medusa, Off, 0.0).follow(0.1, 0.0, 600.0);
    for state in &states[3000..] {
        near(state[3], 0.1, 0.01);
    }
}

#[test]
fn the_limits_declared_to_the_planner_are_met() {
    for class in [Medusa, Otter] {
        let limits = class.limits();
        // A heading that turns at the promised rate, at any promised speed.
        for speed in [limits.speed_min + 0.2, 0.5 * limits.speed_max, limits.speed_max] {
            let mut trial = Trial::steady(class, On, speed);
            for k in 0..200 {
                let _ = trial.follow(speed, limits.turn_rate_max * PERIOD * f64::from(k), PERIOD);
            }
            near(trial.state[5] / limits.turn_rate_max, 1.0, 0.02);
            // The turn's Coriolis load c_v v r, 4.7 N on the MEDUSA at full speed, is 0.18 m/s of
            // proportional error; 20 s integrate half of it away.
            assert!(trial.state[3] > speed - 0.1, "{class:?}, {speed}: {}", trial.state[3]);
        }
    }
}

/// Largest lag of the craft behind a speed reference that goes from `from` to `to` at `rate` m/s²,
/// in the direction of the change, m/s.
fn furthest_behind(class: SurfaceClass, from: f64, to: f64, rate: f64) -> f64 {
    let mut craft = SurfaceCraft::cruising(class.hull(), class.autopilot(On), &Vector2::zeros(), 0.0, from);
    let (mut time, mut furthest): (f64, f64) = (0.0, 0.0);
    let sense = (to - from).signum();
    while rate * time < (to - from).abs() {
        let asked = from + sense * rate * time;
        furthest = furthest.max((asked - craft.state[3]) * sense);
        craft.step(&reference(asked, 0.0), ThrusterHealth::SOUND, &Sea::calm());
        time += PERIOD;
    }
    furthest
}

#[test]
fn feed_forward_follows_promised_ramps_with_the_preset_s_time_constant() {
    for class in [Medusa, Otter] {
        let limits = class.limits();
        let (up, down) = (limits.acceleration_max, limits.deceleration_max);
        let time_constant = class.craft().craft().surge.time_constant;
        for (slow, fast) in [(0.3, limits.speed_max), (limits.speed_min, 0.6)] {
            for (from, to, rate) in [(slow, fast, up), (fast, slow, down)] {
                // A first-order response lags a ramp by T × rate at most, and nearly by that.
                let share = furthest_behind(class, from, to, rate) / (time_constant * rate);
                assert!((0.5..=1.0).contains(&share), "{class:?} {from} to {to}: {share}");
            }
        }
    }
}

#[test]
fn either_mode_gives_the_promised_acceleration_from_a_steady_speed() {
    for (class, mode) in [(Medusa, On), (Medusa, Off), (Otter, On), (Otter, Off)] {
        let (hull, limits) = (class.hull(), class.limits());
        for speed in [0.3, 0.7, 1.2, 0.9 * limits.speed_max] {
            let first = |asked: f64| {
                let mut trial = Trial::steady(class, mode, speed);
                let steady = trial.thrust(asked, 0.0);
                (trial.state[6], trial.state[7]) = (steady.port, steady.starboard);
                hull.derivative(&trial.state, steady, SurfaceInput::default(), &Vector2::zeros())[3]
            };
            let (up, down) = (first(speed + 0.5), -first(speed - 0.5));
            assert!(up >= limits.acceleration_max, "{class:?} {mode:?} {speed}");
            assert!(down >= limits.deceleration_max, "{class:?} {mode:?} {speed}");
        }
    }
}
