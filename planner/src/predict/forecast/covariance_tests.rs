use nalgebra::{SMatrix, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;
use crate::{predict::covariance::default_covariance, tests::prelude::*};

const U_H: f64 = 0.193;

/// Monte Carlo samples: one standard deviation of a variance is then 1 %.
const SAMPLES: usize = 20_000;

/// Four standard deviations of a sampled variance.
const SAMPLED: f64 = 0.04;

/// Spectral density of the acceleration, m²/s³, stated independently.
const Q: f64 = 6.0e-5;

fn auv(turn_rate: f64, path: Option<Path>) -> Known {
    Known {
        state: AuvState {
            turn_rate_radps: turn_rate,
            ..AuvState::new(Vector2::new(3.0, -4.0), 5.0, Course::new(0.4), U_H)
        },
        path: path.map(|path| KnownPath { path: std::sync::Arc::new(path), horizontal_speed: U_H }),
        dive: None,
    }
}

/// A vehicle without a path and with this covariance.
fn with_covariance(turn_rate: f64, covariance: Matrix4<f64>) -> Known {
    let mut auv = auv(turn_rate, None);
    auv.state.covariance = Some(covariance.transpose().into());
    auv
}

/// Asserts that two covariances are equal up to the sampling.
#[track_caller]
fn agrees(said: Matrix2<f64>, expected: Matrix2<f64>) {
    let off = (said - expected).norm();
    assert!(off < SAMPLED * expected.norm(), "{said} {expected}");
}

fn forecast(auv: &Known, model: ForecastModel) -> AuvForecast {
    auv.forecast(Forecast::from(model), &Vector2::zeros())
}

/// A covariance without symmetries, as from a filter that knows the course better than the speed.
fn filtered() -> Matrix4<f64> {
    let root = Matrix4::new(
        1.2, 0.0, 0.0, 0.0, //
        0.3, 0.8, 0.0, 0.0, //
        0.02, 0.01, 0.03, 0.0, //
        0.0, 0.03, -0.01, 0.02,
    );
    root * root.transpose()
}

fn normal<const N: usize>(rng: &mut ChaCha8Rng) -> SMatrix<f64, N, 1> {
    SMatrix::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal))
}

fn covariance(samples: impl Iterator<Item = Vector2<f64>>) -> Matrix2<f64> {
    let (mut n, mut sum) = (0.0, Matrix2::zeros());
    for error in samples {
        n += 1.0;
        sum += error * error.transpose();
    }
    sum / n
}

/// Errors of randomly accelerating vehicles that turn as forecast, from those of `filtered`.
fn unforeseen_variance(turn_rate: f64, seconds: u32) -> Matrix2<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let root = filtered().cholesky().expect("is positive definite").l();
    let step = 0.5;
    let turn = ned_from_body(turn_rate * step);
    covariance((0..SAMPLES).map(|_| {
        let wrong: Vector4<f64> = root * normal::<4>(&mut rng);
        let (mut position, mut velocity) =
            (wrong.fixed_rows::<2>(0).into_owned(), wrong.fixed_rows::<2>(2).into_owned());
        for _ in 0..2 * seconds {
            let before = velocity;
            velocity = turn * velocity + normal::<2>(&mut rng) * (Q * step).sqrt();
            position += (before + velocity) * (0.5 * step);
        }
        position
    }))
}

#[test]
fn the_covariance_of_a_straight_course_agrees_with_simulated_vehicles() {
    for (model, seconds) in [
        (ForecastModel::ConstantVelocity, 20),
        (ForecastModel::ConstantVelocity, 78),
        (ForecastModel::Hold, 78),
    ] {
        let said = forecast(&with_covariance(0.0, filtered()), model);
        let found = said.position_covariance(f64::from(seconds));
        agrees(found, unforeseen_variance(0.0, seconds));
    }
}

#[test]
fn the_covariance_of_a_turn_is_an_upper_bound_tight_to_a_quarter_turn() {
    for turned in [0.2, 1.5, 4.0] {
        let turn_rate = turned / 60.0;
        let truth = unforeseen_variance(turn_rate, 60).trace();
        let vehicle = with_covariance(turn_rate, filtered());
        let said = forecast(&vehicle, ForecastModel::ConstantTurn).position_variance(60.0);
        assert!(truth * (1.0 - SAMPLED) < said, "{turned} rad: {said}, {truth}");
        assert!(turned > 1.6 || said < 1.3 * truth, "{turned} rad: {said}, {truth}");
    }
}

