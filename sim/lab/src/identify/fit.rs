//! Nonlinear least squares with intervals for coloured residuals.

use std::ops::Range;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, U1, VecStorage};

/// Standard deviations to either side of a 95 % interval.
pub(super) const QUANTILE: f64 = 1.96;

/// Half of the interval of the central differences. Parameters (logarithms, s, m/s, rad) are of
/// order 1; residuals are piecewise smooth, and smoother over a thousandth than over less.
const DIFFERENCE: f64 = 1e-3;
/// Largest lag of the residuals' correlation, samples.
const LAGS_MAX: usize = 400;
/// Least eigenvalue of the scaled information matrix: a direction below it is unobservable.
const INFORMATION_MIN: f64 = 1e-9;
/// Relative change of sum and parameters at which the search ends, far below any interval.
const TOLERANCE: f64 = 1e-7;
/// Evaluations for each parameter, as in MINPACK.
const PATIENCE: usize = 30;

/// A number with its standard deviation, which is infinite if the log does not show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) sigma: f64,
}

/// Residuals of one kind of measurement, in time.
pub(super) type Channels = Vec<Range<usize>>;

/// Parameters for which the sum of squares is least.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) parameters: Vec<f64>,
    pub(super) residuals: Vec<f64>,
    pub(super) sum_of_squares: f64,
}

struct ModelFit<F> {
    model: F,
    parameters: DVector<f64>,
}

impl<F: Fn(&[f64]) -> Vec<f64>> LeastSquaresProblem<f64, Dyn, Dyn> for ModelFit<F> {
    type ResidualStorage = VecStorage<f64, Dyn, U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, U1>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(DVector::from_vec((self.model)(self.parameters.as_slice())))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let columns = columns(&self.model, self.parameters.as_slice());
        let (rows, n) = (columns[0].len(), columns.len());
        Some(DMatrix::from_vec(rows, n, columns.concat()))
    }
}

/// Least squares of `model`, which gives the residuals, from `start` on, as MINPACK has it.
pub(super) fn least_squares(model: impl Fn(&[f64]) -> Vec<f64>, start: &[f64]) -> Fitted {
    let problem = ModelFit { model, parameters: DVector::from_column_slice(start) };
    // How it ended does not matter: the interval describes the point where it stopped.
    let (problem, _) =
        LevenbergMarquardt::new().with_patience(PATIENCE).with_tol(TOLERANCE).minimize(problem);
    let parameters = problem.parameters.as_slice().to_vec();
    let residuals = (problem.model)(&parameters);
    Fitted { sum_of_squares: residuals.iter().map(|r| r * r).sum(), parameters, residuals }
}

/// The initial guess with the least sum of squares.
pub(super) fn nearest(
    model: impl Fn(&[f64]) -> Vec<f64>,
    starts: impl Iterator<Item = Vec<f64>>,
) -> Vec<f64> {
    let sum = |start: &[f64]| model(start).iter().map(|r| r * r).sum::<f64>();
    let summed = starts.map(|start| (sum(&start), start));
    let least = summed.min_by(|(a, _), (b, _)| a.total_cmp(b));
    least.expect("there is a start").1
}

fn columns(model: &impl Fn(&[f64]) -> Vec<f64>, at: &[f64]) -> Vec<Vec<f64>> {
    let shifted = |j: usize, by: f64| {
        let mut parameters = at.to_vec();
        parameters[j] += by;
        model(&parameters)
    };
    let column = |j| {
        let (ahead, back) = (shifted(j, DIFFERENCE), shifted(j, -DIFFERENCE));
        let slopes = ahead.iter().zip(&back).map(|(a, b)| (a - b) / (2.0 * DIFFERENCE));
        slopes.collect()
    };
    (0..at.len()).map(column).collect()
}

