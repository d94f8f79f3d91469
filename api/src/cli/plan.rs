//! `pilotfish plan`: one snapshot, one answer, no server.

use std::error::Error;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use clap::Args;
use planner::solve::TOLERANCE;
use serde::Serialize;
use serde_json::Value;
use service::offline;
use wire::program_dump;

use crate::cli::declared_areas::DeclaredAreas;
use crate::cli::declared_craft::DeclaredCraft;
use crate::cli::declared_routes::DeclaredRoutes;
use crate::cli::failure::{Failure, because_of};
use crate::cli::out_file::{OutFile, print, print_json};

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
    #[command(flatten)]
    areas: DeclaredAreas,
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

fn tolerance(text: &str) -> Result<f64, &'static str> {
    let given: f64 = text.parse().map_err(|_| "not a number")?;
    // Below, rounding decides; above, the certificate refuses.
    (1e-10..=1e-3).contains(&given).then_some(given).ok_or("must be from 1e-10 to 1e-3")
}

/// Prints the answer, or the problem document that the service would send.
pub(crate) fn plan(arguments: &Plan) -> Result<(), Box<dyn Error>> {
    let body = read(&arguments.file);
    let body = body.map_err(because_of(format!("cannot read {}", arguments.file.display())))?;
    let body = declared(body, arguments)?;
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
            return Err(document.detail.into());
        }
    }
    let Some(file) = dump else { return Ok(()) };
    let unsolved = || format!("no program was solved: {} is not written", file.name.display());
    let last = last.ok_or_else(unsolved)?;
    Ok(file.write_text(&format!("{last}\n"))?)
}

/// The snapshot in `body` with declared craft and routes. The planner reports other bodies.
fn declared(body: Vec<u8>, arguments: &Plan) -> Result<Vec<u8>, Box<dyn Error>> {
    let craft = arguments.craft.json()?;
    if craft.is_none() && arguments.routes.is_empty() && arguments.areas.is_empty() {
        return Ok(body);
    }
    let Ok(mut snapshot) = serde_json::from_slice::<Value>(&body) else {
        return Ok(body);
    };
    if let (Some(members), Some(craft)) = (snapshot.as_object_mut(), craft) {
        members.insert("craft".to_owned(), craft);
    }
    arguments.routes.put_into(&mut snapshot)?;
    arguments.areas.put_into(&mut snapshot)?;
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

fn print_answer(answer: &impl Serialize, compact: bool) -> Result<(), Failure> {
    if !compact {
        return print_json(answer);
    }
    let line = serde_json::to_string(answer).expect("strings, numbers and lists only");
    print(&(line + "\n"))
}
