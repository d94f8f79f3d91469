//! `pilotfish plan`: one snapshot, one answer, no server.

use std::{
    error::Error,
    fs,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use clap::Args;
use planner::solve::TOLERANCE;
use serde::Serialize;
use serde_json::Value;
use service::{offline, problem::ProblemDocument};
use wire::program_dump;

use crate::cli::{
    declared_craft::DeclaredCraft,
    declared_routes::{DeclaredRoutes, NoRoute},
    out_file::{NotPrinted, OutFile, print, print_json},
};

/// The name of standard input.
const STANDARD_INPUT: &str = "-";

#[derive(Debug, Args)]
pub(crate) struct Plan {
    /// A snapshot, as in `POST /v1/plan`; `-` is standard input.
    #[arg(default_value = STANDARD_INPUT)]
    file: PathBuf,
    #[command(flatten)]
    craft: DeclaredCraft,
    #[command(flatten)]
    routes: DeclaredRoutes,
    /// Print the answer on one line.
    #[arg(long)]
    compact: bool,
    /// Write the last program and its solution to this file, as JSON for other solvers.
    #[arg(long, value_name = "FILE.json")]
    dump: Option<PathBuf>,
    /// Tolerance of the solver, from 1e-10 to 1e-3.
    #[arg(long, default_value_t = TOLERANCE, value_parser = tolerance)]
    tolerance: f64,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let given: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // Below, rounding decides; above, the certificate refuses.
    if (1e-10..=1e-3).contains(&given) {
        Ok(given)
    } else {
        Err("must be from 1e-10 to 1e-3".to_owned())
    }
}

/// There is no plan.
#[derive(Debug, thiserror::Error)]
enum PlanError {
    #[error("cannot read {path}")]
    Read { path: PathBuf, source: io::Error },
    #[error("no program was solved: {0} is not written")]
    NothingToDump(PathBuf),
    /// The problem document was printed instead of the answer.
    #[error("{}", .0.detail)]
    Refused(Box<ProblemDocument>),
}

/// Prints the answer, or the problem document that the service would send.
pub(crate) fn plan(arguments: &Plan) -> Result<(), Box<dyn Error>> {
    let body = read(&arguments.file).map_err(|source| PlanError::Read {
        path: arguments.file.clone(),
        source,
    })?;
    let body = match arguments.craft.json()? {
        Some(craft) => with_craft(body, craft),
        None => body,
    };
    let body = with_routes(body, &arguments.routes)?;
    let dump = arguments.dump.as_deref().map(OutFile::new).transpose()?;
    let mut last = None;
    let answer = offline::plan(&body, arguments.tolerance, &mut |program, solution| {
        if dump.is_some() {
            last = Some(program_dump(program, solution));
        }
    });
    match answer {
        Ok(answer) => print_answer(&answer, arguments.compact)?,
        Err(problem) => {
            let document = problem.document(&arguments.file.to_string_lossy(), "pilotfish-plan");
            print_answer(&document, arguments.compact)?;
            return Err(PlanError::Refused(Box::new(document)).into());
        }
    }
    let Some(file) = dump else { return Ok(()) };
    let last = last.ok_or_else(|| PlanError::NothingToDump(file.name.clone()))?;
    Ok(file.write_text(&format!("{last}\n"))?)
}

/// The snapshot with this `craft`. The planner reports other bodies than JSON objects.
fn with_craft(body: Vec<u8>, craft: Value) -> Vec<u8> {
    match serde_json::from_slice(&body) {
        Ok(Value::Object(mut snapshot)) => {
            snapshot.insert("craft".to_owned(), craft);
            Value::Object(snapshot).to_string().into_bytes()
        }
        Ok(_) | Err(_) => body,
    }
}

/// The snapshot with these `routes`. The planner reports other bodies than JSON objects.
fn with_routes(body: Vec<u8>, routes: &DeclaredRoutes) -> Result<Vec<u8>, NoRoute> {
    if routes.is_empty() {
        return Ok(body);
    }
    let Ok(mut snapshot) = serde_json::from_slice(&body) else {
        return Ok(body);
    };
    routes.put_into(&mut snapshot)?;
    Ok(snapshot.to_string().into_bytes())
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    if path != Path::new(STANDARD_INPUT) {
        return fs::read(path);
    }
    let mut body = Vec::new();
    io::stdin().read_to_end(&mut body)?;
    Ok(body)
}

fn print_answer(answer: &impl Serialize, compact: bool) -> Result<(), NotPrinted> {
    if !compact {
        return print_json(answer);
    }
    let line = serde_json::to_string(answer).expect("strings, numbers and lists only");
    print(&(line + "\n"))
}
