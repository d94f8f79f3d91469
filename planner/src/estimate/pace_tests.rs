//! Forecast uncertainty of vehicles with a steady and with a varying pace.

use std::f64::consts::TAU;

use super::{Estimate, Route, tests::Random};
use crate::tests::prelude::*;

const SIGMA: f64 = 1.5;
const SPEED: f64 = 0.9;
const AHEAD: f64 = 60.0;

/// A vehicle on lanes whose place oscillates by `surge`, m. Returns medians for a minute ahead: of
/// the normalised squared error, 1.4 for a true covariance, and of the variance, m².
fn a_minute_ahead(surge: f64) -> (f64, f64) {
    let path = Path::lawn_mower(Vector2::new(7.0, -3.0), 0.4, 200.0, 30.0, 12);
    // A period of 90 s does not divide the 230 s of a lane, so the pace does not repeat.
    let place = |t: f64| path.at(SPEED * t + surge * (TAU * t / 90.0).sin()).position;
    let (mut normalised, mut variances) = (Vec::new(), Vec::new());
    for seed in 0..3 {
        let mut random = Random(seed);
        let mut reports = Vec::new();
        let mut track = Vec::new();
        for k in 0..190_u32 {
            let t = 10.0 * f64::from(k);
            reports.push(Report::new(t, place(t) + random.normal() * SIGMA, SIGMA));
            let newest = reports[reports.len().saturating_sub(64)..].to_vec();
            let auv = Auv::reported("a", newest);
            let found = Estimate::new(&auv, None, t, &Vector2::zeros(), None, Some(&track), &|| false);
            track.clone_from(&found.track);
            let followed = found.route.filter(Route::is_followed);
            let (Some(route), Some(known), true) = (followed, found.path, 800.0 <= t && k % 3 == 0) else {
                continue;
            };
            let (fit, speed) = (&route.fit, found.state.speed_mps);
            let then = known.path.at(fit.along() + fit.sense * speed * AHEAD);
            let error = then.position + fit.offset() - place(t + AHEAD);
            let covariance = fit.position_covariance(then.tangent, AHEAD, 0.0);
            let inverse = covariance.try_inverse().expect("a covariance is positive definite");
            normalised.push(error.dot(&(inverse * error)));
            variances.push(covariance.trace());
        }
    }
    (median(normalised), median(variances))
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

#[test]
fn a_varying_pace_makes_the_forecast_less_certain() {
    let [(steady, small), (surging, large)] = [0.0, 4.0].map(a_minute_ahead);
    assert!(steady < 2.8, "{steady}");
    assert!(surging < 2.8, "{surging}");
    assert!(4.0 * small < large, "{small} m² and {large} m²");
}
