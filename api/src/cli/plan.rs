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
    out_file::{NotPrinted, OutFile, print},
};

/// Stands for standard input, as everywhere.
const STANDARD_INPUT: &str = "-";

#[derive(Debug, Args)]
pub(crate) struct Plan {
    /// A snapshot, as `POST /v1/plan` takes it; `-` is standard input.
    #[arg(default_value = STANDARD_INPUT)]
    file: PathBuf,
    #[command(flatten)]
    craft: DeclaredCraft,
    /// Print the answer in one line, as the service does.
    #[arg(long)]
    compact: bool,
    /// Write the last program that was solved, and its solution, to this file, as JSON for other solvers.
    #[arg(long, value_name = "FILE.json")]
    dump: Option<PathBuf>,
    /// Tolerance of the solver, from 1e-10 to 1e-3.
    #[arg(long, default_value_t = TOLERANCE, value_parser = tolerance)]
    tolerance: f64,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let given: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // Tighter, rounding decides; wider, the certificate refuses.
    if (1e-10..=1e-3).contains(&given) {
        Ok(given)
    } else {
        Err("not from 1e-10 to 1e-3".to_owned())
    }
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
enum PlanError {
    #[error("cannot read {path}")]
    Read { path: PathBuf, source: io::Error },
    #[error("no program was solved, so there is nothing to write to {0}")]
    NothingToDump(PathBuf),
    /// The problem document has been printed where the answer would have been.
    #[error("{}", .0.detail)]
    Refused(Box<ProblemDocument>),
}

/// Prints the answer, or the problem document that the service would have sent.
pub(crate) fn plan(arguments: &Plan) -> Result<(), Box<dyn Error>> {
    let body = read(&arguments.file).map_err(|source| PlanError::Read {
        path: arguments.file.clone(),
        source,
    })?;
    let body = match arguments.craft.json()? {
        Some(craft) => with_craft(body, craft),
        None => body,
    };
    let dump = arguments.dump.as_deref();
    let dump = dump.map(|path| OutFile::new(path, "choose another file with --dump"));
    let dump = dump.transpose()?;
    let mut last = None;
    let answer = offline::plan(&body, arguments.tolerance, &mut |program, solution| {
        if dump.is_some() {
            last = Some(program_dump(program, solution));
        }
    });
    match answer {
        Ok(answer) => print_json(&answer, arguments.compact)?,
        Err(problem) => {
            let document = problem.document(&arguments.file.to_string_lossy(), "pilotfish-plan");
            print_json(&document, arguments.compact)?;
            return Err(PlanError::Refused(Box::new(document)).into());
        }
    }
    let Some(file) = dump else { return Ok(()) };
    let last = last.ok_or_else(|| PlanError::NothingToDump(file.name.clone()))?;
    Ok(file.write_text(&format!("{last}\n"))?)
}

/// The snapshot, with that `craft`. What is no JSON object is left as it is: the planner says what is wrong with it.
fn with_craft(body: Vec<u8>, craft: Value) -> Vec<u8> {
    match serde_json::from_slice(&body) {
        Ok(Value::Object(mut snapshot)) => {
            snapshot.insert("craft".to_owned(), craft);
            Value::Object(snapshot).to_string().into_bytes()
        }
        Ok(_) | Err(_) => body,
    }
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    if path != Path::new(STANDARD_INPUT) {
        return fs::read(path);
    }
    let mut body = Vec::new();
    io::stdin().read_to_end(&mut body)?;
    Ok(body)
}

fn print_json(value: &impl Serialize, compact: bool) -> Result<(), NotPrinted> {
    let json = if compact {
        serde_json::to_string(value)
    } else {
        serde_json::to_string_pretty(value)
    };
    print(&(json.expect("strings, numbers and lists only") + "\n"))
}
