//! Surface hulls and thrusters: balance, energy, accuracy of the integration step.

use nalgebra::{Vector2, Vector3};
use pilotfish_sim::{
    inner_loop::PERIOD,
    integrate::rk4,
    surface_craft::{
        SurfaceClass, SurfaceHull, SurfaceInput, SurfaceState, Thrust, ThrusterHealth, Thrusters,
    },
};

const CLASSES: [SurfaceClass; 2] = [SurfaceClass::Medusa, SurfaceClass::Otter];

fn calm() -> Vector2<f64> {
    Vector2::zeros()
}

/// State after `n` steps of `step` s in still water without waves, with `steady` thrust.
fn run(hull: &SurfaceHull, start: SurfaceState, steady: Thrust, step: f64, n: u32) -> SurfaceState {
    (0..n).fold(start, |state, _| {
        rk4(&state, step, |x| {
            hull.derivative(x, steady, SurfaceInput::default(), &calm())
        })
    })
}

fn both(thrust: f64) -> Thrust {
    Thrust {
        port: thrust,
        starboard: thrust,
    }
}

#[test]
fn steady_speeds_follow_from_the_balance_of_thrust_and_drag() {
    let hull = SurfaceHull::MEDUSA;
    for (force, published) in [(14.0_f64, 0.714), (15.0, 0.739), (60.0, 1.477)] {
        let closed_form = (force / 27.5).sqrt();
        let end = run(&hull, SurfaceState::zeros(), both(0.5 * force), PERIOD, 3000);
        assert!((closed_form - published).abs() < 5e-4, "{closed_form}");
        // Five minutes are over thirty time constants m_u / (2 d₂ u) at the lowest of these speeds.
        assert!((end[3] - closed_form).abs() < 1e-9, "{force} N gave {}", end[3]);
    }
}

#[test]
fn the_otter_reaches_six_knots_ahead_and_its_proportion_astern() {
    let hull = SurfaceHull::OTTER;
    let steady = |command| hull.thrusters.steady(both(command), ThrusterHealth::SOUND);
    let ahead = run(&hull, SurfaceState::zeros(), steady(1e3), PERIOD, 600)[3];
    let astern = run(&hull, SurfaceState::zeros(), steady(-1e3), PERIOD, 600)[3];
    println!("Otter: {ahead:.3} m/s ahead, {astern:.3} m/s astern");
    assert!((ahead - 6.0 * 1852.0 / 3600.0).abs() < 1e-3, "{ahead}");
    // Linear drag: speeds go as the bollard pulls, 13.6 to 24.4.
    assert!((astern / ahead + 13.6 / 24.4).abs() < 1e-9, "{astern}");
}

#[test]
fn the_otter_s_derived_figures_match_the_published_code() {
    // `otter.py` has 41.4 kg m² of yaw inertia with added mass; 77.6 N/(m/s) follow by hand.
    let hull = SurfaceHull::OTTER;
    assert!((hull.inertia_yaw - 41.4).abs() < 0.05, "{}", hull.inertia_yaw);
    assert!((hull.drag_surge.linear - 77.6).abs() < 0.05);
    assert_eq!((hull.mass_surge, hull.mass_sway), (85.5, 162.5));
}

#[test]
fn power_becomes_motion_and_drag_alone() {
    // d/dt ½ νᵀMν = τᵀν − νᵀD(ν): the Coriolis terms do no work in any motion.
    for hull in CLASSES.map(SurfaceClass::hull) {
        for velocity in [Vector3::new(1.2, -0.3, 0.8), Vector3::new(-0.4, 0.2, -1.1)] {
            let input = SurfaceInput {
                surge_force: 11.0,
                yaw_moment: -2.0,
            };
            let slope = hull.acceleration(&velocity, input);
            let stored = hull.mass_surge * velocity.x * slope.x
                + hull.mass_sway * velocity.y * slope.y
                + hull.inertia_yaw * velocity.z * slope.z;
            let fed = input.surge_force * velocity.x + input.yaw_moment * velocity.z;
            let lost = hull.drag_surge.resistance(velocity.x) * velocity.x
                + hull.drag_sway.resistance(velocity.y) * velocity.y
                + hull.drag_yaw.resistance(velocity.z) * velocity.z;
            // Rounding of terms of up to a few hundred watts.
            assert!((stored - (fed - lost)).abs() < 1e-11);
        }
    }
}

#[test]
fn the_thrusters_work_in_a_turn_becomes_motion_and_heat() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let steady = Thrust {
            port: 0.8 * hull.thrusters.ahead_max,
            starboard: 0.2 * hull.thrusters.ahead_max,
        };
        let lost = |state: &SurfaceState| {
            hull.drag_surge.resistance(state[3]) * state[3]
                + hull.drag_sway.resistance(state[4]) * state[4]
                + hull.drag_yaw.resistance(state[5]) * state[5]
        };
        let (step, mut state) = (0.005, hull.cruising(&calm(), 0.0, 0.5));
        let velocity = |state: &SurfaceState| state.fixed_rows::<3>(3).into_owned();
        let start = hull.kinetic_energy(&velocity(&state));
        let (mut fed, mut heat) = (0.0, 0.0);
        for _ in 0..4000 {
            let after = run(&hull, state, steady, step, 1);
            fed += 0.5 * step * (hull.thrust_power(&state) + hull.thrust_power(&after));
            heat += 0.5 * step * (lost(&state) + lost(&after));
            state = after;
        }
        let gained = hull.kinetic_energy(&velocity(&state)) - start;
        println!("turn: {fed:.1} J fed, {heat:.1} J of heat, {gained:.1} J gained");
        assert!(gained.abs() > 1.0 && fed > 100.0);
        // The trapezium's error is h²/12 times the change of the power's slope: some 1e-4 J.
        assert!(
            (fed - heat - gained).abs() < 1e-5 * fed,
            "{}",
            fed - heat - gained
        );
    }
}

