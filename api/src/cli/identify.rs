//! `pilotfish identify`: the craft that a log shows.

use std::{
    fmt::Write as _,
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use clap::Args;
use lab::{
    identify::{self, Identification, digits, page},
    log_file::{LogFileError, read},
};
use wire::Craft;

use crate::cli::out_file::{OutFile, print};

#[derive(Debug, Args)]
pub(crate) struct Identify {
    /// A log of references and motion: .csv, .parquet or .mcap, columns as in docs/commissioning.md.
    log: PathBuf,
    /// Write the craft file here, to be sent as `craft` of a request.
    #[arg(long, value_name = "FILE.json")]
    craft: Option<PathBuf>,
    /// Write a page with parameters, residuals and what is missing.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// Why a log was not identified.
#[derive(Debug, thiserror::Error)]
pub(crate) enum IdentifyError {
    #[error("cannot use {path}")]
    Log { path: PathBuf, source: LogFileError },
    #[error("cannot write {path}: choose another file")]
    Out { path: PathBuf, source: io::Error },
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}

/// Prints what the log shows and what it does not, and keeps craft file and page where asked to.
pub(crate) fn identify(arguments: &Identify) -> Result<(), IdentifyError> {
    // Before the fit: a file that cannot be written should not cost one.
    let craft_file = out_file(arguments.craft.as_deref())?;
    let page_file = out_file(arguments.report.as_deref())?;
    let log = read(&arguments.log).map_err(|source| IdentifyError::Log {
        path: arguments.log.clone(),
        source,
    })?;
    let found = identify::identify(&log);
    let craft = serde_json::to_string_pretty(&Craft::from(&found.description())).expect("a craft is JSON");
    write(craft_file, &(craft + "\n"))?;
    let name = arguments.log.file_name().unwrap_or(arguments.log.as_os_str());
    write(page_file, &page(&name.to_string_lossy(), &found))?;
    Ok(print(&summary(&found))?)
}

fn out_file(path: Option<&Path>) -> Result<Option<(PathBuf, OutFile)>, IdentifyError> {
    let Some(path) = path else { return Ok(None) };
    let path = path.to_owned();
    match OutFile::new(&path) {
        Ok(file) => Ok(Some((path, file))),
        Err(source) => Err(IdentifyError::Out { path, source }),
    }
}

fn write(file: Option<(PathBuf, OutFile)>, text: &str) -> Result<(), IdentifyError> {
    let Some((path, file)) = file else { return Ok(()) };
    file.write(|out| out.write_all(text.as_bytes()))
        .map_err(|source| IdentifyError::Out { path, source })
}

fn summary(found: &Identification) -> String {
    let mut text = format!("{:<40}{:>10}   {}\n", "parameter", "estimate", "95 % interval");
    for parameter in &found.parameters {
        let remark = if parameter.identified {
            ""
        } else {
            "   not identified"
        };
        writeln!(
            text,
            "{:<40}{:>10}   {} to {}{remark}",
            parameter.quantity.name(),
            digits(parameter.estimate),
            digits(parameter.low),
            digits(parameter.high),
        )
        .expect("a string takes everything");
    }
    let craft = serde_json::to_value(Craft::from(&found.description())).expect("a craft is JSON");
    for name in ["speed_held", "heading_held"] {
        let word = craft[name].as_str().unwrap_or("open");
        writeln!(text, "{name:<40}{word:>10}").expect("a string takes everything");
    }
    for quantity in found.missing() {
        writeln!(text, "missing: {}: log {}", quantity.name(), quantity.manoeuvre())
            .expect("a string takes everything");
    }
    text
}
