//! `pilotfish simulate --trial`: the log of a simulated sea trial.

use std::error::Error;
use std::path::{Path, PathBuf};

use lab::{log_file::write_csv, trial::TrialSetup};
use sim::surface_craft::SurfaceClass;

use crate::cli::out_file::{OutFile, print};
use crate::cli::scenarios::scenario;

/// Runs the trial of `craft`, and writes its log to each of `paths`.
pub(crate) fn trial(craft: &str, seed: u64, paths: &[PathBuf]) -> Result<(), Box<dyn Error>> {
    let files = paths.iter().map(|path| log_file(path)).collect::<Result<Vec<_>, _>>()?;
    let setup = match craft {
        "medusa" => TrialSetup::of_class(SurfaceClass::Medusa),
        "otter" => TrialSetup::of_class(SurfaceClass::Otter),
        other => TrialSetup::of(&scenario(other)?, seed)?,
    };
    let rows = setup.fly(seed);
    for file in &files {
        file.write(|out| write_csv(&rows, out))?;
    }
    let (n_rows, minutes, log) = (rows.len(), setup.trial.duration() / 60.0, paths[0].display());
    Ok(print(&format!("{n_rows} rows, {minutes:.0} min of {craft}; next: pilotfish identify {log}\n"))?)
}

fn log_file(path: &Path) -> Result<OutFile, Box<dyn Error>> {
    let file = OutFile::new(path)?;
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => Ok(file),
        None if file.is_stream() => Ok(file),
        Some(_) | None => Err(format!("{}: the log of a trial must be a .csv file", path.display()).into()),
    }
}
