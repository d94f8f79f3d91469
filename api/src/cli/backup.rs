//! `pilotfish backup`: copies the log of missions while a service writes to it.

use std::{
    error::Error,
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;
use indicatif::ProgressBar;
use service::store::EventReader;

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Backup {
    /// Directory for the copy, made if it is not there: `pilotfish serve --data` takes it as it is.
    to: PathBuf,
}

/// Copies everything that was acknowledged until now, and looks through the copy.
pub(crate) fn back_up(arguments: &Backup, data: &Path) -> Result<(), Box<dyn Error>> {
    let reader = EventReader::of(data)?;
    let spinner = ProgressBar::new_spinner().with_message("copying the mission log");
    spinner.enable_steady_tick(Duration::from_millis(100));
    let copied = reader.back_up(&arguments.to);
    spinner.finish_and_clear();
    copied?;
    print(&format!(
        "{} is a copy of {}, looked through: pilotfish serve --data {}\n",
        arguments.to.display(),
        data.display(),
        arguments.to.display()
    ))?;
    Ok(())
}
