//! `pilotfish simulate --trial`: the log of a sea trial that a simulated craft made.

use std::{
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use lab::{
    log_file::write_csv,
    trial::{NoTrial, TrialSetup},
};

use crate::cli::{
    out_file::{OutFile, print},
    scenarios::{NoScenario, scenario},
};

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TrialError {
    #[error(transparent)]
    Scenario(#[from] NoScenario),
    #[error(transparent)]
    NoTrial(#[from] NoTrial),
    #[error("cannot write {path}: see --out in `pilotfish simulate --help`")]
    Out { path: PathBuf, source: io::Error },
    #[error("{0}: a trial's log is a .csv file")]
    Ending(PathBuf),
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}

/// Flies the trial of `craft`, and writes its log to every one of `paths`.
pub(crate) fn trial(craft: &str, seed: u64, paths: &[PathBuf]) -> Result<(), TrialError> {
    let files = paths.iter().map(|path| log_file(path));
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let setup = match craft {
        "medusa" => TrialSetup::medusa(),
        "otter" => TrialSetup::otter(),
        other => TrialSetup::of(&scenario(other)?, seed)?,
    };
    let rows = setup.fly(seed);
    for (path, file) in &files {
        let written = file.write(|out| {
            write_csv(&rows, out)?;
            out.flush()
        });
        written.map_err(|source| TrialError::Out {
            path: (*path).clone(),
            source,
        })?;
    }
    let minutes = setup.trial.duration() / 60.0;
    Ok(print(&format!(
        "{} rows, {minutes:.0} min of {craft}: try `pilotfish identify {}`\n",
        rows.len(),
        paths
            .first()
            .map(|path| path.display().to_string())
            .unwrap_or_default()
    ))?)
}

fn log_file(path: &PathBuf) -> Result<(&PathBuf, OutFile), TrialError> {
    let ending = Path::new(path).extension().and_then(|ending| ending.to_str());
    let file = OutFile::new(path).map_err(|source| TrialError::Out {
        path: path.clone(),
        source,
    })?;
    match ending {
        Some("csv") => Ok((path, file)),
        None if file.is_stream() => Ok((path, file)),
        Some(_) | None => Err(TrialError::Ending(path.clone())),
    }
}
