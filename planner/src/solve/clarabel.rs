//! The interface to Clarabel, which no other file knows.

use std::fmt;

use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultInfo, DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SupportedConeT},
};
use serde::{Deserialize, Serialize};

use crate::program::build::{Cone, Program};
use crate::program::sparse::Sparse;
use crate::solve::by_shape::ByShape;
use crate::solve::stop::Stop;

/// Optimality tolerance: the first planned velocity is within 1 mm/s of that of 1e-9 (tested).
pub const TOLERANCE: f64 = 1e-7;

/// Feasibility tolerance of a kept solver as a multiple of its optimality tolerance: with 1, some
/// programs stall without refinement; see `docs/rationale.md#solver`.
const FEASIBILITY: f64 = 10.0;

/// Bytes of a solver for each stored number of its program; per variable or row, and per stored
/// number of its factor, the next two. Fitted to the allocation (tested).
const PER_ENTRY: usize = 120;
const PER_COLUMN: usize = 400;
const PER_FACTOR_ENTRY: usize = 16;

/// Most interior-point iterations: twice the hardest case, see `docs/rationale.md#solver`.
const ITERATIONS_MAX: u32 = 100;

/// Final status of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolverStatus {
    /// Not started.
    #[default]
    Unsolved,
    /// Optimal within tolerance.
    Solved,
    /// Optimal within a wider tolerance.
    AlmostSolved,
    /// No point satisfies the constraints.
    PrimalInfeasible,
    /// The cost is unbounded below.
    DualInfeasible,
    /// Primal infeasible within a wider tolerance.
    AlmostPrimalInfeasible,
    /// Dual infeasible within a wider tolerance.
    AlmostDualInfeasible,
    /// Out of iterations.
    MaxIterations,
    /// Out of time.
    MaxTime,
    /// The arithmetic failed, or the data was invalid.
    NumericalError,
    /// Steps became too short.
    InsufficientProgress,
    /// The caller asked it to stop.
    CallbackTerminated,
}

/// Its name in JSON.
impl fmt::Display for SolverStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Result of a solver. `primal`, `dual` and `slack` are valid only with a suitable status.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solution {
    /// Final status.
    pub status: SolverStatus,
    /// Variables x.
    pub primal: Vec<f64>,
    /// Multipliers z of the rows.
    pub dual: Vec<f64>,
    /// Slacks s of the rows.
    pub slack: Vec<f64>,
    /// Interior-point iterations.
    pub iterations: u32,
}

impl Solution {
    /// No solution, with the reason.
    pub fn none(status: SolverStatus) -> Self {
        Self { status, ..Self::default() }
    }
}

/// Solvers kept by problem shape: symbolic factorisation and memory are set up once, and numbers
/// are replaced. Without equilibration a reused solver equals a new one.
pub struct Solvers {
    tolerance: f64,
    by_shape: ByShape<DefaultSolver<f64>>,
}

impl Default for Solvers {
    fn default() -> Self {
        Self::with_tolerance(TOLERANCE)
    }
}

impl std::fmt::Debug for Solvers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.by_shape.shapes()).finish()
    }
}

impl Solvers {
    /// Solvers with another tolerance than [`TOLERANCE`], for checks of it.
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { tolerance, by_shape: ByShape::default() }
    }

    /// Drops the least recently used solvers until the others take about `bytes` at most.
    pub fn shrink_to(&mut self, bytes: usize) {
        self.by_shape.shrink_to(bytes);
    }

    /// Approximate size of the solvers in bytes.
    pub fn bytes(&self) -> usize {
        self.by_shape.bytes()
    }

    /// Solves `program` from a cold start.
    pub fn solve(&mut self, program: &Program) -> Solution {
        self.solve_until(program, &Stop::never())
    }

    /// [`Solvers::solve`], interrupted at the first iteration after `stop` is due.
    pub fn solve_until(&mut self, program: &Program, stop: &Stop) -> Solution {
        let Some(solver) = self.prepared(program) else {
            return Solution::none(SolverStatus::NumericalError);
        };
        // Otherwise the solver adds up its time over all solves.
        solver.timers = Some(clarabel::timers::Timers::default());
        let solution = solve_until_due(solver, stop);
        let gave_up = matches!(
            solution.status,
            SolverStatus::MaxIterations | SolverStatus::InsufficientProgress | SolverStatus::NumericalError
        );
        if !gave_up {
            return solution;
        }
        // Rare, and slower: numbers of very different size, see `docs/rationale.md#solver`.
        let settings = settings(self.tolerance).map(|settings| DefaultSettings {
            iterative_refinement_enable: true,
            equilibrate_enable: true,
            ..settings
        });
        let Some(settings) = settings else {
            return solution;
        };
        let careful = new_solver(program, settings).map_or_else(
            || Solution::none(SolverStatus::NumericalError),
            |mut solver| solve_until_due(&mut solver, stop),
        );
        Solution { iterations: solution.iterations + careful.iterations, ..careful }
    }

    /// The solver with the program's numbers; `None` if Clarabel refuses them, which no `Program`
    /// causes.
    fn prepared(&mut self, program: &Program) -> Option<&mut DefaultSolver<f64>> {
        if self.by_shape.is_kept(&program.layout) {
            let solver = self.by_shape.last()?;
            solver.update_P(&program.quadratic.values).ok()?;
            solver.update_q(&program.linear).ok()?;
            solver.update_A(&program.constraints.values).ok()?;
            solver.update_b(&program.bounds).ok()?;
        } else {
            let solver = new_solver(program, settings(self.tolerance)?)?;
            let bytes = bytes(program, &solver);
            self.by_shape.insert(program.layout, bytes, solver);
        }
        self.by_shape.last()
    }
}

