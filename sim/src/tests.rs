//! Comparisons that several tests share.

use nalgebra::{SMatrix, SVector, Vector2};

/// Asserts that two numbers differ by less than `tolerance`.
#[track_caller]
pub(crate) fn near(found: f64, expected: f64, tolerance: f64) {
    let off = (found - expected).abs();
    assert!(off < tolerance, "{found} instead of {expected}");
}

/// Asserts that two vectors are less than `tolerance` apart.
#[track_caller]
pub(crate) fn near_to(found: Vector2<f64>, expected: Vector2<f64>, tolerance: f64) {
    let off = (found - expected).norm();
    assert!(off < tolerance, "{found} instead of {expected}: {off} apart");
}

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

/// The cells of a table in words: a row a line, cells apart by `|`. In a cell, `\n` breaks a line.
pub(crate) fn rows<const N: usize>(table: &str) -> Vec<[String; N]> {
    let cells = |row: &str| {
        row.split('|')
            .map(|cell| cell.trim().replace("\\n", "\n"))
            .collect::<Vec<_>>()
    };
    let lines = table.lines().filter(|row| !row.trim().is_empty());
    lines
        .map(|row| cells(row).try_into().unwrap_or_else(|_| panic!("{row}")))
        .collect()
}
