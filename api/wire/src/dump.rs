//! A cone program and its solution as bare numbers, for other solvers to try.

use planner::{
    program::{Cone, Program},
    solve::{Solution, SolverStatus},
    sparse::Sparse,
};
use serde_json::{Value, json};

/// A program in the standard form of Clarabel, and what was made of it.
///
/// ```text
/// minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
/// ```
/// ```text
/// P, A       matrices in compressed sparse column form: m × n, where each column begins (colptr), row and value of each
///            entry (rowval, nzval). Indices begin at 0, explicit zeros are kept, of P there is the upper triangle.
/// q, b       vectors
/// cones      K, block after block of rows: type and number of rows. zero: s = 0, nonneg: s ≥ 0, soc: s₀ ≥ ‖(s₁, s₂, …)‖
/// columns    a name for each variable, such as `velocity[3].ahead`, and
/// rows       for each row, such as `turn_rate[3].port`: stages from 1; edges, discs and AUVs from 0
/// v1         where among the variables the velocity of the craft through the water after the first interval stands, ahead
///            and starboard of its heading now, and what a variable of 1 means there, m/s
/// status     how the solver ended, in snake case
/// solution   x, multipliers z, slacks s and the objective; absent where its status gives them no meaning
/// ```
#[must_use]
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

/// ½ xᵀ P x + qᵀ x from the upper triangle of P: what is above the diagonal counts twice.
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
