//! A solution checked against its program by arithmetic that is not the solver's.

use faer::{
    Accum, Col, ColRef, Par,
    sparse::{SparseColMatRef, SymbolicSparseColMatRef, linalg::matmul::sparse_dense_matmul},
};

use crate::{
    program::{Cone, Program},
    solve::Solution,
    sparse::Sparse,
};

/// How well a solution satisfies the optimality conditions, recomputed from the program's data.
///
/// All are relative to the largest term they are the difference of, or to 1 where that is smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residuals {
    /// ‖A x + s − b‖∞, and how far s is outside its cones.
    pub primal: f64,
    /// ‖P x + q + Aᵀ z‖∞, and how far z is outside the dual cones.
    pub dual: f64,
    /// |xᵀ P x + qᵀ x + bᵀ z|: primal less dual objective.
    pub gap: f64,
}

impl Residuals {
    /// Recomputes the residuals of `solution`; all NaN where it holds a number that is not finite.
    #[must_use]
    pub fn of(program: &Program, solution: &Solution) -> Self {
        // `f64::max` drops NaN, so what is not finite is told before anything is compared.
        let mut numbers = solution
            .primal
            .iter()
            .chain(&solution.dual)
            .chain(&solution.slack);
        if !numbers.all(|number| number.is_finite()) {
            return Self {
                primal: f64::NAN,
                dual: f64::NAN,
                gap: f64::NAN,
            };
        }
        let x = ColRef::from_slice(&solution.primal);
        let z = ColRef::from_slice(&solution.dual);
        let s = ColRef::from_slice(&solution.slack);
        let q = ColRef::from_slice(&program.linear);
        let b = ColRef::from_slice(&program.bounds);

        let a = view(&program.constraints);
        let a_x = product(a.nrows(), a, x);
        let mut at_z = Col::zeros(a.ncols());
        sparse_dense_matmul(
            at_z.as_mat_mut(),
            Accum::Replace,
            a.transpose(),
            z.as_mat(),
            1.0,
            Par::Seq,
        );
        let p_x = symmetric_product(&program.quadratic, x);

        let (cost, linear) = (x.transpose() * &p_x, q.transpose() * x);
        let bound = b.transpose() * z;
        let largest = |terms: &[f64]| terms.iter().copied().fold(1.0, f64::max);
        Self {
            primal: (norm(&(&a_x + s - b)) / largest(&[norm(&a_x), s.norm_max(), b.norm_max()]))
                .max(outside(&program.cones, &solution.slack, false)),
            dual: (norm(&(&p_x + q + &at_z)) / largest(&[norm(&p_x), q.norm_max(), norm(&at_z)]))
                .max(outside(&program.cones, &solution.dual, true)),
            gap: (cost + linear + bound).abs()
                / largest(&[(0.5 * cost + linear).abs(), (0.5 * cost + bound).abs()]),
        }
    }

    /// Whether every residual is at most `tolerance`; NaN is not.
    #[must_use]
    pub fn within(&self, tolerance: f64) -> bool {
        [self.primal, self.dual, self.gap]
            .iter()
            .all(|residual| *residual <= tolerance)
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

fn product(n_rows: usize, matrix: SparseColMatRef<'_, usize, f64>, x: ColRef<'_, f64>) -> Col<f64> {
    let mut result = Col::zeros(n_rows);
    sparse_dense_matmul(
        result.as_mat_mut(),
        Accum::Replace,
        matrix,
        x.as_mat(),
        1.0,
        Par::Seq,
    );
    result
}

/// P x from the upper triangle: U x + Uᵀ x − diag(U) x.
fn symmetric_product(upper: &Sparse, x: ColRef<'_, f64>) -> Col<f64> {
    let u = view(upper);
    let mut result = product(upper.n_rows, u, x);
    sparse_dense_matmul(
        result.as_mat_mut(),
        Accum::Add,
        u.transpose(),
        x.as_mat(),
        1.0,
        Par::Seq,
    );
    for column in 0..upper.n_cols {
        for entry in upper.column_starts[column]..upper.column_starts[column + 1] {
            if upper.row_indices[entry] == column {
                result[column] -= upper.values[entry] * x[column];
            }
        }
    }
    result
}

fn norm(column: &Col<f64>) -> f64 {
    column.norm_max()
}

/// Largest distance of a block of `v` outside its cone, relative to the block or 1. All cones here
/// are their own dual but the zero cone, whose dual is everything.
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
