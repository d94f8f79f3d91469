//! The planner's response model, fitted to a trial by least squares.

use planner::angle::wrap;
use planner::craft::{HeadingDynamics, HeadingResponse, SurgeResponse};
use planner::los::Reference;
use planner::snapshot::INTEGRAL_TIME;

use crate::world::inner_loop::PERIOD;

/// Rounds of the pattern search; each halves steps without gain.
const ROUNDS: u32 = 60;
/// Step of the search below which it ends, as a share of a parameter.
const FINE: f64 = 0.004;
/// Misfit, relative to that of a first-order response, below which a second-order response is used.
const SECOND_ORDER_GAIN: f64 = 0.7;
/// Misfit, relative to that without an integral time, below which one is used.
const INTEGRAL_GAIN: f64 = 0.8;
/// Range of a damping ratio.
const DAMPING: [f64; 2] = [0.3, 3.0];
/// Least time constant that is distinguished from none, s: a period.
const TIME_MIN: f64 = PERIOD;
/// Least delay that is distinguished from none, s: a tenth of a period.
const DELAY_MIN: f64 = 0.1 * PERIOD;

/// Reference, held angle and motion of the craft at the beginning of each period of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) reference: Reference,
    /// Angle that the heading loop holds, rad, not wrapped.
    pub(super) angle: f64,
    pub(super) surge: f64,
    pub(super) sway: f64,
    pub(super) yaw_rate: f64,
}

/// The heading response whose fastest turn is `rate_max`.
pub(super) fn fit_heading(trials: &[&[Sample]], rate_max: f64) -> HeadingResponse {
    let misfit =
        |response: &HeadingResponse| rms(trials.iter().map(|trial| heading_residuals(response, trial)));
    let first = |[lag, delay]: [f64; 2]| HeadingResponse {
        dynamics: HeadingDynamics::FirstOrder { time_constant: lag.max(TIME_MIN) },
        delay: noticeable(delay),
        rate_max,
    };
    let second = |[lag, delay, damping]: [f64; 3]| HeadingResponse {
        dynamics: HeadingDynamics::SecondOrder {
            natural_frequency: 2.0 * damping.clamp(DAMPING[0], DAMPING[1]) / lag.max(TIME_MIN),
            damping: damping.clamp(DAMPING[0], DAMPING[1]),
        },
        delay: noticeable(delay),
        rate_max,
    };
    // The area above a step response is its lag, a good start of the search.
    let lag =
        trials[0].iter().map(|sample| wrap(sample.reference.heading.radians() - sample.angle)).sum::<f64>()
            * PERIOD
            / trials[0][0].reference.heading.radians();
    let start = lag.max(2.0 * TIME_MIN);
    let one = search([0.7 * start, 0.3 * start], |x| misfit(&first(x)));
    let two = search([0.9 * start, 0.1 * start, 0.9], |x| misfit(&second(x)));
    if two.1 < SECOND_ORDER_GAIN * one.1 { second(two.0) } else { first(one.0) }
}

pub(super) fn fit_surge(trials: &[Vec<Sample>]) -> SurgeResponse {
    let misfit = |response: &SurgeResponse| rms(trials.iter().map(|trial| surge_residuals(response, trial)));
    let response = |[lag, delay, up, down]: [f64; 4], integral_time| SurgeResponse {
        time_constant: lag.max(TIME_MIN),
        delay: noticeable(delay),
        acceleration_max: up,
        deceleration_max: down,
        integral_time,
    };
    let start = [3.0, 0.5, steepest(&trials[1]), steepest(&trials[2])];
    let plain = search(start, |x| misfit(&response(x, None)));
    let [lag, delay, up, down] = plain.0;
    let wound = search([lag, delay, up, down, 2.0 * lag], |[lag, delay, up, down, time]| {
        misfit(&response([lag, delay, up, down], Some(time)))
    });
    // An integral time outside the range of a description counts as no integrator.
    let winds_up = INTEGRAL_TIME.contains(&wound.0[4]);
    if winds_up && wound.1 < INTEGRAL_GAIN * plain.1 {
        let [lag, delay, up, down, time] = wound.0;
        response([lag, delay, up, down], Some(time))
    } else {
        response(plain.0, None)
    }
}