#[test]
fn the_covariance_on_a_path_agrees_with_simulated_followers() {
    // From a lane through an arc: followers with a speed error of a tenth and offsets of 0.7 m.
    let start = Path::starting_at(Vector2::zeros(), 0.4).line(3.0);
    let path = start.arc(Side::Starboard, 100.0, 0.3).line(1e3);
    let mut vehicle = auv(0.0, Some(path.clone()));
    (vehicle.state.north_m, vehicle.state.east_m) = (0.0, 0.0);
    vehicle.state.covariance = Some(filtered().into());
    let forecast = forecast(&vehicle, ForecastModel::Path);
    let seconds = 300.0;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let position = filtered().fixed_view::<2, 2>(0, 0).into_owned();
    let root = position.cholesky().expect("is positive definite").l();
    let expected = covariance((0..SAMPLES).map(|_| {
        let reported = ned_from_body(0.4).transpose() * (root * normal::<2>(&mut rng));
        let drawn = normal::<2>(&mut rng);
        let ahead = reported.x + 0.1 * U_H * seconds * drawn.x;
        let point = path.at(U_H * seconds + ahead);
        let offset = starboard(point.tangent) * (reported.y + 0.7 * drawn.y);
        point.position + offset - forecast.at(seconds).position
    }));
    agrees(forecast.position_covariance(seconds), expected);
}

#[test]
fn waiting_never_reduces_the_covariance() {
    let mut shrinking = filtered();
    // A vehicle too far ahead is too slow, which is exact without accelerations.
    let opposed = -0.9 * (filtered()[(0, 0)] * filtered()[(2, 2)]).sqrt();
    (shrinking[(0, 2)], shrinking[(2, 0)]) = (opposed, opposed);
    let mower = Path::lawn_mower(Vector2::zeros(), 0.4, 50.0, 20.0, 4);
    for covariance in [None, Some(filtered()), Some(shrinking)] {
        for (model, turn_rate, path) in [
            (ForecastModel::Hold, 0.0, None),
            (ForecastModel::ConstantVelocity, 0.0, None),
            (ForecastModel::ConstantTurn, 0.05, None),
            (ForecastModel::Path, 0.0, Some(mower.clone())),
        ] {
            let mut vehicle = auv(turn_rate, path);
            vehicle.state.covariance = covariance.map(|matrix| matrix.transpose().into());
            let forecast = forecast(&vehicle, model);
            let known = covariance.unwrap_or_else(|| default_covariance(&ForecastNumbers::DEFAULT));
            let mut before = known.fixed_view::<2, 2>(0, 0).trace();
            near(forecast.position_variance(0.0), before, 1e-12);
            for ahead in 1..600 {
                let covariance = forecast.position_covariance(f64::from(ahead));
                assert!(before <= covariance.trace() + 1e-12, "{model:?} after {ahead} s");
                assert!(covariance.symmetric_eigenvalues().min() > 0.0);
                before = covariance.trace();
            }
        }
    }
}

#[test]
fn the_covariance_is_bounded_across_a_path_and_not_along_it() {
    let straight = Path::starting_at(Vector2::new(3.0, -4.0), 0.4).line(1e5);
    let forecast = forecast(&auv(0.0, Some(straight)), ForecastModel::Path);
    let ned_from_path = ned_from_body(0.4);
    let in_path = ned_from_path.transpose() * forecast.position_covariance(3_600.0) * ned_from_path;
    assert!(in_path[(1, 1)] < 1.5 * 1.5 + 0.7 * 0.7 + 1e-9);
    assert!(in_path[(0, 0)] > 60.0 * 60.0);
}

#[test]
fn the_covariance_of_an_older_report_is_that_of_waiting() {
    let fresh = forecast(&auv(0.02, None), ForecastModel::ConstantTurn);
    let mut old = auv(0.02, None);
    old.state.age_s = 30.0;
    let old = forecast(&old, ForecastModel::ConstantTurn);
    assert_eq!(old.position_covariance(10.0), fresh.position_covariance(40.0));
}

#[test]
fn the_covariance_of_a_fast_vehicle_is_that_of_a_slow_one_with_scaled_time() {
    // On equal lanes, a vehicle of 5 · 0.193 m/s does in 10 s what one of 0.193 m/s does in 50 s.
    let slow = with_covariance(0.0, Matrix4::identity() * 1e-12);
    let mut fast = slow.clone();
    fast.state.speed_mps = 5.0 * 0.193;
    let [slow, fast] = [slow, fast].map(|auv| forecast(&auv, ForecastModel::ConstantVelocity));
    // q t³: 5³ times the density, 5⁻³ of the time cubed. The slow speed is 0.19302 m/s.
    let found = fast.position_variance(10.0) / slow.position_variance(50.0);
    near(found, 1.0, 1e-2);
    // The error is at most that of the opposite course, for any silence.
    let longest = fast.position_variance(3000.0).sqrt();
    assert!(longest < 2.0 * 5.0 * 0.193 * 3000.0, "{longest} m");
}
