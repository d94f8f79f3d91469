//! Path following and the sawtooth: eqs. (8) to (32).

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Vector1, Vector2};
use planner::{
    angle::{direction, wrap},
    path::{Path, PathPoint, Side},
};
use sim::dive::{Dive, Leg};
use sim::inner_loop::PERIOD;
use sim::path_following::{PathCommand, PathError, PathFollowingGains, follow_path, sine_quotient};
use sim::scenario::Scenario;
use sim::world::World;

const GAINS: PathFollowingGains = PathFollowingGains::LAB;
/// Horizontal speed of a vehicle of 0.3 m/s at 50°, m/s.
const U_H: f64 = 0.3 * 0.642_787_609_686_539_3;

/// A vehicle that follows its command at once, and the point it follows.
#[derive(Clone, Copy)]
struct Ideal {
    position: Vector2<f64>,
    psi: f64,
    gamma: f64,
}

impl Ideal {
    fn error(&self, path: &Path) -> PathError {
        PathError::new(&self.position, self.psi, &path.at(self.gamma))
    }

    fn follow(&mut self, path: &Path, step: f64, law: impl Fn(&PathError, &PathPoint, f64) -> PathCommand) {
        let command = law(&self.error(path), &path.at(self.gamma), self.psi);
        self.position += direction(self.psi + 0.5 * command.heading_rate * step) * (U_H * step);
        self.psi += command.heading_rate * step;
        self.gamma += command.point_speed * step;
    }

    fn after(
        mut self,
        path: &Path,
        seconds: u32,
        law: impl Fn(&PathError, &PathPoint, f64) -> PathCommand,
    ) -> Self {
        for _ in 0..seconds * 100 {
            self.follow(path, 0.01, &law);
        }
        self
    }
}

fn projects(error: &PathError, point: &PathPoint, _psi: f64) -> PathCommand {
    follow_path(error, point.curvature, U_H, &GAINS)
}

fn straight(tangent: f64) -> Path {
    Path::starting_at(Vector2::zeros(), tangent).line(1000.0)
}

fn beside(tangent: f64, starboard: f64) -> Ideal {
    Ideal { position: direction(tangent + FRAC_PI_2) * starboard, psi: tangent, gamma: 0.0 }
}

fn settled_world(seconds: u32) -> World {
    let mut world = Scenario::named("paper-path-following").expect("exists").start(1).expect("valid").world;
    for _ in 0..seconds * 10 {
        world.step(None);
    }
    world
}

#[test]
fn eq_8_and_30_a_speed_profile_belongs_to_the_path_and_its_speed_is_along_the_body() {
    // Slow on the arc that an undisturbed vehicle enters after 100 s, by time and by arc length.
    let (entry, slow, fast) = (30.0, 0.1, 0.3);
    let in_time = |t: f64| if t < 100.0 { fast } else { slow };
    let on_path = |gamma: f64| if gamma < entry { fast } else { slow };
    // A following current of 0.1 m/s carries the vehicle along.
    let speed_past_the_entry = |speed: &dyn Fn(f64, f64) -> f64| {
        let (mut t, mut gamma) = (0.0, 0.0);
        while gamma < entry {
            gamma += (speed(t, gamma) + 0.1) * 0.1;
            t += 0.1;
        }
        speed(t, gamma)
    };
    let timed = speed_past_the_entry(&|t, _| in_time(t));
    assert_eq!(timed, fast, "as printed it enters the arc too fast");
    assert_eq!(speed_past_the_entry(&|_, gamma| on_path(gamma)), slow);

    // U_d is not the horizontal speed: half way down a leg the vehicle keeps U_d along its body.
    let auv = &settled_world(60).auvs[0];
    assert_eq!(auv.leg, Leg::Down);
    assert!((auv.state[5] - auv.speed.at(auv.gamma)).abs() < 1e-3);
    assert!((auv.horizontal_speed() - U_H).abs() < 2e-3, "0.193 m/s over ground, not 0.3");
}

#[test]
fn eq_9_the_point_s_speed_is_a_length_and_equals_gamma_s_rate_on_arc_length() {
    let path = Path::starting_at(Vector2::zeros(), 0.7).line(10.0).arc(Side::Port, 10.0, PI);
    let (rate, h) = (0.2, 1e-4);
    for gamma in [5.0, 20.0, 35.0] {
        let velocity = (path.at(gamma + rate * h).position - path.at(gamma - rate * h).position) / (2.0 * h);
        assert!((velocity.norm() - rate).abs() < 1e-8);
        // The printed right-hand side has two components, neither of which is the speed.
        assert!((velocity.x - rate).abs() > 5e-3 && (velocity.y - rate).abs() > 5e-3);
    }
}

