//! A check of a solution against its program, independent of the solver.

use faer::sparse::linalg::matmul::{SparseDenseMatMul, sparse_dense_matmul};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Accum, ColMut, ColRef, Par};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    program::{
        build::{Cone, Program},
        sparse::Sparse,
    },
    solve::clarabel::Solution,
};

/// Violations of the optimality conditions, recomputed from the program's data.
///
/// Each is relative to the largest term of its difference, or to 1 if that is smaller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Residuals {
    /// ‖A x + s − b‖∞, and the distance of s outside its cones.
    pub primal: f64,
    /// ‖P x + q + Aᵀ z‖∞, and the distance of z outside the dual cones.
    pub dual: f64,
    /// |xᵀ P x + qᵀ x + bᵀ z|: primal minus dual objective.
    pub gap: f64,
}

impl Residuals {
    /// Recomputes the residuals of `solution`; all NaN if a number is not finite.
    pub fn of(program: &Program, solution: &Solution) -> Self {
        // `f64::max` drops NaN, so non-finite numbers are detected first.
        let mut numbers = solution.primal.iter().chain(&solution.dual).chain(&solution.slack);
        if !numbers.all(|number| number.is_finite()) {
            return Self { primal: f64::NAN, dual: f64::NAN, gap: f64::NAN };
        }
        let x = ColRef::from_slice(&solution.primal);
        let z = ColRef::from_slice(&solution.dual);
        let s = ColRef::from_slice(&solution.slack);
        let q = ColRef::from_slice(&program.linear);
        let b = ColRef::from_slice(&program.bounds);

        let a = view(&program.constraints);
        let (mut a_x, mut at_z) = (vec![0.0; a.nrows()], vec![0.0; a.ncols()]);
        multiply(Accum::Replace, a, x, &mut a_x);
        multiply(Accum::Replace, a.transpose(), z, &mut at_z);
        let mut p_x = vec![0.0; a.ncols()];
        multiply_symmetric(&program.quadratic, x, &mut p_x);

        let (cost, linear) = (x.transpose() * ColRef::from_slice(&p_x), q.transpose() * x);
        let bound = b.transpose() * z;
        let largest = |terms: &[f64]| terms.iter().copied().fold(1.0, f64::max);
        let primal_terms = [norm(&a_x), s.norm_max(), b.norm_max()];
        let dual_terms = [norm(&p_x), q.norm_max(), norm(&at_z)];
        // The products are now overwritten with their residuals.
        for ((left, s), b) in a_x.iter_mut().zip(&solution.slack).zip(&program.bounds) {
            *left = *left + s - b;
        }
        for ((left, q), at_z) in p_x.iter_mut().zip(&program.linear).zip(&at_z) {
            *left = *left + q + at_z;
        }
        Self {
            primal: (norm(&a_x) / largest(&primal_terms)).max(outside(
                &program.cones,
                &solution.slack,
                false,
            )),
            dual: (norm(&p_x) / largest(&dual_terms)).max(outside(&program.cones, &solution.dual, true)),
            gap: (cost + linear + bound).abs()
                / largest(&[(0.5 * cost + linear).abs(), (0.5 * cost + bound).abs()]),
        }
    }

    /// `true` if every residual is at most `tolerance`; NaN is not.
    pub fn within(&self, tolerance: f64) -> bool {
        [self.primal, self.dual, self.gap].iter().all(|residual| *residual <= tolerance)
    }
}

fn view(matrix: &Sparse) -> SparseColMatRef<'_, usize, f64> {
    let symbolic = SymbolicSparseColMatRef::new_checked(
        matrix.n_rows,
        matrix.n_cols,
        &matrix.column_starts,
        None,
        &matrix.row_indices,
    );
    SparseColMatRef::new(symbolic, &matrix.values)
}

fn multiply(sum: Accum, matrix: impl SparseDenseMatMul<f64>, x: ColRef<'_, f64>, result: &mut [f64]) {
    let result = ColMut::from_slice_mut(result).as_mat_mut();
    sparse_dense_matmul(result, sum, matrix, x.as_mat(), 1.0, Par::Seq);
}

/// P x from the upper triangle: U x + Uᵀ x − diag(U) x.
fn multiply_symmetric(upper: &Sparse, x: ColRef<'_, f64>, result: &mut [f64]) {
    let u = view(upper);
    multiply(Accum::Replace, u, x, result);
    multiply(Accum::Add, u.transpose(), x, result);
    for column in 0..upper.n_cols {
        for entry in upper.column_starts[column]..upper.column_starts[column + 1] {
            if upper.row_indices[entry] == column {
                result[column] -= upper.values[entry] * x[column];
            }
        }
    }
}

fn norm(column: &[f64]) -> f64 {
    ColRef::from_slice(column).norm_max()
}

/// Largest distance of a block of `v` outside its cone, relative to the block or 1. All these cones
/// are self-dual except the zero cone, whose dual is the whole space.
fn outside(cones: &[Cone], v: &[f64], dual: bool) -> f64 {
    let mut rest = v;
    let mut worst: f64 = 0.0;
    for cone in cones {
        let (Cone::Zero(n) | Cone::Nonnegative(n) | Cone::SecondOrder(n)) = *cone;
        let (block, after) = rest.split_at(n);
        rest = after;
        let size = block.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
        let excess = match cone {
            Cone::Zero(_) if dual => 0.0,
            Cone::Zero(_) => block.iter().fold(0.0, |most: f64, value| most.max(value.abs())),
            Cone::Nonnegative(_) => block.iter().fold(0.0, |most: f64, value| most.max(-value)),
            Cone::SecondOrder(_) => ColRef::from_slice(&block[1..]).norm_l2() - block[0],
        };
        worst = worst.max(excess / size);
    }
    worst
}
