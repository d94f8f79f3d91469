//! The time of one SCP iteration's subproblem: the planner's updated solver, and Clarabel.
//!
//! ```text
//! cargo bench -p tests --bench solvers -- [--rounds N] [--dump DIR]
//! ```
//! Both solve every scene in turn, so that other work on the machine slows both. A busy machine
//! slows the longer solves more: those past the scheduler's time slice, some milliseconds, are
//! interrupted more often than not. Read ratios on an idle one. The time is that of a further SCP
//! iteration whose program is stated. For the planner's solver: replacing the numbers, solving,
//! copying the solution out. For Clarabel: its set-up with default settings, and solving. `--dump`
//! writes programs, solutions and `times.json` for other solvers: `tests/python/solvers.py`.

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser as _;
use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus as ClarabelStatus, SupportedConeT},
};
use planner::parameters::Parameters;
use planner::plan::{Programs, plan_with};
use planner::program::{Cone, Program};
use planner::snapshot::Acoustics;
use planner::solve::{Solution, SolverStatus, Solvers};
use planner::sparse::Sparse;
use serde_json::json;
use tests::{goals, observation, snapshot};
use wire::program_dump;

/// Programs of a horizon: enough that none is a special case, and few enough for the cache.
const N_SCENES: u32 = 40;
/// Interval of horizons with equal steps, s: the middle one of the default horizon.
const INTERVAL: f64 = 2.0;
/// Acoustic range, m: a little more than half the AUVs' distance, so that it binds some of the plans.
const RANGE: f64 = 36.0;

fn main() {
    let arguments = Arguments::parse();
    println!(
        "median and 99th percentile of {} solves, µs; iterations of the mean solve; share within own tolerance\n\n\
         horizon    N  vars  rows |     kept     p99 iter. solved | Clarabel     p99 iter. solved | ratio  v_1 apart",
        arguments.rounds * N_SCENES as usize,
    );
    let mut times = serde_json::Map::new();
    for (name, steps) in horizons() {
        let programs: Vec<_> = (0..N_SCENES).map(|i| program(&steps, i)).collect();
        let measured = Measured::over(&programs, arguments.rounds);
        measured.print(name, &programs[0]);
        if let Some(folder) = &arguments.dump {
            measured.dump(folder, name, &programs);
            times.insert(name.to_owned(), measured.summary(&programs[0]));
        }
    }
    if let Some(folder) = &arguments.dump {
        let times = format!("{:#}\n", serde_json::Value::from(times));
        write(folder, "times.json", &times);
    }
}

fn write(folder: &Path, name: &str, text: &str) {
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(folder.join(name), text));
    written.expect("a folder that can be written");
}