#[test]
fn eq_17_dots_in_time_lose_the_curvature_of_a_point_that_stops_and_its_sign_when_it_backs() {
    let path = Path::starting_at(Vector2::zeros(), 0.0).arc(Side::Starboard, 10.0, PI);
    let in_time = |rate: f64| {
        let h = 1e-3;
        let at = |t: f64| path.at(15.0 + rate * t).position;
        let slope = (at(h) - at(-h)) / (2.0 * h);
        let bend = (at(h) - at(0.0) * 2.0 + at(-h)) / (h * h);
        slope.perp(&bend) / slope.norm().powi(3)
    };
    assert!(in_time(0.0).is_nan());
    assert!((in_time(-2.0) + 0.1).abs() < 1e-4, "backwards, the arc to starboard bends to port");
    assert_eq!(path.at(15.0).curvature, 0.1);
}

#[test]
fn eq_19_without_the_cosine_of_pitch_the_vehicle_trails_its_point() {
    // As printed, u drives the point, while the vehicle moves at u cosθ.
    let printed = |error: &PathError, point: &PathPoint, _: f64| PathCommand {
        point_speed: 0.3 * error.psi_e.cos() + GAINS.k_3 * error.s_1,
        ..follow_path(error, point.curvature, 0.3, &GAINS)
    };
    let path = straight(0.3);
    let trailing = beside(0.3, 1.0).after(&path, 200, printed).error(&path).s_1;
    println!("printed (19): s₁ settles at {trailing:.3} m");
    assert!((trailing + 0.36).abs() < 0.005);
    assert!(settled_world(180).auvs[0].path_error().s_1.abs() < 0.01);
}

#[test]
fn condition_iv_1_an_approach_angle_that_vanishes_everywhere_hardly_approaches() {
    let no_approach = PathFollowingGains { theta_a: 0.0, ..GAINS };
    let printed =
        |error: &PathError, point: &PathPoint, _: f64| follow_path(error, point.curvature, U_H, &no_approach);
    let path = straight(0.0);
    let left = |law: &dyn Fn(&PathError, &PathPoint, f64) -> PathCommand| {
        beside(0.0, 1.0).after(&path, 60, law).error(&path).y_1
    };
    assert!(left(&printed) > 0.4, "{}", left(&printed));
    assert!(left(&projects).abs() < 0.01, "{}", left(&projects));
    assert_eq!(GAINS.approach_angle(0.0), 0.0);
    assert!(GAINS.approach_angle(1.0) < 0.0 && GAINS.approach_angle(-1.0) > 0.0);
}

#[test]
fn eq_23_on_an_arc_the_heading_turns_while_its_error_rests() {
    let mut world = Scenario::named("paper-path-following").expect("exists").start(1).expect("valid").world;
    let mut on_arc = 0;
    for _ in 0..9000 {
        world.step(None);
        let auv = &world.auvs[0];
        let curvature = auv.path.at(auv.gamma).curvature;
        let (before, error) = (auv.heading(), auv.path_error());
        let mut next = world.clone();
        next.step(None);
        let psi_rate = (next.auvs[0].heading() - before) / PERIOD;
        if next.auvs[0].path.at(next.auvs[0].gamma).curvature != curvature {
            continue;
        }
        let error_rate = wrap(next.auvs[0].path_error().psi_e - error.psi_e) / PERIOD;
        let right_hand_side = auv.heading_rate() - curvature * auv.horizontal_speed();
        if curvature != 0.0 && error.psi_e.abs() < 1e-3 && right_hand_side.abs() < 1e-4 {
            on_arc += 1;
            assert!((error_rate - right_hand_side).abs() < 2e-3);
            assert!((psi_rate - right_hand_side).abs() > 0.01, "printed: the heading would stand still");
        }
    }
    assert!(on_arc > 100, "{on_arc}");
}

fn lyapunov(error: &PathError) -> f64 {
    let psi_tilde = error.psi_e - GAINS.approach_angle(error.y_1);
    0.5 * (error.s_1.powi(2) + error.y_1.powi(2)) + psi_tilde.powi(2) / (2.0 * GAINS.k_2)
}

/// dV₁/dt of the project's closed loop by a finite difference, the initial error, and dψ̃/dt.
fn lyapunov_rate(path: &Path, start: Ideal) -> (f64, PathError, f64) {
    let h = 1e-5;
    let mut end = start;
    end.follow(path, h, projects);
    let (before, after) = (start.error(path), end.error(path));
    let psi_tilde = |error: &PathError| error.psi_e - GAINS.approach_angle(error.y_1);
    ((lyapunov(&after) - lyapunov(&before)) / h, before, (psi_tilde(&after) - psi_tilde(&before)) / h)
}

fn off_a_curved_path() -> (Path, Ideal) {
    let path = Path::starting_at(Vector2::zeros(), 0.0).arc(Side::Starboard, 10.0, PI);
    (path, Ideal { position: Vector2::new(6.0, 1.0), psi: -0.5, gamma: 5.0 })
}

