//! A cone program and its solution as bare numbers, for other solvers to try.

use planner::{
    program::{Cone, Program},
    solve::{Solution, SolverStatus},
    sparse::Sparse,
};
use serde::{Deserialize, Serialize};

use super::write_answer::status_name;

/// A program in the standard form of Clarabel, and what was made of it.
///
/// ```text
/// minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgramDump {
    /// Upper triangle of P.
    #[serde(rename = "P")]
    pub quadratic: DumpedMatrix,
    /// q.
    #[serde(rename = "q")]
    pub linear: Vec<f64>,
    /// A.
    #[serde(rename = "A")]
    pub constraints: DumpedMatrix,
    /// b.
    #[serde(rename = "b")]
    pub bounds: Vec<f64>,
    /// K, block after block of rows.
    pub cones: Vec<DumpedCone>,
    /// Where the first velocity stands among the variables.
    pub v1: FirstVelocity,
    /// How the solver ended, in snake case.
    pub status: String,
    /// What it found; absent where it found nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solution: Option<DumpedSolution>,
}

/// A matrix in compressed sparse column form; indices begin at 0 and explicit zeros are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DumpedMatrix {
    /// Number of rows.
    pub m: usize,
    /// Number of columns.
    pub n: usize,
    /// Where each column begins; `n + 1` entries.
    pub colptr: Vec<usize>,
    /// Row of each stored value, increasing within a column.
    pub rowval: Vec<usize>,
    /// The stored values.
    pub nzval: Vec<f64>,
}

/// A block of consecutive rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DumpedCone {
    /// Which cone.
    #[serde(rename = "type")]
    pub kind: ConeKind,
    /// How many rows.
    pub dim: usize,
}

/// The cones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ConeKind {
    /// s = 0.
    Zero,
    /// s ≥ 0.
    Nonneg,
    /// s₀ ≥ ‖(s₁, s₂, …)‖.
    Soc,
}

/// Velocity of the craft through the water after the first interval, ahead and starboard of its heading now.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FirstVelocity {
    /// Its two columns.
    pub columns: [usize; 2],
    /// What a variable of 1 means there, m/s.
    pub unit_mps: f64,
}

/// A point that a solver found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DumpedSolution {
    /// Variables.
    pub x: Vec<f64>,
    /// Multipliers of the rows.
    pub z: Vec<f64>,
    /// Slacks of the rows.
    pub s: Vec<f64>,
    /// ½ xᵀ P x + qᵀ x.
    pub obj: f64,
}

impl ProgramDump {
    /// The numbers of `program`, and of `solution` where its status gives them a meaning.
    #[must_use]
    pub fn new(program: &Program, solution: &Solution) -> Self {
        let (columns, unit_mps) = program.first_velocity();
        let found = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        Self {
            quadratic: DumpedMatrix::from(&program.quadratic),
            linear: program.linear.clone(),
            constraints: DumpedMatrix::from(&program.constraints),
            bounds: program.bounds.clone(),
            cones: program.cones.iter().map(DumpedCone::from).collect(),
            v1: FirstVelocity { columns, unit_mps },
            status: status_name(solution.status).to_owned(),
            solution: found.then(|| DumpedSolution {
                x: solution.primal.clone(),
                z: solution.dual.clone(),
                s: solution.slack.clone(),
                obj: objective(program, &solution.primal),
            }),
        }
    }
}

impl From<&Sparse> for DumpedMatrix {
    fn from(matrix: &Sparse) -> Self {
        Self {
            m: matrix.n_rows,
            n: matrix.n_cols,
            colptr: matrix.column_starts.clone(),
            rowval: matrix.row_indices.clone(),
            nzval: matrix.values.clone(),
        }
    }
}

impl From<&Cone> for DumpedCone {
    fn from(cone: &Cone) -> Self {
        let (kind, dim) = match *cone {
            Cone::Zero(dim) => (ConeKind::Zero, dim),
            Cone::Nonnegative(dim) => (ConeKind::Nonneg, dim),
            Cone::SecondOrder(dim) => (ConeKind::Soc, dim),
        };
        Self { kind, dim }
    }
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
