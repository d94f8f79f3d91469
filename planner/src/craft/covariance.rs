//! An extended Kalman filter's prediction of three states, and its covariance kept sound.

use nalgebra::{Matrix3, Vector3};

use crate::craft::estimate::VARIANCE_MAX;

/// Step of a finite difference; the states are of the order of 1.
const STEP: f64 = 1e-5;

/// Smallest variance that rounding leaves.
const VARIANCE_MIN: f64 = 1e-9;

/// Mean and covariance after `predict`, by its finite differences.
pub(super) fn propagated(
    predict: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    state: &Vector3<f64>,
    covariance: &Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let mut jacobian = Matrix3::zeros();
    for column in 0..3 {
        let mut step = Vector3::zeros();
        step[column] = STEP;
        let slope = (predict(&(state + step)) - predict(&(state - step))) / (2.0 * STEP);
        jacobian.set_column(column, &slope);
    }
    (predict(state), jacobian * covariance * jacobian.transpose())
}

/// The covariance nearest to `matrix`: symmetric, bounded, no eigenvalue negative.
pub(super) fn sound(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let mut matrix = (matrix + matrix.transpose()) * 0.5;
    // A covariance that has grown without bound knows nothing: all of it shrinks, so that it stays one.
    let largest = matrix.m11.max(matrix.m22).max(matrix.m33);
    if VARIANCE_MAX < largest {
        matrix *= VARIANCE_MAX / largest;
    }
    for i in 0..3 {
        matrix[(i, i)] = matrix[(i, i)].max(VARIANCE_MIN);
    }
    // Differences of large variances, and a linearisation that does not hold, can leave what is no covariance.
    if matrix.cholesky().is_none() {
        let mut eigen = matrix.symmetric_eigen();
        eigen
            .eigenvalues
            .apply(|eigenvalue| *eigenvalue = eigenvalue.max(VARIANCE_MIN));
        let recomposed = eigen.recompose();
        matrix = (recomposed + recomposed.transpose()) * 0.5;
    }
    matrix
}
