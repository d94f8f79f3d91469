//! Comparisons and tables for the tests of planner and simulator, which includes this file.

use nalgebra::Vector2;

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

/// The cells of a table in words: a row a line, cells apart by `|`. In a cell, `\n` breaks a line.
pub(crate) fn rows<const N: usize>(table: &str) -> Vec<[String; N]> {
    let cells = |row: &str| row.split('|').map(|cell| cell.trim().replace("\\n", "\n")).collect::<Vec<_>>();
    let lines = table.lines().filter(|row| !row.trim().is_empty());
    lines.map(|row| cells(row).try_into().unwrap_or_else(|_| panic!("{row}"))).collect()
}