/// The delay, or 0 if the search by factors made it negligible.
fn noticeable(delay: f64) -> f64 {
    if delay < DELAY_MIN { 0.0 } else { delay }
}

/// Largest mean acceleration over two seconds, m/s².
fn steepest(trial: &[Sample]) -> f64 {
    let seconds = 20;
    let pairs = trial.iter().zip(&trial[seconds..]);
    let steep = pairs.map(|(a, b)| (b.surge - a.surge).abs() / 2.0);
    steep.fold(0.0, f64::max)
}

/// Differences of the model's heading from a trial's, rad.
pub(super) fn heading_residuals(response: &HeadingResponse, trial: &[Sample]) -> Vec<f64> {
    let mut psi = trial[0].angle;
    let mut rate = 0.0;
    let misses = (0..trial.len()).map(|k| {
        let miss = wrap(psi - trial[k].angle);
        let reference =
            delayed(trial, k, response.delay, |sample| sample.reference.heading.radians(), trial[0].angle);
        let error = wrap(reference - psi);
        rate = match response.dynamics {
            // Exact over a period: a time constant of a period stays stable.
            HeadingDynamics::FirstOrder { time_constant } => {
                error * (1.0 - (-PERIOD / time_constant).exp()) / PERIOD
            }
            HeadingDynamics::SecondOrder { natural_frequency, damping } => {
                let (omega, zeta) = (natural_frequency, damping);
                // Implicit in the damping, for the same reason.
                (rate + PERIOD * omega * omega * error) / (1.0 + PERIOD * 2.0 * zeta * omega)
            }
        }
        .clamp(-response.rate_max, response.rate_max);
        psi += PERIOD * rate;
        miss
    });
    misses.collect()
}

/// Differences of the model's speed from a trial's, m/s.
pub(super) fn surge_residuals(response: &SurgeResponse, trial: &[Sample]) -> Vec<f64> {
    let (mut u, mut bias) = (trial[0].surge, 0.0);
    let from = trial[0].surge;
    let misses = (0..trial.len()).map(|k| {
        let miss = u - trial[k].surge;
        let reference = delayed(trial, k, response.delay, |sample| sample.reference.speed, from);
        let asked = (reference - u) * (1.0 - (-PERIOD / response.time_constant).exp()) / PERIOD;
        let asked = asked.clamp(-response.deceleration_max, response.acceleration_max);
        u += PERIOD * (asked + bias);
        if let Some(time) = response.integral_time {
            bias += PERIOD * asked / time;
        }
        miss
    });
    misses.collect()
}

/// A reference `delay` s before sample k, between samples; `before` the start of the trial.
#[expect(clippy::cast_possible_truncation, reason = "delays are a few seconds, never negative")]
fn delayed(trial: &[Sample], k: usize, delay: f64, of: impl Fn(&Sample) -> f64, before: f64) -> f64 {
    let periods = delay / PERIOD;
    let whole = periods.floor();
    let at = |back: usize| k.checked_sub(back).map_or(before, |i| of(&trial[i]));
    let (later, earlier) = (at(whole as usize), at(whole as usize + 1));
    let share = periods - whole;
    later + share * wrap(earlier - later)
}

fn rms(misses: impl Iterator<Item = Vec<f64>>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for miss in misses.flatten() {
        sum += miss * miss;
        n += 1.0;
    }
    f64::sqrt(sum / n)
}

/// A minimum of `cost` near `start`, and its cost: pattern search by factors, all above 0.
fn search<const N: usize>(start: [f64; N], cost: impl Fn([f64; N]) -> f64) -> ([f64; N], f64) {
    let mut best = start.map(|x: f64| x.max(0.5 * TIME_MIN * FINE));
    let mut least = cost(best);
    let mut step = [0.5; N];
    for _ in 0..ROUNDS {
        for i in 0..N {
            let mut better = false;
            for factor in [1.0 + step[i], 1.0 / (1.0 + step[i])] {
                let mut tried = best;
                tried[i] *= factor;
                let found = cost(tried);
                if found < least {
                    (best, least, better) = (tried, found, true);
                    break;
                }
            }
            step[i] *= if better { 1.3 } else { 0.5 };
        }
        if step.iter().all(|step| *step < FINE) {
            break;
        }
    }
    (best, least)
}
