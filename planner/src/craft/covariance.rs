//! Prediction step of an extended Kalman filter of three states, with a bounded covariance.

use nalgebra::{Matrix3, Vector3};

use crate::craft::estimate::VARIANCE_MAX;

/// Step of the finite differences; the states are of order 1.
const STEP: f64 = 1e-5;

/// Smallest variance.
const VARIANCE_MIN: f64 = 1e-9;

/// Mean and covariance after `predict`, linearised by finite differences.
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
    // Scaling the whole matrix bounds it and keeps it a covariance.
    let largest = matrix.m11.max(matrix.m22).max(matrix.m33);
    if VARIANCE_MAX < largest {
        matrix *= VARIANCE_MAX / largest;
    }
    for i in 0..3 {
        matrix[(i, i)] = matrix[(i, i)].max(VARIANCE_MIN);
    }
    // Differences of large variances and a poor linearisation can leave a negative eigenvalue.
    if matrix.cholesky().is_none() {
        let mut eigen = matrix.symmetric_eigen();
        eigen.eigenvalues.apply(|eigenvalue| *eigenvalue = eigenvalue.max(VARIANCE_MIN));
        let recomposed = eigen.recompose();
        matrix = (recomposed + recomposed.transpose()) * 0.5;
    }
    matrix
}
