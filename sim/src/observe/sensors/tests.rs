use std::f64::consts::PI;

use rand::SeedableRng;

use super::*;
use crate::tests::{independent_unit_normals, near, near_to};
use crate::world::{hull::SurfaceHull, inner_loop::SurfaceAutopilot};

/// Time between measurements, s.
const PERIOD: f64 = 1.0;
const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

/// Perfect sensors with other numbers.
fn changed(change: impl FnOnce(&mut SensorSetup)) -> SensorSetup {
    let mut setup = SensorSetup::default();
    change(&mut setup);
    setup
}

fn sensors(setup: SensorSetup, seed: u64) -> SurfaceSensors {
    SurfaceSensors::new(setup, ChaCha8Rng::seed_from_u64(seed))
}

fn craft(position: Vector2<f64>, heading: f64, speed: f64) -> SurfaceCraft {
    SurfaceCraft::cruising(SurfaceHull::MEDUSA, SurfaceAutopilot::MEDUSA, &position, heading, speed)
}

/// A craft of 1 m/s through the water along `heading`.
fn under_way(position: Vector2<f64>, heading: f64) -> SurfaceCraft {
    craft(position, heading, 1.0)
}

fn at_rest() -> SurfaceCraft {
    craft(Vector2::zeros(), 0.0, 0.0)
}

/// Error of the reckoned position (north, east) after one measurement with GNSS and `n` without,
/// while the craft moves straight on with `current`.
fn drift(mut sensors: SurfaceSensors, heading: f64, current: Vector2<f64>, n: u32) -> Vector2<f64> {
    let mut craft = under_way(Vector2::new(5.0, -3.0), heading);
    sensors.measure(&craft, &current, true, PERIOD);
    drift_on(&mut sensors, &mut craft, &current, n)
}

fn drift_on(
    sensors: &mut SurfaceSensors,
    craft: &mut SurfaceCraft,
    current: &Vector2<f64>,
    n: u32,
) -> Vector2<f64> {
    let mut off = Vector2::zeros();
    for _ in 0..n {
        let moved = craft.position() + (craft.water_velocity() + current) * PERIOD;
        (craft.state[0], craft.state[1]) = (moved.x, moved.y);
        let seen = sensors.measure(craft, current, false, PERIOD);
        assert_eq!(seen.ground_velocity(), None);
        off = seen.position() - craft.position();
    }
    off
}

#[test]
fn perfect_sensors_give_the_truth_to_the_bit() {
    let mut sensors = sensors(SensorSetup::default(), 1);
    let mut craft = craft(Vector2::new(-0.0, 1.0 / 3.0), -2.0, 0.1 + 0.2);
    (craft.state[4], craft.state[5]) = (-0.0, -1e-300);
    let current = Vector2::new(-0.0, 7.1);
    for _ in 0..3 {
        let seen = sensors.measure(&craft, &current, true, PERIOD);
        let ground = seen.ground_velocity().expect("there are satellites");
        let bits = |v: Vector2<f64>| [v.x.to_bits(), v.y.to_bits()];
        assert_eq!(bits(seen.position()), bits(craft.position()));
        let through_water = planner::angle::ned_from_body(-2.0) * Vector2::new(0.1 + 0.2, -0.0);
        assert_eq!(bits(ground), bits(through_water + current));
        let seen = [seen.heading().radians(), seen.speed_mps, seen.sway_mps, seen.yaw_rate_radps];
        assert_eq!(seen.map(f64::to_bits), [-2.0, 0.1 + 0.2, -0.0, -1e-300].map(f64::to_bits));
    }
}

#[test]
fn the_satellite_error_keeps_its_variance_and_correlation_time() {
    let (sigma, n) = (2.0, 200_000);
    // Bartlett: the variance of an estimated autocovariance is at most 2 Σρ²/n = 2τ/(nT) an axis,
    // half of that for two: four standard deviations of 0.0071. White errors: 4/√n.
    for (tau, bound) in [(10.0, 0.029), (0.0, 0.009)] {
        let setup = changed(|setup| (setup.position_sigma, setup.position_correlation_time) = (sigma, tau));
        let mut sensors = sensors(setup, 4);
        let mut measured = || sensors.measure(&at_rest(), &STILL, true, PERIOD);
        let errors = (0..n).map(|_| measured().position() / sigma);
        let errors: Vec<Vector2<f64>> = errors.collect();
        for lag in [0_u32, 1, 5, 10, 20] {
            let products = errors.iter().zip(&errors[lag as usize..]).map(|(a, b)| 0.5 * a.dot(b));
            let expected = if lag == 0 { 1.0 } else { (-f64::from(lag) * PERIOD / tau).exp() };
            near(products.sum::<f64>() / f64::from(n - lag), expected, bound);
        }
    }
}