#[test]
fn eq_26_the_heading_term_of_the_lyapunov_rate_adds() {
    let (path, start) = off_a_curved_path();
    let (rate, error, psi_tilde_rate) = lyapunov_rate(&path, start);
    let psi_tilde = error.psi_e - GAINS.approach_angle(error.y_1);
    let command = projects(&error, &path.at(start.gamma), start.psi);
    let position_part =
        error.s_1 * (U_H * error.psi_e.cos() - command.point_speed) + error.y_1 * U_H * error.psi_e.sin();
    let heading_part = psi_tilde * psi_tilde_rate / GAINS.k_2;
    // First-order difference: error of the size of the step.
    assert!((rate - (position_part + heading_part)).abs() < 1e-3);
    assert!((rate - (position_part - heading_part)).abs() > 0.1, "printed");
    // The effect of the sign, eq. (29): −k₃ s₁² + y₁ u sin δ − (k₁/k₂) ψ̃².
    let closed_form = -GAINS.k_3 * error.s_1.powi(2)
        + error.y_1 * U_H * GAINS.approach_angle(error.y_1).sin()
        - GAINS.k_1 / GAINS.k_2 * psi_tilde.powi(2);
    assert!((rate - closed_form).abs() < 1e-3 && rate < 0.0);
}

#[test]
fn eq_27_the_term_outside_is_the_approach_s_else_the_drift_counts_twice() {
    let (path, start) = off_a_curved_path();
    let (rate, error, psi_tilde_rate) = lyapunov_rate(&path, start);
    let delta = GAINS.approach_angle(error.y_1);
    let command = projects(&error, &path.at(start.gamma), start.psi);
    let along = error.s_1 * (U_H * error.psi_e.cos() - command.point_speed);
    let bracket = (error.psi_e - delta) / GAINS.k_2
        * (psi_tilde_rate + GAINS.k_2 * error.y_1 * U_H * sine_quotient(error.psi_e, delta));
    let outside = |angle: f64| error.y_1 * U_H * f64::sin(angle);
    assert!((rate - (along + outside(delta) + bracket)).abs() < 1e-3);
    assert!((rate - (along + outside(error.psi_e) + bracket)).abs() > 0.1, "printed");
}

#[test]
fn eq_28_the_point_s_speed_does_not_depend_on_north() {
    let printed = |error: &PathError, point: &PathPoint, psi: f64| PathCommand {
        point_speed: U_H * psi.cos() + GAINS.k_3 * error.s_1,
        ..projects(error, point, psi)
    };
    let trailing = |law: &dyn Fn(&PathError, &PathPoint, f64) -> PathCommand, tangent: f64| {
        let path = straight(tangent);
        beside(tangent, 0.5).after(&path, 150, law).error(&path).s_1
    };
    // Northward the two agree; southward the printed point lets the vehicle run 2 u/k₃ ahead of it.
    assert!(trailing(&printed, 0.0).abs() < 1e-3);
    assert!((trailing(&printed, PI) - 2.0 * U_H / GAINS.k_3).abs() < 1e-2);
    for tangent in [0.0, 1.0, PI] {
        assert!(trailing(&projects, tangent).abs() < 1e-3);
    }
}

#[test]
fn eq_28_and_31_the_quotient_has_a_limit_at_the_printed_zero_by_zero() {
    let delta = GAINS.approach_angle(0.5);
    let printed = (delta.sin() - delta.sin()) / (delta - delta);
    assert!(printed.is_nan());
    assert!((sine_quotient(delta, delta) - delta.cos()).abs() < 1e-15);
    let error = PathError { s_1: 0.0, y_1: 0.5, psi_e: delta };
    assert!(follow_path(&error, 0.0, U_H, &GAINS).heading_rate.is_finite());
}

#[test]
fn eq_32_the_two_cases_define_no_pitch_between_them() {
    let dive = Dive::paper();
    let printed = |z: f64| match z {
        z if z <= dive.depth_min => Some(-dive.pitch),
        z if z >= dive.depth_max => Some(dive.pitch),
        _ => None,
    };
    assert_eq!(printed(12.0), None);
    assert_eq!(Leg::Down.next(12.0, &dive).pitch(&dive), -dive.pitch);
    assert_eq!(Leg::Up.next(12.0, &dive).pitch(&dive), dive.pitch);

    // The nearer case, without memory, makes the vehicle hover between the two.
    let memoryless = |z: f64| if z < 12.0 { -dive.pitch } else { dive.pitch };
    let mut depth = Vector1::new(1.0);
    let mut deepest: f64 = 0.0;
    for _ in 0..4000 {
        depth.x -= 0.3 * f64::sin(memoryless(depth.x)) * PERIOD;
        deepest = deepest.max(depth.x);
    }
    assert!(deepest < 12.1);
    let mut world = settled_world(1);
    let depths = (0..4000).map(|_| {
        world.step(None);
        world.auvs[0].depth()
    });
    assert!(depths.fold(0.0, f64::max) > 23.0);
}
