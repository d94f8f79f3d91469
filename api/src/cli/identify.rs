//! `pilotfish identify`: a craft file from a log.

use std::{error::Error, path::PathBuf};

use clap::Args;
use lab::{
    identify::{self, page, summary},
    log_file::read,
};

use crate::cli::failure::because_of;
use crate::cli::out_file::{OutFile, print};

#[derive(Debug, Args)]
pub(crate) struct Identify {
    /// A log of references and motion: .csv, .parquet or .mcap, with the columns of
    /// docs/commissioning.md.
    log: PathBuf,
    /// Write the craft file here; send it as `craft` of a request.
    #[arg(long, value_name = "FILE.json")]
    craft: Option<PathBuf>,
    /// Write a page with the parameters, the residuals, and the manoeuvres that the log lacks.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// Prints the identified and the missing parameters; writes craft file and page if asked to.
pub(crate) fn identify(arguments: &Identify) -> Result<(), Box<dyn Error>> {
    // Before the fit, so that a file that cannot be written does not waste it.
    let craft_file = arguments.craft.as_deref().map(OutFile::new).transpose()?;
    let page_file = arguments.report.as_deref().map(OutFile::new).transpose()?;
    let log = read(&arguments.log);
    let log = log.map_err(because_of(format!("cannot use {}", arguments.log.display())))?;
    let found = identify::identify(&log);
    let craft = serde_json::to_string_pretty(&found.description()).expect("a craft is JSON");
    if let Some(file) = craft_file {
        file.write_text(&(craft + "\n"))?;
    }
    let name = arguments.log.file_name().unwrap_or(arguments.log.as_os_str());
    if let Some(file) = page_file {
        file.write_text(&page(&name.to_string_lossy(), &found))?;
    }
    Ok(print(&summary(&found))?)
}
