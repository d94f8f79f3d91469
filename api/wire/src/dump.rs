//! A cone program and its solution as plain numbers, for other solvers.

use planner::program::{Cone, Program};
use planner::solve::{Solution, SolverStatus};
use planner::sparse::Sparse;
use serde_json::{Value, json};

/// A program in the standard form of Clarabel, and its solution.
///
/// ```text
/// minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
/// ```
/// ```text
/// P, A       m × n matrices as compressed sparse columns: starts of columns (colptr), rows and
///            values of entries (rowval, nzval), from 0; with explicit zeros; P: upper triangle
/// q, b       vectors
/// cones      K, by blocks of rows: type (zero: s = 0, nonneg: s ≥ 0, soc: s₀ ≥ ‖(s₁, …)‖), rows
/// columns    a name for each variable, such as `velocity[3].ahead`, and
/// rows       for each row, such as `turn_rate[3].port`: stages from 1; edges, discs, AUVs from 0
/// v1         variables of the craft's velocity through the water after the first interval, ahead
///            and starboard of its heading now, and the velocity of a variable of 1, m/s
/// status     status of the solver, in snake case
/// solution   x, multipliers z, slacks s and the objective; absent for a status without them
/// ```
pub fn program_dump(program: &Program, solution: &Solution) -> Value {
    let (columns, unit_mps) = program.first_velocity();
    let mut dump = json!({
        "P": matrix(&program.quadratic),
        "q": program.linear,
        "A": matrix(&program.constraints),
        "b": program.bounds,
        "cones": program.cones.iter().map(cone).collect::<Vec<_>>(),
        "columns": program.layout.column_names(),
        "rows": program.layout.row_names(),
        "v1": { "columns": columns, "unit_mps": unit_mps },
        "status": solution.status,
    });
    if matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved) {
        dump["solution"] = json!({
            "x": solution.primal, "z": solution.dual, "s": solution.slack,
            "obj": objective(program, &solution.primal),
        });
    }
    dump
}

fn matrix(matrix: &Sparse) -> Value {
    json!({
        "m": matrix.n_rows, "n": matrix.n_cols,
        "colptr": matrix.column_starts, "rowval": matrix.row_indices, "nzval": matrix.values,
    })
}

fn cone(cone: &Cone) -> Value {
    let (kind, dim) = match *cone {
        Cone::Zero(dim) => ("zero", dim),
        Cone::Nonnegative(dim) => ("nonneg", dim),
        Cone::SecondOrder(dim) => ("soc", dim),
    };
    json!({ "type": kind, "dim": dim })
}

/// ½ xᵀ P x + qᵀ x from the upper triangle of P: entries above the diagonal count twice.
fn objective(program: &Program, x: &[f64]) -> f64 {
    let matrix = &program.quadratic;
    let column = |column: usize| {
        let entries = matrix.column_starts[column]..matrix.column_starts[column + 1];
        entries.map(move |entry| {
            let row = matrix.row_indices[entry];
            let weight = if row == column { 0.5 } else { 1.0 };
            weight * matrix.values[entry] * x[row] * x[column]
        })
    };
    let quadratic: f64 = (0..matrix.n_cols).flat_map(column).sum();
    let linear: f64 = program.linear.iter().zip(x).map(|(q, x)| q * x).sum();
    quadratic + linear
}
