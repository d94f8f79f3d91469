//! Path following and sawtooth in closed loop.

use std::f64::consts::{PI, TAU};

use pilotfish_sim::metrics::Metrics;
use pilotfish_sim::path_following::{PathFollowingGains, sine_quotient};
use pilotfish_sim::scenario::{CurrentFile, Quantity};
use pilotfish_sim::world::World;
use planner::angle::direction;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{flown_by, los, named, near, parsed, step_until, world};

#[test]
fn path_following_reproduces_the_paper() {
    for seed in 0..5 {
        // A mission without a surface craft never calls its guide.
        let metrics = Metrics::of(&flown_by(&named("paper-path-following"), &mut los(), seed));
        assert!(metrics.surface_craft.is_none());
        let auv = &metrics.auvs[0];
        // Figs. 3 to 6: cross-track ±1.2 m, position error under 1 m, 1–23 m, ±50°, 0.3 m/s. The
        // pitch loop overshoots by less than one degree.
        for (found, range) in [
            (auv.cross_track_max_m, 0.0..=1.2),
            (auv.position_error_max_m, 0.0..=0.999),
            (auv.depth_min_m, 0.4..=1.0),
            (auv.depth_max_m, 23.0..=23.6),
            (auv.pitch_min_rad.to_degrees(), -51.0..=-50.0),
            (auv.pitch_max_rad.to_degrees(), 50.0..=51.0),
        ] {
            assert!(range.contains(&found), "{found} is not in {range:?}");
        }
        near(auv.surge_mean_mps, 0.3, 1e-3);
    }
}

/// One vehicle at `north`, `east` and `turned` relative to the beginning of `path`.
fn alone_on(path: &str, [north, east, turned]: [f64; 3]) -> World {
    let text = format!(
        r#"
        schema_version = "1"
        name = "alone"
        title = "one vehicle"
        duration_s = 1
        settled_after_s = 0
        [[auvs]]
        id = "auv-1"
        north_of_path_m = {north}
        east_of_path_m = {east}
        heading_off_path_rad = {turned}
        path.{path}
        "#
    );
    world(&parsed(&text), 0)
}

#[test]
fn a_vehicle_reaches_its_path_from_any_start_and_stays_on_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for path in [
        "segments = {segments = [{line = {from = [0, 0], to = [1000, 0]}}]}",
        r#"circle = {centre = [0, 0], radius_m = 25, turn = "starboard"}"#,
        r#"circle = {centre = [0, 0], radius_m = 25, turn = "port"}"#,
    ] {
        for _ in 0..100 {
            let (distance, bearing) = (30.0 * rng.random::<f64>().sqrt(), TAU * rng.random::<f64>());
            let off = direction(bearing) * distance;
            let mut world = alone_on(path, [off.x, off.y, TAU * rng.random::<f64>() - PI]);
            let off = |world: &World| {
                let error = world.auvs[0].path_error();
                error.s_1.hypot(error.y_1)
            };
            step_until(&mut world, 600.0);
            while world.time() < 900.0 {
                assert!(off(&world) < 1.0, "{path}: {off:.1} m after 600 s", off = off(&world));
                world.step(None);
            }
            assert!(off(&world) < 0.05, "{path}: {} m", off(&world));
        }
    }
}

/// Times at which the first vehicle's leg changes, s.
fn turning_times(world: &mut World, duration: f64) -> Vec<f64> {
    let mut turns = vec![];
    while world.time() < duration {
        let leg = world.auvs[0].leg;
        world.step(None);
        if world.auvs[0].leg != leg {
            turns.push(world.time());
        }
    }
    turns
}

#[test]
fn a_dive_cycle_takes_two_straight_legs_and_two_reversals() {
    let turns = turning_times(&mut world(&named("paper-path-following"), 1), 1000.0);
    // 22 m down and 22 m up at 0.3 m/s · sin 50°, 191 s, and two reversals of 4 s.
    let legs = 2.0 * 22.0 / (0.3 * 50_f64.to_radians().sin());
    near((turns[3] - turns[1]) / (legs + 2.0 * 4.0), 1.0, 0.03);
}

/// The offset at which the law's heading rate is 0 while the vehicle crabs against a current of
/// `across` m/s: −k₁ ψ̃ − k₂ y₁ u_h q + δ̇ = 0 with ψ_e = −asin(v/u_h), by bisection.
fn steady_offset(across: f64, u_h: f64) -> f64 {
    let gains = PathFollowingGains::LAB;
    let psi_e = -(across / u_h).asin();
    let residual = |y_1: f64| {
        let delta = -gains.theta_a * (gains.k_delta * y_1).tanh();
        let slope = -gains.theta_a * gains.k_delta / (gains.k_delta * y_1).cosh().powi(2);
        -gains.k_1 * (psi_e - delta) - gains.k_2 * y_1 * u_h * sine_quotient(psi_e, delta)
            + slope * u_h * psi_e.sin()
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
fn a_vehicle_in_a_cross_current_settles_at_the_predicted_offset() {
    let u_h = 0.3 * 50_f64.to_radians().cos();
    let mut scenario = named("paper-path-following");
    scenario.water.current =
        Some(CurrentFile::Constant { north_mps: Quantity::fixed(0.0), east_mps: Quantity::fixed(0.1) });
    let mut world = world(&scenario, 1);
    // Straight on the first lane, 85 s into a leg: the reversal's oscillation has decayed.
    let turned = turning_times(&mut world, 290.0);
    let since = 290.0 - turned.last().expect("has turned");
    assert!((60.0..95.0).contains(&since), "{since}");
    let auv = &world.auvs[0];
    assert_eq!(auv.path.at(auv.gamma).curvature, 0.0);
    let error = auv.path_error();
    // As documented, 0.84 m.
    near(steady_offset(0.1, u_h), 0.84, 0.01);
    near(error.y_1, steady_offset(0.1, u_h), 0.01);
    near(error.psi_e, -(0.1 / u_h).asin(), 0.01);
}
