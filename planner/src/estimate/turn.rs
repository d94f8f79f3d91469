//! How fast a vehicle turns that does not report it.

use nalgebra::Vector2;

use crate::facts::{
    angle::{angle_of, wrap},
    evidence::{AuvState, SPEED_AT_REST},
    previous_plan::PreviousEstimate,
};

/// Times between two courses that show how fast the vehicle turned meanwhile, s. Assumption: in a shorter one the
/// course's error is all that is seen, in a longer one a turn begins and ends.
const BETWEEN: std::ops::RangeInclusive<f64> = 0.1..=30.0;

/// Largest turn between two courses of which the sense is clear, rad.
const TURNED_MAX: f64 = 2.0;

/// How long the rate is averaged over, s. Of courses that err by 0.05 rad, one a second, it leaves 0.01 rad/s.
const MEMORY: f64 = 5.0;

/// Slower than this a turn is not distinguished from the error of courses, rad/s. Over the default horizon of 78 s it amounts to
/// 22°.
const RATE_MIN: f64 = 0.005;

/// Largest rate of turn that a snapshot accepts, rad/s.
const RATE_MAX: f64 = 1.0;

/// Rate of turn of a vehicle that reported its velocity `before`, `between` seconds earlier, and now `after`, rad/s, positive
/// clockwise; none where they do not show it.
pub(crate) fn turn_rate(before: &Vector2<f64>, after: &Vector2<f64>, between: f64) -> Option<f64> {
    let moving = before.norm() >= SPEED_AT_REST && after.norm() >= SPEED_AT_REST;
    let turned = wrap(angle_of(after) - angle_of(before));
    (moving && BETWEEN.contains(&between) && turned.abs() <= TURNED_MAX).then(|| turned / between)
}

/// Rate of turn of a vehicle in `state`, `between` seconds after what the previous plan remembers, rad/s.
///
/// ```text
/// r = r⁻ + (1 − exp(−Δ/τ)) ((χ − χ⁻) / Δ − r⁻)          τ = 5 s
/// ```
/// r⁻ as it is, where the state is no newer.
pub(crate) fn remembered_turn_rate(earlier: &PreviousEstimate, state: &AuvState, between: f64) -> f64 {
    if between.abs() < *BETWEEN.start() {
        return earlier.turn_rate_radps;
    }
    let Some(rate) = turn_rate(&earlier.velocity(), &state.velocity(), between) else {
        return 0.0;
    };
    let share = -(-between / MEMORY).exp_m1();
    clear(earlier.turn_rate_radps + share * (rate - earlier.turn_rate_radps))
}

/// A rate that can be distinguished from none.
pub(crate) fn clear(rate: f64) -> f64 {
    if rate.abs() < RATE_MIN {
        0.0
    } else {
        rate.clamp(-RATE_MAX, RATE_MAX)
    }
}
