//! The time of one SCP iteration's subproblem by the planner's updated solver.
//!
//! ```text
//! cargo bench -p tests --bench solvers -- [--rounds N] [--dump DIR]
//! ```
//! The time is that of a further SCP iteration whose program is stated: replacing the numbers,
//! solving, copying the solution out. `--dump` writes programs, solutions and `times.json` for
//! other solvers, Clarabel as it comes among them: `tests/python/solvers.py`.

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser as _;
use planner::parameters::Parameters;
use planner::plan::{Programs, plan_with};
use planner::program::Program;
use planner::snapshot::Acoustics;
use planner::solve::{Solution, SolverStatus, Solvers};
use serde_json::json;
use tests::{goals, observation, snapshot};
use wire::program_dump;

/// Programs of a horizon: enough that none is a special case, and few enough for the cache.
const N_SCENES: u32 = 40;
/// Interval of horizons with equal steps, s: the middle one of the default horizon.
const INTERVAL: f64 = 2.0;
/// Acoustic range, m: a little more than half the AUVs' distance, so that it binds some plans.
const RANGE: f64 = 36.0;

fn main() {
    let arguments = Arguments::parse();
    println!(
        "median and 99th percentile of {} solves, µs; iterations of the mean solve\n\n\
         horizon    N  vars  rows |   median     p99 iter.",
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

/// The first program of a plan over `steps`. Scene number `i` has the craft at another place beside
/// the midpoint of two AUVs 60 m apart.
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
    durations: Vec<Duration>,
    iterations: u32,
    /// Program by program.
    solutions: Vec<Solution>,
}

impl Measured {
    fn over(programs: &[Program], rounds: usize) -> Self {
        let mut solvers = Solvers::default();
        // This also warms up.
        let solutions: Vec<_> = programs.iter().map(|program| solvers.solve(program)).collect();
        let (mut durations, mut iterations) = (vec![], 0);
        for program in (0..rounds).flat_map(|_| programs) {
            let start = Instant::now();
            let solution = solvers.solve(program);
            durations.push(start.elapsed());
            iterations += solution.iterations;
            assert_eq!(solution.status, SolverStatus::Solved);
        }
        durations.sort_unstable();
        Self { durations, iterations, solutions }
    }

    /// The percentile of solve times, µs.
    fn percentile(&self, percent: usize) -> f64 {
        1e6 * self.durations[(self.durations.len() - 1) * percent / 100].as_secs_f64()
    }

    /// Iterations of the mean solve.
    fn iterations(&self) -> f64 {
        f64::from(self.iterations) / self.durations.len() as f64
    }

    fn print(&self, name: &str, program: &Program) {
        println!(
            "{name:>8} {:>4} {:>5} {:>5} | {:>8.0} {:>7.0} {:>5.1}",
            program.layout.n_stages,
            program.layout.n_variables(),
            program.layout.n_rows(),
            self.percentile(50),
            self.percentile(99),
            self.iterations(),
        );
    }

    fn summary(&self, program: &Program) -> serde_json::Value {
        json!({
            "n_stages": program.layout.n_stages,
            "n_variables": program.layout.n_variables(),
            "n_rows": program.layout.n_rows(),
            "median_us": self.percentile(50),
            "p99_us": self.percentile(99),
            "iterations": self.iterations(),
        })
    }

    fn dump(&self, folder: &Path, name: &str, programs: &[Program]) {
        for (i, (program, solution)) in programs.iter().zip(&self.solutions).enumerate() {
            let text = program_dump(program, solution).to_string();
            write(folder, &format!("{name}-{i:02}.json"), &text);
        }
    }
}
