//! Path following and the sawtooth, closed loop.

use nalgebra::Vector2;
use planner::los::LosGains;
use sim::{
    guide::LosGuide,
    inner_loop::PERIOD,
    metrics::Metrics,
    mission::run,
    path_following::{PathFollowingGains, sine_quotient},
    record::Record,
    scenario::Scenario,
    world::World,
};

/// A mission without a surface craft never asks its guide.
fn record_of(scenario: &Scenario, seed: u64) -> Record {
    let mut idle = LosGuide::new(LosGains {
        look_ahead: 10.0,
        along_track_gain: 0.1,
    });
    run(scenario, &mut idle, seed, &mut |_| {}).expect("nothing can fail without a guide")
}

#[test]
fn the_paper_s_path_following_is_reproduced() {
    for seed in 0..5 {
        let metrics = Metrics::of(&record_of(
            &Scenario::named("paper-path-following").expect("exists"),
            seed,
        ));
        assert!(metrics.surface_craft.is_none());
        let auv = &metrics.divers[0];
        println!("seed {seed}: {auv:?}");
        // Figs. 3 to 6 of the paper: cross-track ±1.2 m, position error under 1 m, 1–23 m, ±50°, 0.3 m/s.
        assert!(auv.cross_track_max_m <= 1.2);
        assert!(auv.position_error_max_m < 1.0);
        assert!((0.4..=1.0).contains(&auv.depth_min_m) && (23.0..=23.6).contains(&auv.depth_max_m));
        // The pitch loop overshoots by less than one degree.
        assert!((-51.0..=-50.0).contains(&auv.pitch_min_rad.to_degrees()));
        assert!((50.0..=51.0).contains(&auv.pitch_max_rad.to_degrees()));
        assert!((auv.surge_mean_mps - 0.3).abs() < 1e-3);
    }
}

#[test]
fn a_vehicle_off_its_path_converges_to_it() {
    let mut scenario = Scenario::named("paper-path-following").expect("exists");
    scenario.divers[0].offset = Vector2::new(-10.0, 25.0);
    let mut world = scenario.world(2);
    assert!(world.divers[0].path_error().y_1.abs() > 20.0);
    // A straight approach at θ_a and the slowest horizontal speed: 26 m / (0.193 m/s · sin 0.8) = 188 s.
    for _ in 0..3000 {
        world.step(None);
    }
    let error = world.divers[0].path_error();
    assert!(error.s_1.hypot(error.y_1) < 0.05, "{error:?}");
}

/// Times at which the first vehicle's leg changes, s.
fn turning_times(world: &mut World, duration: f64) -> Vec<f64> {
    let mut turns = vec![];
    let mut time = 0.0;
    while time < duration {
        let leg = world.divers[0].leg;
        world.step(None);
        time += PERIOD;
        if world.divers[0].leg != leg {
            turns.push(time);
        }
    }
    turns
}

#[test]
fn a_dive_cycle_lasts_its_straight_legs_and_two_reversals() {
    let scenario = Scenario::named("paper-path-following").expect("exists");
    let turns = turning_times(&mut scenario.world(1), 1000.0);
    let cycle = turns[3] - turns[1];
    // 22 m down and 22 m up at 0.3 m/s · sin 50°, and two reversals of 4 s.
    let legs = 2.0 * 22.0 / (0.3 * 50_f64.to_radians().sin());
    let expected = legs + 2.0 * 4.0;
    println!("cycle {cycle:.1} s, straight legs {legs:.1} s");
    assert!((legs - 191.0).abs() < 1.0);
    assert!(
        (cycle / expected - 1.0).abs() < 0.03,
        "{cycle} against {expected}"
    );
}

/// The offset at which the law's heading rate vanishes while a current of `across` m/s is held off by
/// crabbing: −k₁ ψ̃ − k₂ y₁ u_h q + δ̇ = 0 with ψ_e = −asin(v/u_h), by bisection.
fn steady_offset(across: f64, u_h: f64, current_in_delta_rate: bool) -> f64 {
    let gains = PathFollowingGains::LAB;
    let psi_e = -(across / u_h).asin();
    let residual = |y_1: f64| {
        let delta = -gains.theta_a * (gains.k_delta * y_1).tanh();
        let slope = -gains.theta_a * gains.k_delta / (gains.k_delta * y_1).cosh().powi(2);
        let cross_track_rate = if current_in_delta_rate {
            0.0
        } else {
            u_h * psi_e.sin()
        };
        -gains.k_1 * (psi_e - delta) - gains.k_2 * y_1 * u_h * sine_quotient(psi_e, delta)
            + slope * cross_track_rate
    };
    let (mut low, mut high) = (0.0, 5.0);
    assert!(residual(low) > 0.0 && residual(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if residual(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[test]
fn in_a_cross_current_the_vehicle_settles_at_the_predicted_offset() {
    let u_h = 0.3 * 50_f64.to_radians().cos();
    println!(
        "{} {}",
        steady_offset(0.1, u_h, true),
        steady_offset(0.1, u_h, false)
    );
    assert!((steady_offset(0.1, u_h, true) - 0.75).abs() < 0.01);
    assert!((steady_offset(0.1, u_h, false) - 0.84).abs() < 0.01);

    let mut scenario = Scenario::named("paper-path-following").expect("exists");
    scenario.current = Vector2::new(0.0, 0.1);
    let mut world = scenario.world(1);
    // Straight on the first lane, 85 s into a leg: the reversal's swing has died out.
    let turned = turning_times(&mut world, 290.0);
    let since = 290.0 - turned.last().expect("has turned");
    assert!((60.0..95.0).contains(&since), "{since}");
    let diver = &world.divers[0];
    assert_eq!(diver.path.at(diver.gamma).curvature, 0.0);
    let error = diver.path_error();
    assert!(
        (error.y_1 - steady_offset(0.1, u_h, false)).abs() < 0.01,
        "{error:?}"
    );
    assert!((error.psi_e + (0.1 / u_h).asin()).abs() < 0.01, "{error:?}");
}
