//! Covariance propagation: uncertainty of a forecast.

use nalgebra::{Matrix2, Matrix4, Vector2};

use crate::facts::angle::{direction, ned_from_body};

/// Default standard deviation of a reported position along either axis, m: of an acoustic fix.
const POSITION_SIGMA: f64 = 1.5;

/// Default standard deviation of a reported velocity along either axis, m/s:
/// [`super::SPEED_AT_REST`].
const VELOCITY_SIGMA: f64 = 0.05;

/// Spectral density of the acceleration of an AUV with unknown plans, along either axis, m²/s³. It
/// reproduces the error of a constant velocity on a lawn-mower, see `docs/rationale.md#forecasts`.
const ACCELERATION_DENSITY: f64 = 6.0e-5;

/// Speed of that lawn-mower, m/s. On the same lanes, accelerations grow with the square of the
/// speed and last for a turn: the density grows with the cube.
const LAWN_MOWER_SPEED: f64 = 0.193;

/// Standard deviation of the speed along a known path, as a share of the speed through the water.
/// Assumption: accuracy of planned speeds in a current known to 0.02 m/s.
const PATH_SPEED_SHARE: f64 = 0.1;

/// Standard deviation of the cross-track offset that a follower acquires besides the forecast, m.
/// Measured on the simulated follower, see `docs/rationale.md#forecasts`.
const CROSS_TRACK_SIGMA: f64 = 0.7;

/// Default covariance of (north, east, north velocity, east velocity) in m², m²/s and m²/s².
pub(crate) fn default_covariance() -> Matrix4<f64> {
    let (p, v) = (POSITION_SIGMA.powi(2), VELOCITY_SIGMA.powi(2));
    Matrix4::from_diagonal(&[p, p, v, v].into())
}

/// Covariance of the position, m², `elapsed` seconds after a report with covariance `state`, for a
/// forecast turn by `turned` radians.
///
/// ```text
/// P(t) = P_pp + t (P_pv + P_pvᵀ)₊ + t² R P_vv Rᵀ + ⅓ q t³ I        R = R(½ turned)
/// ```
/// q grows with the vehicle's speed. On a straight course that is white acceleration of density q,
/// but the correlation counts only where it increases the covariance (₊: the part with positive
/// eigenvalues), so waiting adds no information. In a turn it is an upper bound: the velocity
/// variance acts along the arc, while wrong speeds and courses shift the shorter chord, and a wrong
/// rate of turn counts as acceleration.
pub(crate) fn free(state: &Matrix4<f64>, elapsed: f64, course: &Free) -> Matrix2<f64> {
    let position = state.fixed_view::<2, 2>(0, 0);
    let correlation = state.fixed_view::<2, 2>(0, 2).into_owned();
    let velocity = state.fixed_view::<2, 2>(2, 2);
    let half_turn = ned_from_body(0.5 * course.turned);
    let t = elapsed;
    position
        + positive_part(&(correlation + correlation.transpose())) * t
        + half_turn * velocity * half_turn.transpose() * (t * t)
        + Matrix2::identity() * unforeseen_variance(course.speed, t)
}

/// Variance of a position along either axis, m², from unforeseen motion `t` seconds after the last
/// report at a speed, m/s; at most that of a straight course in any other direction.
fn unforeseen_variance(speed: f64, t: f64) -> f64 {
    let faster = (speed / LAWN_MOWER_SPEED).max(1.0);
    let unbounded = ACCELERATION_DENSITY * t.powi(3) / 3.0;
    (unbounded * faster.powi(3)).min(unbounded.max((speed * t).powi(2)))
}

/// Motion of a vehicle with unknown plans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Free {
    /// Speed over ground, m/s.
    pub(crate) speed: f64,
    /// Forecast change of course, rad.
    pub(crate) turned: f64,
}

/// Inputs of the covariance of a vehicle on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OnPath {
    /// Tangent angle at the report, rad.
    pub(crate) reported: f64,
    /// Tangent angle at the forecast position, rad.
    pub(crate) tangent: f64,
    /// Horizontal speed through the water, m/s.
    pub(crate) speed: f64,
    /// Completed share of the approach to its offset, in [0, 1].
    pub(crate) approached: f64,
}

/// Covariance of the position on a path, m², `elapsed` s after a report with covariance `state`.
///
/// ```text
/// along    σ_s² + (0.1 u_h t)²              across   σ_y² + σ_∞² (1 − (1 − a)²)
/// ```
/// in the path's frame there, with σ_s and σ_y from the report in the path's frame then, their
/// correlation unchanged, and the completed share a of the approach to a steady offset. The error
/// along the path is taken as straight: bends are long beside it.
pub(crate) fn along_path(state: &Matrix4<f64>, elapsed: f64, on_path: &OnPath) -> Matrix2<f64> {
    let reported = ned_from_body(on_path.reported);
    let mut covariance = reported.transpose() * state.fixed_view::<2, 2>(0, 0) * reported;
    covariance[(0, 0)] += (PATH_SPEED_SHARE * on_path.speed * elapsed).powi(2);
    covariance[(1, 1)] += CROSS_TRACK_SIGMA.powi(2) * (1.0 - (1.0 - on_path.approached).powi(2));
    let tangent = ned_from_body(on_path.tangent);
    tangent * covariance * tangent.transpose()
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
