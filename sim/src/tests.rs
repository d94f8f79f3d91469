//! Comparisons that several tests share.

use nalgebra::{SMatrix, SVector};

#[path = "../../planner/src/tests/checks.rs"]
mod checks;

pub(crate) use checks::{near, near_to, rows};

/// Asserts four standard deviations for a count of `n` draws with probability `p`.
#[track_caller]
pub(crate) fn binomial(found: f64, n: f64, p: f64) {
    near(found, n * p, 4.0 * (n * p * (1.0 - p)).sqrt());
}

/// Asserts independent unit normals: no mean, no correlation. Sums of n of them have variance n, of
/// their products n, of their squares 2n about n.
#[track_caller]
pub(crate) fn independent_unit_normals<const N: usize>(draws: impl Iterator<Item = [f64; N]>) {
    let (mut n, mut sum) = (0.0, SVector::<f64, N>::zeros());
    let mut products = SMatrix::<f64, N, N>::zeros();
    for draw in draws.map(SVector::from) {
        n += 1.0;
        sum += draw;
        products += draw * draw.transpose();
    }
    let most = 4.0 * f64::sqrt(n);
    assert!(sum.amax() < most, "{sum}");
    for i in 0..N {
        near(products[(i, i)], n, most * 2_f64.sqrt());
        (0..i).for_each(|j| near(products[(i, j)], 0.0, most));
    }
}
