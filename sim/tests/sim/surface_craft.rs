//! Surface hulls and thrusters: balance, energy, accuracy of the integration step.

use nalgebra::Vector2;
use pilotfish_sim::{
    inner_loop::PERIOD,
    integrate::rk4,
    surface_craft::{SurfaceClass, SurfaceHull, SurfaceInput, SurfaceState, Thrust, ThrusterHealth},
};

use crate::{near, near_to};

const CLASSES: [SurfaceClass; 2] = [SurfaceClass::Medusa, SurfaceClass::Otter];

fn calm() -> Vector2<f64> {
    Vector2::zeros()
}

/// State after `n` steps of `step` s in still water without waves, with `steady` thrust.
fn run(hull: &SurfaceHull, start: SurfaceState, steady: Thrust, step: f64, n: u32) -> SurfaceState {
    (0..n).fold(start, |state, _| {
        rk4(&state, step, |x| hull.derivative(x, steady, SurfaceInput::default(), &calm()))
    })
}

fn both(thrust: f64) -> Thrust {
    Thrust { port: thrust, starboard: thrust }
}

#[test]
fn the_otter_reaches_six_knots_ahead_and_its_proportion_astern() {
    let hull = SurfaceHull::OTTER;
    let [ahead, astern] = [1e3, -1e3].map(|command| {
        let steady = hull.thrusters.steady(both(command), ThrusterHealth::SOUND);
        run(&hull, SurfaceState::zeros(), steady, PERIOD, 600)[3]
    });
    near(ahead, 6.0 * 1852.0 / 3600.0, 1e-3);
    // Linear drag: speeds go as the bollard pulls, 13.6 to 24.4.
    near(astern / ahead, -13.6 / 24.4, 1e-9);
}

#[test]
fn the_otter_s_derived_figures_match_the_published_code() {
    // `otter.py` has 41.4 kg m² of yaw inertia with added mass; 77.6 N/(m/s) follow by hand.
    let hull = SurfaceHull::OTTER;
    near(hull.inertia_yaw, 41.4, 0.05);
    near(hull.drag_surge.linear, 77.6, 0.05);
    assert_eq!((hull.mass_surge, hull.mass_sway), (85.5, 162.5));
}

/// Power of the thrusters on hull and water, W: τ_u u + τ_r r.
fn thrust_power(hull: &SurfaceHull, state: &SurfaceState) -> f64 {
    let propulsion = hull.thrusters.force(Thrust { port: state[6], starboard: state[7] });
    propulsion.surge_force * state[3] + propulsion.yaw_moment * state[5]
}

/// The Coriolis terms do no work in any motion.
#[test]
fn the_thrusters_work_in_a_turn_becomes_motion_and_heat() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let steady =
            Thrust { port: 0.8 * hull.thrusters.ahead_max, starboard: 0.2 * hull.thrusters.ahead_max };
        let lost = |state: &SurfaceState| {
            hull.drag_surge.resistance(state[3]) * state[3]
                + hull.drag_sway.resistance(state[4]) * state[4]
                + hull.drag_yaw.resistance(state[5]) * state[5]
        };
        let (step, mut state) = (0.005, hull.cruising(&calm(), 0.0, 0.5));
        let masses = [hull.mass_surge, hull.mass_sway, hull.inertia_yaw];
        let energy = |state: &SurfaceState| {
            masses.iter().zip(&state.as_slice()[3..6]).map(|(mass, v)| 0.5 * mass * v * v).sum::<f64>()
        };
        let start = energy(&state);
        let (mut fed, mut heat) = (0.0, 0.0);
        for _ in 0..4000 {
            let after = run(&hull, state, steady, step, 1);
            fed += 0.5 * step * (thrust_power(&hull, &state) + thrust_power(&hull, &after));
            heat += 0.5 * step * (lost(&state) + lost(&after));
            state = after;
        }
        let gained = energy(&state) - start;
        assert!(gained.abs() > 1.0 && fed > 100.0);
        // The trapezium's error is h²/12 times the change of the power's slope: some 1e-4 J.
        near(fed - heat, gained, 1e-5 * fed);
    }
}