#[derive(clap::Parser)]
struct Arguments {
    /// Number of solves of each program: the 99th percentile of 30 is that of 1200.
    #[arg(long, default_value_t = 30)]
    rounds: usize,
    /// Folder for programs, solutions and times.
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Cargo says that it is a benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Names of the horizons, and their intervals.
fn horizons() -> [(&'static str, Vec<f64>); 4] {
    let alike = |n_stages| vec![INTERVAL; n_stages];
    [("10", alike(10)), ("20", alike(20)), ("default", Parameters::default().steps), ("60", alike(60))]
}

/// The first program of a plan over `steps`. Scene number `i` has the craft at another place beside the
/// midpoint of two AUVs 60 m apart.
fn program(steps: &[f64], i: u32) -> Program {
    let angle = f64::from(i) * TAU / f64::from(N_SCENES);
    let mut scene = observation(goals()[2].clone());
    scene.asc.north_m = 11.0 - 6.0 * angle.sin();
    scene.asc.east_m = 27.0 + 3.0 * angle.cos();
    scene.acoustics = Some(Acoustics { range_max_m: RANGE });
    let parameters = Parameters { steps: steps.to_vec(), ..Parameters::default() };
    let (mut solvers, mut first) = (Solvers::default(), None);
    let _ = plan_with(&snapshot(scene), &parameters, &mut Programs::default(), &mut |program| {
        first.get_or_insert_with(|| program.clone());
        solvers.solve(program)
    });
    first.expect("a program was stated")
}

/// The costs of all programs of a horizon.
struct Measured {
    kept: Times,
    as_it_comes: Times,
    /// The kept solver's solutions, program by program.
    solutions: Vec<Solution>,
    /// Largest difference of the two solvers in the first velocity, m/s.
    apart: f64,
}

impl Measured {
    fn over(programs: &[Program], rounds: usize) -> Self {
        let mut solvers = Solvers::default();
        let theirs: Vec<_> = programs.iter().map(AsItComes::new).collect();
        // This also warms up.
        let solutions: Vec<_> = programs.iter().map(|program| solvers.solve(program)).collect();
        let mut apart = 0.0_f64;
        for ((program, solution), as_it_comes) in programs.iter().zip(&solutions).zip(&theirs) {
            assert_eq!(solution.status, SolverStatus::Solved);
            let other = as_it_comes.solve();
            assert!(matches!(other.solution.status, ClarabelStatus::Solved | ClarabelStatus::AlmostSolved));
            let (columns, unit) = program.first_velocity();
            for column in columns {
                apart = apart.max(unit * (solution.primal[column] - other.solution.x[column]).abs());
            }
        }
        let (mut kept, mut as_it_comes) = (Times::default(), Times::default());
        for _ in 0..rounds {
            for (program, theirs) in programs.iter().zip(&theirs) {
                kept.add(|| {
                    let solution = solvers.solve(program);
                    (solution.iterations, solution.status == SolverStatus::Solved)
                });
                as_it_comes.add(|| {
                    let solution = theirs.solve().solution;
                    (solution.iterations, solution.status == ClarabelStatus::Solved)
                });
            }
        }
        Self { kept, as_it_comes, solutions, apart }
    }

    fn print(&self, name: &str, program: &Program) {
        let (kept, theirs) = (&self.kept, &self.as_it_comes);
        println!(
            "{name:>8} {:>4} {:>5} {:>5} | {} | {} | {:>5.3} {:>5.3} mm/s",
            program.layout.n_stages,
            program.layout.n_variables(),
            program.layout.n_rows(),
            kept.row(),
            theirs.row(),
            kept.percentile(50) / theirs.percentile(50),
            1e3 * self.apart,
        );
    }

    fn summary(&self, program: &Program) -> serde_json::Value {
        json!({
            "n_stages": program.layout.n_stages,
            "n_variables": program.layout.n_variables(),
            "n_rows": program.layout.n_rows(),
            "kept": self.kept.summary(),
            "as_it_comes": self.as_it_comes.summary(),
        })
    }

    fn dump(&self, folder: &Path, name: &str, programs: &[Program]) {
        for (i, (program, solution)) in programs.iter().zip(&self.solutions).enumerate() {
            let text = program_dump(program, solution).to_string();
            write(folder, &format!("{name}-{i:02}.json"), &text);
        }
    }
}

/// A program in Clarabel's form, copied in advance.
struct AsItComes {
    quadratic: CscMatrix<f64>,
    linear: Vec<f64>,
    constraints: CscMatrix<f64>,
    bounds: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl AsItComes {
    fn new(program: &Program) -> Self {
        let cone = |cone: &Cone| match *cone {
            Cone::Zero(n) => SupportedConeT::ZeroConeT(n),
            Cone::Nonnegative(n) => SupportedConeT::NonnegativeConeT(n),
            Cone::SecondOrder(n) => SupportedConeT::SecondOrderConeT(n),
        };
        Self {
            quadratic: csc(&program.quadratic),
            linear: program.linear.clone(),
            constraints: csc(&program.constraints),
            bounds: program.bounds.clone(),
            cones: program.cones.iter().map(cone).collect(),
        }
    }

    fn solve(&self) -> DefaultSolver<f64> {
        let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
        let (p, q, a, b) = (&self.quadratic, &self.linear, &self.constraints, &self.bounds);
        let solver = DefaultSolver::new(p, q, a, b, &self.cones, settings);
        let mut solver = solver.expect("a program in standard form");
        solver.solve();
        solver
    }
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

/// Times of one solver, and its iterations.
#[derive(Default)]
struct Times {
    durations: Vec<Duration>,
    iterations: Vec<u32>,
    /// Number of solves that ended within the solver's own tolerance.
    n_solved: u32,
}

impl Times {
    /// Times one solve, which returns its iterations, and `true` if within tolerance.
    fn add(&mut self, solve: impl FnOnce() -> (u32, bool)) {
        let start = Instant::now();
        let (iterations, solved) = solve();
        self.durations.push(start.elapsed());
        self.iterations.push(iterations);
        self.n_solved += u32::from(solved);
    }

    /// The percentile of solve times, µs.
    fn percentile(&self, percent: usize) -> f64 {
        let mut sorted = self.durations.clone();
        sorted.sort_unstable();
        1e6 * sorted[(sorted.len() - 1) * percent / 100].as_secs_f64()
    }

    /// Iterations of the mean solve.
    fn iterations(&self) -> f64 {
        f64::from(self.iterations.iter().sum::<u32>()) / self.n()
    }

    /// Share of the solves that ended within the solver's own tolerance.
    fn solved(&self) -> f64 {
        f64::from(self.n_solved) / self.n()
    }

    fn n(&self) -> f64 {
        f64::from(u32::try_from(self.iterations.len()).expect("far fewer solves"))
    }

    fn row(&self) -> String {
        let (median, high) = (self.percentile(50), self.percentile(99));
        let solved = 100.0 * self.solved();
        let iterations = self.iterations();
        format!("{median:>8.0} {high:>7.0} {iterations:>5.1} {solved:>5.0}%")
    }

    fn summary(&self) -> serde_json::Value {
        json!({
            "median_us": self.percentile(50),
            "p99_us": self.percentile(99),
            "iterations": self.iterations(),
            "solved": self.solved(),
        })
    }
}