/// The estimates with their standard deviations.
///
/// ```text
/// cov = H⁻¹ (Jᵀ Γ J) H⁻¹,   H = JᵀJ
/// ```
/// Γ is the residuals' covariance, stationary within a channel: its autocovariance is estimated up
/// to the first lag at which noise hides it. A craft unlike the model has coloured residuals, for
/// which σ² H⁻¹ is too small. Source: L. Ljung, *System Identification* (1999), section 9.4.
pub(super) fn estimates(
    model: impl Fn(&[f64]) -> Vec<f64>,
    fitted: &Fitted,
    channels: &Channels,
) -> Vec<Estimate> {
    let n = fitted.parameters.len();
    let columns = columns(&model, &fitted.parameters);
    let norm = |column: &Vec<f64>| column.iter().map(|slope| slope * slope).sum::<f64>().sqrt();
    let scale: Vec<f64> = columns.iter().map(norm).collect();
    let largest = scale.iter().copied().fold(0.0, f64::max);
    let shown: Vec<usize> = (0..n).filter(|j| INFORMATION_MIN * largest < scale[*j]).collect();
    let scaled = |j: usize, i: usize| columns[j][i] / scale[j];

    let size = shown.len();
    let mut information = DMatrix::<f64>::zeros(size, size);
    let mut middle = information.clone();
    for channel in channels {
        let covariance = autocovariance(&fitted.residuals[channel.clone()], n);
        let filter = |j: &usize| {
            let column: Vec<f64> = channel.clone().map(|i| scaled(*j, i)).collect();
            convolved(&column, &covariance)
        };
        let filtered: Vec<Vec<f64>> = shown.iter().map(filter).collect();
        for (a, j) in shown.iter().enumerate() {
            for (b, k) in shown.iter().enumerate() {
                for (i, filtered) in channel.clone().zip(&filtered[b]) {
                    information[(a, b)] += scaled(*j, i) * scaled(*k, i);
                    middle[(a, b)] += scaled(*j, i) * filtered;
                }
            }
        }
    }
    let eigen = information.symmetric_eigen();
    let inverse = eigen.eigenvalues.map(|value: f64| 1.0 / value.max(INFORMATION_MIN));
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    let covariance = &inverse * middle * &inverse;

    let mut sigmas = DVector::from_element(n, f64::INFINITY);
    for (a, j) in shown.iter().enumerate() {
        sigmas[*j] = covariance[(a, a)].max(0.0).sqrt() / scale[*j];
    }
    let both = fitted.parameters.iter().copied().zip(sigmas.iter().copied());
    both.map(|(value, sigma)| Estimate { value, sigma }).collect()
}

/// Autocovariance of `residuals` from lag 0 to the first that is lost in noise.
fn autocovariance(residuals: &[f64], n_parameters: usize) -> Vec<f64> {
    let n = residuals.len();
    let (count, freedom) = (n as f64, n.saturating_sub(n_parameters).max(1) as f64);
    let at = |lag: usize| -> f64 {
        let products = residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b);
        products.sum::<f64>() / freedom
    };
    let variance = at(0);
    // Two standard deviations of the correlation of white noise.
    let noise = 2.0 / count.sqrt() * variance;
    let lags = (1..LAGS_MAX.min(n)).map(at).take_while(|covariance| noise < covariance.abs());
    std::iter::once(variance).chain(lags).collect()
}

/// Γ times `column`, Γ the symmetric band matrix of `covariance`.
fn convolved(column: &[f64], covariance: &[f64]) -> Vec<f64> {
    let mut result: Vec<f64> = column.iter().map(|value| value * covariance[0]).collect();
    for (lag, covariance) in covariance.iter().enumerate().skip(1) {
        for i in lag..column.len() {
            result[i] += covariance * column[i - lag];
            result[i - lag] += covariance * column[i];
        }
    }
    result
}

/// Effective number of independent samples in `residuals`.
fn effective_count(residuals: &[f64]) -> f64 {
    let covariance = autocovariance(residuals, 0);
    let count = residuals.len() as f64;
    let correlated: f64 = covariance[1..].iter().sum();
    if covariance[0] <= 0.0 {
        return count;
    }
    count / (1.0 + 2.0 * correlated.max(0.0) / covariance[0])
}

/// Advantage in log likelihood of `one` over `other` on the same data, for coloured residuals.
pub(super) fn advantage(one: &Fitted, other: &Fitted) -> f64 {
    let count = effective_count(&one.residuals).min(effective_count(&other.residuals));
    0.5 * count
        * (other.sum_of_squares.max(f64::MIN_POSITIVE) / one.sum_of_squares.max(f64::MIN_POSITIVE)).ln()
}

/// `true` if `one` fits the same data better than `other`; `None` at odds below 150 to 1.
pub(super) fn better(one: &Fitted, other: &Fitted) -> Option<bool> {
    const DECISIVE: f64 = 5.0;
    let advantage = advantage(one, other);
    (DECISIVE < advantage.abs()).then_some(0.0 < advantage)
}