#[test]
fn straight_ahead_the_propulsion_power_is_drag_times_speed() {
    let hull = SurfaceHull::MEDUSA;
    for speed in [0.3_f64, 0.7, 1.5] {
        let cruising = hull.cruising(&calm(), 0.4, speed);
        near(hull.propulsion_power(&cruising), 27.5 * speed.powi(3), 1e-12);
        near(thrust_power(&hull, &cruising), 27.5 * speed.powi(3), 1e-12);
        let slope = hull.derivative(&cruising, both(cruising[6]), SurfaceInput::default(), &calm());
        near(slope[3], 0.0, 1e-12);
    }
    // Turning on the spot: both thrusters work, though the force ahead is nil.
    let spinning = SurfaceState::from([0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 10.0, -10.0]);
    near(hull.propulsion_power(&spinning), 2.0 * 10.0 * 0.15 * 0.4, 1e-12);
}

#[test]
fn thrust_grows_exponentially_with_its_lag() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let lag = hull.thrusters.lag;
        let target = 0.5 * hull.thrusters.ahead_max;
        let thrust = |step, n| run(&hull, SurfaceState::zeros(), both(target), step, n)[6];
        for n in [1_u32, 4, 10, 20] {
            let exact = target * (1.0 - (-0.25 * f64::from(n)).exp());
            // Each step errs by (h/τ)⁵/120 = 8e-6 of the step; four of these have not yet decayed.
            near(thrust(0.25 * lag, n), exact, 4e-5 * target);
        }
        // At the simulator's own step, h = τ, the worst is (1/0! − 1/1! + … + 1/4!) − 1/e = 0.7 %.
        near(thrust(PERIOD, 1) / target, 1.0 - (-PERIOD / lag).exp(), 0.01);
    }
}

#[test]
fn waves_push_the_craft_as_its_thrusters_would() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let (port, starboard) = (3.0, -1.0);
        let push = hull.thrusters.force(Thrust { port, starboard });
        let still = SurfaceState::zeros();
        let mut thrusting = still;
        (thrusting[6], thrusting[7]) = (port, starboard);
        let pushed = hull.derivative(&still, Thrust::default(), push, &calm());
        let driven = hull.derivative(&thrusting, Thrust::default(), SurfaceInput::default(), &calm());
        assert!((pushed - driven).fixed_rows::<6>(0).norm() < 1e-12);
    }
}

#[test]
fn steps_of_a_tenth_of_a_second_are_accurate() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let turn = Thrust { port: 0.9 * hull.thrusters.ahead_max, starboard: 0.1 * hull.thrusters.ahead_max };
        let after =
            |step, n| run(&hull, SurfaceState::zeros(), turn, step, n).fixed_rows::<2>(0).into_owned();
        // Tracking to centimetres forgives a millimetre in 30 s of hard turning from rest.
        near_to(after(PERIOD, 300), after(PERIOD / 16.0, 4800), 1e-3);
    }
}

#[test]
fn only_the_published_cancellation_keeps_the_otter_straight() {
    // Second route: the sway-yaw block (at no velocity the quadratic terms vanish) is stable if its
    // determinant is positive: Y N − (c_u u)(c_v − c_u) u > 0.
    let otter = SurfaceHull::OTTER;
    let determinant = |c_u: f64, c_v: f64, u: f64| {
        otter.drag_sway.linear * otter.drag_yaw.linear - c_u * (c_v - c_u) * u * u
    };
    assert!(determinant(otter.mass_surge, otter.mass_sway, 1.0) > 0.0);
    assert!(determinant(otter.mass_surge, otter.mass_sway, 1.1) < 0.0);
    assert!(determinant(otter.coriolis.surge, otter.coriolis.sway, 3.0) > 0.0);
    let mut start = otter.cruising(&calm(), 0.0, 3.0);
    start[5] = 1e-3;
    let end = run(&otter, start, both(start[6]), PERIOD, 300);
    assert!(end[5].abs() < 1e-9, "a nudge dies out: {}", end[5]);
}