#[test]
fn white_errors_have_their_sigma_no_mean_but_the_bias_and_no_correlation() {
    let setup = SensorSetup {
        position_sigma: 2.0,
        position_correlation_time: 0.0,
        velocity_sigma: 0.05,
        heading_sigma: 0.02,
        heading_bias: -0.1,
        yaw_rate_sigma: 0.004,
        speed_sigma: 0.03,
    };
    let mut sensors = sensors(setup, 6);
    independent_unit_normals((0..40_000).map(|_| {
        let seen = sensors.measure(&at_rest(), &STILL, true, PERIOD);
        let ground = seen.ground_velocity().expect("there are satellites") / 0.05;
        [
            seen.position().x / 2.0,
            seen.position().y / 2.0,
            ground.x,
            ground.y,
            (seen.heading().radians() + 0.1) / 0.02,
            seen.yaw_rate_radps / 0.004,
            seen.speed_mps / 0.03,
            seen.sway_mps / 0.03,
        ]
    }));
}

#[test]
fn perfect_sensors_reckon_without_drift_in_a_constant_current() {
    let sensors = sensors(SensorSetup::default(), 1);
    let off = drift(sensors, 0.7, Vector2::new(0.1, -0.2), 600);
    // Rounding errors of six hundred sums of a few hundred metres.
    assert!(off.norm() < 600.0 * 600.0 * f64::EPSILON, "{off}");
}

#[test]
fn an_unseen_change_of_current_shifts_the_reckoned_position() {
    let mut sensors = sensors(SensorSetup::default(), 1);
    let mut craft = under_way(Vector2::zeros(), 0.3);
    let (current, change) = (Vector2::new(0.1, 0.0), Vector2::new(-0.02, 0.05));
    sensors.measure(&craft, &current, true, PERIOD);
    // The estimate stays where the old current would have taken the craft.
    near_to(drift_on(&mut sensors, &mut craft, &(current + change), 120), change * -120.0, 1e-9);
}

#[test]
fn a_compass_bias_shows_only_after_a_turn_and_grows_with_time() {
    let bias = 0.02;
    let setup = changed(|setup| setup.heading_bias = bias);
    let current = Vector2::new(0.1, -0.2);
    // The two errors cancel on the heading on which the current was estimated.
    near_to(drift(sensors(setup, 1), 0.7, current, 60), Vector2::zeros(), 1e-9);
    // After half a turn they add: (R(b) − 1)(w₂ − w₁) t, w₂ = −w₁, of length 2 · 2 sin(b/2) · t.
    let mut sensors = sensors(setup, 1);
    sensors.measure(&under_way(Vector2::zeros(), 0.7), &current, true, PERIOD);
    let mut craft = under_way(Vector2::zeros(), 0.7 + PI);
    let turned = drift_on(&mut sensors, &mut craft, &current, 60);
    near(turned.norm(), 4.0 * (0.5 * bias).sin() * 60.0, 1e-9);
}

#[test]
fn dead_reckoning_averages_the_noise_of_the_satellite_velocity() {
    let (sigma, outage, runs) = (0.05, 100, 1_000_u32);
    let setup = changed(|setup| setup.velocity_sigma = sigma);
    let squares = (0..runs).map(|seed| {
        let mut sensors = sensors(setup, seed.into());
        let mut craft = at_rest();
        for _ in 0..300 {
            sensors.measure(&craft, &STILL, true, PERIOD);
        }
        drift_on(&mut sensors, &mut craft, &STILL, outage).norm_squared()
    });
    // A running mean of gain α keeps α / (2 − α) of a white variance; 300 looks are ten memories.
    let gain = 1.0 - (-PERIOD / CURRENT_MEMORY).exp();
    let variance = sigma * sigma * gain / (2.0 - gain) * f64::from(outage * outage);
    // χ² with 2 · runs degrees of freedom has variance 4 · runs.
    let runs = f64::from(runs);
    let found = squares.sum::<f64>() / variance;
    near(found, 2.0 * runs, 4.0 * (4.0 * runs).sqrt());
}

#[test]
fn an_outage_changes_no_later_measurement() {
    let mut with = sensors(SensorSetup::SMALL_CRAFT, 9);
    let mut without = sensors(SensorSetup::SMALL_CRAFT, 9);
    let (craft, current) = (under_way(Vector2::new(10.0, 20.0), 0.4), Vector2::new(0.0, 0.1));
    for look in 0..200 {
        let gnss_works = !(50..120).contains(&look);
        let seen = with.measure(&craft, &current, gnss_works, PERIOD);
        let undisturbed = without.measure(&craft, &current, true, PERIOD);
        if gnss_works {
            assert_eq!(seen, undisturbed, "look {look}");
        } else {
            assert_eq!(seen.heading(), undisturbed.heading());
            assert_eq!(seen.speed_mps, undisturbed.speed_mps);
            assert_ne!(seen.position(), undisturbed.position());
        }
    }
}

#[test]
fn a_craft_without_satellites_from_the_start_reckons_from_its_first_position() {
    let mut sensors = sensors(SensorSetup::default(), 1);
    let mut craft = under_way(Vector2::new(4.0, 2.0), 0.0);
    let first = sensors.measure(&craft, &STILL, false, PERIOD);
    assert_eq!(first.position(), craft.position());
    assert_eq!(first.ground_velocity(), None);
    near_to(drift_on(&mut sensors, &mut craft, &STILL, 50), Vector2::zeros(), 1e-12);
}