#[test]
fn straight_ahead_the_propulsion_power_is_drag_times_speed() {
    let hull = SurfaceHull::MEDUSA;
    for speed in [0.3_f64, 0.7, 1.5] {
        let cruising = hull.cruising(&calm(), 0.4, speed);
        assert!((hull.propulsion_power(&cruising) - 27.5 * speed.powi(3)).abs() < 1e-12);
        assert!((hull.thrust_power(&cruising) - 27.5 * speed.powi(3)).abs() < 1e-12);
        assert!(
            hull.derivative(&cruising, both(cruising[6]), SurfaceInput::default(), &calm())[3].abs() < 1e-12
        );
    }
    // Turning on the spot: both thrusters work, though the force ahead is nil.
    let spinning = SurfaceState::from([0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 10.0, -10.0]);
    assert!((hull.propulsion_power(&spinning) - 2.0 * 10.0 * 0.15 * 0.4).abs() < 1e-12);
}

#[test]
fn thrust_grows_exponentially_with_its_lag() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let lag = hull.thrusters.lag;
        let target = 0.5 * hull.thrusters.ahead_max;
        for n in [1_u32, 4, 10, 20] {
            let exact = target * (1.0 - (-0.25 * f64::from(n)).exp());
            let end = run(&hull, SurfaceState::zeros(), both(target), 0.25 * lag, n);
            // Each step errs by (h/τ)⁵/120 = 8e-6 of the step; four of these have not yet decayed.
            assert!((end[6] - exact).abs() < 4e-5 * target, "{n}: {}", end[6]);
        }
        // At the simulator's own step, h = τ, the worst is (1/0! − 1/1! + … + 1/4!) − 1/e = 0.7 %.
        let coarse = run(&hull, SurfaceState::zeros(), both(target), PERIOD, 1)[6];
        assert!((coarse / target - (1.0 - (-PERIOD / lag).exp())).abs() < 0.01);
    }
}

#[test]
fn waves_push_the_craft_as_its_thrusters_would() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let push = hull.thrusters.force(Thrust {
            port: 3.0,
            starboard: -1.0,
        });
        let still = SurfaceState::zeros();
        let mut thrusting = still;
        (thrusting[6], thrusting[7]) = (3.0, -1.0);
        let pushed = hull.derivative(&still, Thrust::default(), push, &calm());
        let driven = hull.derivative(&thrusting, Thrust::default(), SurfaceInput::default(), &calm());
        assert!((pushed - driven).fixed_rows::<6>(0).norm() < 1e-12);
    }
}

/// A gentle turn to starboard at growing speed without a change of sign: |v| v is smooth there.
fn smooth_turn(hull: &SurfaceHull, step: f64, n: u32) -> SurfaceState {
    let thrust = 0.4 * hull.thrusters.ahead_max;
    let mut start = hull.cruising(&calm(), 0.3, 0.5);
    (start[4], start[5]) = (-0.05, 0.1);
    let steady = Thrust {
        port: thrust,
        starboard: 0.6 * thrust,
    };
    run(hull, start, steady, step, n)
}

#[test]
fn halving_the_step_divides_the_hull_s_error_by_sixteen() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        // The stiffness of the simulator's lag hides the order at coarse steps: five times the lag
        // leaves the same equations.
        let hull = SurfaceHull {
            thrusters: Thrusters {
                lag: 0.5,
                ..hull.thrusters
            },
            ..hull
        };
        let exact = smooth_turn(&hull, 0.05 / 64.0, 12_800);
        let error = |step, n| (smooth_turn(&hull, step, n) - exact).norm();
        let (coarse, fine) = (error(0.05, 200), error(0.025, 400));
        println!("RK4: {coarse:.2e} and {fine:.2e}, ratio {:.2}", coarse / fine);
        // 2⁴ up to the next order's share, about h/τ = 0.1 of it.
        assert!((coarse / fine - 16.0).abs() < 2.0, "ratio {}", coarse / fine);
    }
}

#[test]
fn steps_of_a_tenth_of_a_second_are_accurate() {
    for hull in CLASSES.map(SurfaceClass::hull) {
        let turn = Thrust {
            port: 0.9 * hull.thrusters.ahead_max,
            starboard: 0.1 * hull.thrusters.ahead_max,
        };
        let still = SurfaceState::zeros();
        let difference = run(&hull, still, turn, PERIOD, 300) - run(&hull, still, turn, PERIOD / 16.0, 4800);
        let off = difference.fixed_rows::<2>(0).norm();
        println!("30 s of hard turning from rest: {off:.1e} m off");
        // A millimetre does not matter for tracking to centimetres.
        assert!(off < 1e-3, "{off}");
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
