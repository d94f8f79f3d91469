//! Heading and speed after one interval on a constant reference.

use crate::craft::model::CraftModel;

/// Integration steps of one interval.
const SUBSTEPS: u32 = 4;

/// Change in `elapsed` of a heading with this `error` from its reference, rad.
pub(crate) fn heading_change(error: f64, lag: f64, rate_max: f64, elapsed: f64) -> f64 {
    let linear = rate_max * lag;
    let sign = error.signum();
    let error = error.abs();
    // At the rate limit down to the loop's linear range, then exponentially.
    let limited = ((error - linear) / rate_max).clamp(0.0, elapsed);
    let left = error - rate_max * limited;
    sign * (rate_max * limited + left * (1.0 - (-(elapsed - limited) / lag.max(1e-3)).exp()))
}

/// Speed and bias after `elapsed` on a speed reference.
pub(crate) fn surge_after(
    speed: f64,
    bias: f64,
    reference: f64,
    craft: &CraftModel,
    elapsed: f64,
) -> (f64, f64) {
    let dt = elapsed / f64::from(SUBSTEPS);
    let limits = &craft.limits;
    (0..SUBSTEPS).fold((speed, bias), |(speed, bias), _| {
        let asked = (reference - speed) / (craft.surge_time.max(0.5 * dt) + 0.5 * dt);
        let loop_gives = asked.clamp(-limits.deceleration_max, limits.acceleration_max);
        let gathered = craft.integral_time.map_or(0.0, |time| loop_gives * (1.0 - (-dt / time).exp()));
        (speed + dt * (loop_gives + bias), bias + gathered)
    })
}
