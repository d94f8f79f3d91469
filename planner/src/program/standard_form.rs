//! A cone program in standard form.

use crate::program::sparse::Sparse;

/// A cone program in the standard form of [`crate::program`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct StandardForm<'a> {
    /// P, upper triangle.
    pub quadratic: &'a Sparse,
    /// q.
    pub linear: &'a [f64],
    /// A.
    pub constraints: &'a Sparse,
    /// b.
    pub bounds: &'a [f64],
    /// K, by consecutive blocks of rows.
    pub cones: &'a [Cone],
}

/// A block of consecutive rows, and the cone of their slacks s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// s = 0.
    Zero(usize),
    /// s ≥ 0.
    Nonnegative(usize),
    /// s₀ ≥ ‖(s₁, s₂, …)‖.
    SecondOrder(usize),
}
