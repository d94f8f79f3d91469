//! Covariance propagation: uncertainty of a forecast.

use nalgebra::{Matrix2, Matrix4, Vector2};

use crate::{
    facts::angle::{direction, ned_from_body},
    tuned::ForecastNumbers,
};

/// Speed of the lawn-mower on which the density of accelerations was chosen, m/s. On the same
/// lanes, accelerations grow with its square and last for a turn: the density with its cube.
const LAWN_MOWER_SPEED: f64 = 0.193;

/// Default covariance of (north, east, north velocity, east velocity) in m², m²/s and m²/s².
pub(crate) fn default_covariance(tuned: &ForecastNumbers) -> Matrix4<f64> {
    let (p, v) = (tuned.position_sigma.powi(2), tuned.velocity_sigma.powi(2));
    Matrix4::from_diagonal(&[p, p, v, v].into())
}

/// Covariance of the position, m², `elapsed` seconds after a report with covariance `state`, at a
/// speed over ground, m/s, for a forecast turn by `turned` radians.
///
/// ```text
/// P(t) = P_pp + t (P_pv + P_pvᵀ)₊ + t² R P_vv Rᵀ + ⅓ q t³ I        R = R(½ turned)
/// ```
/// q grows with the vehicle's speed. On a straight course that is white acceleration of density q,
/// but the correlation counts only where it increases the covariance (₊: the part with positive
/// eigenvalues): waiting adds no information. In a turn it is an upper bound: wrong speeds and
/// courses shift the shorter chord, and a wrong rate of turn counts as acceleration.
pub(crate) fn free(
    state: &Matrix4<f64>,
    elapsed: f64,
    speed: f64,
    turned: f64,
    tuned: &ForecastNumbers,
) -> Matrix2<f64> {
    let position = state.fixed_view::<2, 2>(0, 0);
    let correlation = state.fixed_view::<2, 2>(0, 2).into_owned();
    let velocity = state.fixed_view::<2, 2>(2, 2);
    let half_turn = ned_from_body(0.5 * turned);
    let t = elapsed;
    position
        + positive_part(&(correlation + correlation.transpose())) * t
        + half_turn * velocity * half_turn.transpose() * (t * t)
        + Matrix2::identity() * unforeseen_variance(speed, t, tuned)
}

/// Variance of a position along either axis, m², from unforeseen motion `t` seconds after the last
/// report at a speed, m/s; at most that of a straight course in any other direction.
fn unforeseen_variance(speed: f64, t: f64, tuned: &ForecastNumbers) -> f64 {
    let faster = (speed / LAWN_MOWER_SPEED).max(1.0);
    let unbounded = tuned.acceleration_density * t.powi(3) / 3.0;
    (unbounded * faster.powi(3)).min(unbounded.max((speed * t).powi(2)))
}

/// The symmetric `matrix` without its negative eigenvalues.
fn positive_part(matrix: &Matrix2<f64>) -> Matrix2<f64> {
    let half_difference = 0.5 * (matrix.m11 - matrix.m22);
    let (mean, spread) = (0.5 * matrix.trace(), half_difference.hypot(matrix.m12));
    let axis = direction(0.5 * matrix.m12.atan2(half_difference));
    let across = Vector2::new(-axis.y, axis.x);
    axis * axis.transpose() * (mean + spread).max(0.0)
        + across * across.transpose() * (mean - spread).max(0.0)
}