fn bytes(program: &Program, solver: &DefaultSolver<f64>) -> usize {
    let entries = program.constraints.values.len() + program.quadratic.values.len();
    let columns = program.layout.n_variables() + program.layout.n_rows();
    PER_ENTRY * entries + PER_COLUMN * columns + PER_FACTOR_ENTRY * solver.info.linsolver.nnzL
}

/// Solves until the first iteration after `stop` is due.
fn solve_until_due(solver: &mut DefaultSolver<f64>, stop: &Stop) -> Solution {
    let stop = stop.clone();
    solver.set_termination_callback(move |_: &DefaultInfo<f64>| stop.is_due());
    solver.solve();
    // A kept solver must not retain the caller's signal.
    solver.unset_termination_callback();
    let answer = &solver.solution;
    Solution {
        status: status_of(answer.status),
        primal: answer.x.clone(),
        dual: answer.z.clone(),
        slack: answer.s.clone(),
        iterations: answer.iterations,
    }
}

fn new_solver(program: &Program, settings: DefaultSettings<f64>) -> Option<DefaultSolver<f64>> {
    DefaultSolver::new(
        &csc(&program.quadratic),
        &program.linear,
        &csc(&program.constraints),
        &program.bounds,
        &program.cones.iter().map(cone).collect::<Vec<_>>(),
        settings,
    )
    .ok()
}

fn settings(tolerance: f64) -> Option<DefaultSettings<f64>> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .max_iter(ITERATIONS_MAX)
        .tol_gap_abs(tolerance)
        .tol_gap_rel(tolerance)
        .tol_feas(FEASIBILITY * tolerance)
        // Slacks give every program a solution and a bounded cost: apparent proofs of infeasibility
        // are rounding, and the tolerance 0 accepts none.
        .tol_infeas_rel(0.0)
        .reduced_tol_infeas_rel(0.0)
        .max_threads(1)
        // Takes half of the time; the certificate detects errors: `docs/rationale.md#solver`.
        .iterative_refinement_enable(false)
        // Updates would re-apply the first data's scaling; the program scales itself instead.
        .equilibrate_enable(false)
        .presolve_enable(false)
        .input_sparse_dropzeros(false)
        .build()
        .ok()
}

fn csc(matrix: &Sparse) -> CscMatrix<f64> {
    CscMatrix::new(
        matrix.n_rows,
        matrix.n_cols,
        matrix.column_starts.clone(),
        matrix.row_indices.clone(),
        matrix.values.clone(),
    )
}

fn cone(cone: &Cone) -> SupportedConeT<f64> {
    match *cone {
        Cone::Zero(n) => SupportedConeT::ZeroConeT(n),
        Cone::Nonnegative(n) => SupportedConeT::NonnegativeConeT(n),
        Cone::SecondOrder(n) => SupportedConeT::SecondOrderConeT(n),
    }
}

fn status_of(status: clarabel::solver::SolverStatus) -> SolverStatus {
    use clarabel::solver::SolverStatus as Theirs;
    match status {
        Theirs::Unsolved => SolverStatus::Unsolved,
        Theirs::Solved => SolverStatus::Solved,
        Theirs::AlmostSolved => SolverStatus::AlmostSolved,
        Theirs::PrimalInfeasible => SolverStatus::PrimalInfeasible,
        Theirs::DualInfeasible => SolverStatus::DualInfeasible,
        Theirs::AlmostPrimalInfeasible => SolverStatus::AlmostPrimalInfeasible,
        Theirs::AlmostDualInfeasible => SolverStatus::AlmostDualInfeasible,
        Theirs::MaxIterations => SolverStatus::MaxIterations,
        Theirs::MaxTime => SolverStatus::MaxTime,
        Theirs::NumericalError => SolverStatus::NumericalError,
        Theirs::InsufficientProgress => SolverStatus::InsufficientProgress,
        Theirs::CallbackTerminated => SolverStatus::CallbackTerminated,
    }
}
