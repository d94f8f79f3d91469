//! Propulsion power at steady speeds.

use super::fit::{self, Estimate, QUANTILE, least_squares};
use super::heading::{Motion, begin};
use super::log::Log;
use super::parameter::{Parameter, Quantity, RELATIVE_WIDTH_MAX};

/// Below this speed a propeller's losses dominate, m/s.
const SPEED_MIN: f64 = 0.1;
/// Largest acceleration, m/s², and yaw rate, rad/s, of steady motion.
const ACCELERATION_MAX: f64 = 0.005;
const YAW_RATE_MAX: f64 = 0.01;
/// Least time of steady motion, s: speed loops settle in it.
const STEADY_FOR: f64 = 10.0;
/// Standard deviation of a steady simulated speed, as a part of it. Assumption: the error of the
/// fits of speed and current, which the residuals of power do not show.
const SPEED_SIGMA: f64 = 0.003;
/// Power that cannot be distinguished from noise, W.
const POWER_MIN: f64 = 1e-3;

/// The coefficients of P = c₁ u + c₃ u³, none negative; empty if the log has no power.
pub(super) fn fit(log: &Log, motion: &[Motion]) -> Vec<Parameter> {
    let samples = steady(log, motion);
    let fastest = samples.iter().map(|(speed, _)| *speed).fold(0.0, f64::max);
    if samples.is_empty() {
        return Vec::new();
    }
    let residuals = |c_1: f64, c_3: f64| -> Vec<f64> {
        let error = |(u, power): &(f64, f64)| power - (c_1 + c_3 * u * u) * u;
        samples.iter().map(error).collect()
    };
    let channels = std::iter::once(0..samples.len()).collect::<Vec<_>>();
    let of = |model: &dyn Fn(&[f64]) -> Vec<f64>, start: &[f64]| {
        fit::estimates(model, &least_squares(model, start), &channels)
    };
    let both = of(&|p| residuals(p[0], p[1]), &[1.0, 1.0]);
    let none = Estimate { value: 0.0, sigma: 0.0 };
    let [linear, cubic] = if both[0].value < 0.0 {
        [none, of(&|p| residuals(0.0, p[0]), &[1.0])[0]]
    } else if both[1].value < 0.0 {
        [of(&|p| residuals(p[0], 0.0), &[1.0])[0], none]
    } else {
        [both[0], both[1]]
    };
    // P = c uⁿ: the relative error of c is n times that of u.
    let with_speed = |estimate: Estimate, exponent: f64| Estimate {
        sigma: estimate.sigma.hypot(exponent * SPEED_SIGMA * estimate.value),
        ..estimate
    };
    let (linear, cubic) = (with_speed(linear, 1.0), with_speed(cubic, 3.0));
    let at_most = (linear.value + cubic.value * fastest * fastest) * fastest;
    let (of_linear, of_cubic) = (linear.sigma * fastest, cubic.sigma * fastest.powi(3));
    // Both or none: one coefficient alone does not give the power.
    let identified =
        POWER_MIN < at_most && QUANTILE * of_linear.hypot(of_cubic) <= RELATIVE_WIDTH_MAX * at_most;
    let parameter = |quantity, estimate: Estimate| Parameter {
        quantity,
        estimate: estimate.value.max(0.0),
        low: (estimate.value - QUANTILE * estimate.sigma).max(0.0),
        high: (estimate.value + QUANTILE * estimate.sigma).max(0.0),
        identified,
    };
    vec![parameter(Quantity::PowerLinear, linear), parameter(Quantity::PowerCubic, cubic)]
}

/// Speed, m/s, and power, W, while the craft went straight at a steady speed.
fn steady(log: &Log, motion: &[Motion]) -> Vec<(f64, f64)> {
    let rows = log.rows();
    let mut steady_since = begin(log);
    let mut samples = Vec::new();
    for i in begin(log).max(1)..rows.len() {
        let acceleration = (motion[i].surge - motion[i - 1].surge) / (rows[i].time - rows[i - 1].time);
        if ACCELERATION_MAX < acceleration.abs() || YAW_RATE_MAX < motion[i].yaw_rate.abs() {
            steady_since = i;
        }
        let long_enough = STEADY_FOR < rows[i].time - rows[steady_since].time;
        if let Some(power) = rows[i].power
            && long_enough
            && SPEED_MIN < motion[i].surge
        {
            samples.push((motion[i].surge, power));
        }
    }
    samples
}
