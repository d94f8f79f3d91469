//! Rate of turn of a vehicle that does not report it.

use nalgebra::Vector2;

use crate::{
    facts::{
        angle::{angle_of, wrap},
        evidence::{AuvState, SPEED_AT_REST},
        previous_plan::PreviousEstimate,
    },
    tuned::EstimateNumbers,
};

/// Interval between courses for a rate of turn, s: shorter shows errors, in longer a turn begins.
const BETWEEN: std::ops::RangeInclusive<f64> = 0.1..=30.0;

/// Largest turn between two courses with an unambiguous sense, rad.
const TURNED_MAX: f64 = 2.0;

/// Largest rate of turn that a snapshot accepts, rad/s.
const RATE_MAX: f64 = 1.0;

/// Rate of turn between two velocities, `between` seconds apart, rad/s; `None` if undetermined.
pub(crate) fn turn_rate(before: &Vector2<f64>, after: &Vector2<f64>, between: f64) -> Option<f64> {
    let moving = before.norm() >= SPEED_AT_REST && after.norm() >= SPEED_AT_REST;
    let turned = wrap(angle_of(after) - angle_of(before));
    (moving && BETWEEN.contains(&between) && turned.abs() <= TURNED_MAX).then(|| turned / between)
}

/// Rate of turn of a vehicle in `state`, `between` seconds after the previous one, rad/s.
///
/// ```text
/// r = r⁻ + (1 − exp(−Δ/τ)) ((χ − χ⁻) / Δ − r⁻)          τ = 5 s
/// ```
/// r⁻ is unchanged if the state is no newer.
pub(crate) fn remembered_turn_rate(
    earlier: &PreviousEstimate,
    state: &AuvState,
    between: f64,
    tuned: &EstimateNumbers,
) -> f64 {
    if between.abs() < *BETWEEN.start() {
        return earlier.turn_rate_radps;
    }
    let Some(rate) = turn_rate(&earlier.velocity(), &state.velocity(), between) else {
        return 0.0;
    };
    let share = -(-between / tuned.turn_rate_memory).exp_m1();
    clear(earlier.turn_rate_radps + share * (rate - earlier.turn_rate_radps), tuned)
}

/// The rate, or 0 if it is insignificant.
pub(crate) fn clear(rate: f64, tuned: &EstimateNumbers) -> f64 {
    if rate.abs() < tuned.turn_rate_min { 0.0 } else { rate.clamp(-RATE_MAX, RATE_MAX) }
}
