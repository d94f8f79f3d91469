//! `pilotfish identify`: the craft that a log shows.

use std::{error::Error, fmt::Write as _, path::PathBuf};

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
#[error("cannot use {path}")]
struct NoLog {
    path: PathBuf,
    source: LogFileError,
}

/// Prints what the log shows and what it does not, and keeps craft file and page where asked to.
pub(crate) fn identify(arguments: &Identify) -> Result<(), Box<dyn Error>> {
    // Before the fit: a file that cannot be written should not cost one.
    let [craft_file, page_file] = [&arguments.craft, &arguments.report].map(|path| {
        let file = path
            .as_deref()
            .map(|path| OutFile::new(path, "choose another file"));
        file.transpose()
    });
    let (craft_file, page_file) = (craft_file?, page_file?);
    let log = read(&arguments.log).map_err(|source| NoLog {
        path: arguments.log.clone(),
        source,
    })?;
    let found = identify::identify(&log);
    let craft = serde_json::to_string_pretty(&Craft::from(&found.description())).expect("a craft is JSON");
    if let Some(file) = craft_file {
        file.write_text(&(craft + "\n"))?;
    }
    let name = arguments.log.file_name().unwrap_or(arguments.log.as_os_str());
    if let Some(file) = page_file {
        file.write_text(&page(&name.to_string_lossy(), &found))?;
    }
    Ok(print(&summary(&found))?)
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
