//! `pilotfish retention` and `pilotfish vacuum`: what makes room, while no service runs.

use std::{error::Error, fs, path::Path, time::Duration};

use clap::Args;
use indicatif::ProgressBar;
use service::{
    missions::retention::{expire_order, over_for},
    store::{EventStore, FILE_NAME},
};

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Retain {
    /// Delete the missions that have been over for so many days.
    #[arg(long, value_name = "DAYS")]
    days: u16,
    /// Only say which.
    #[arg(long)]
    dry_run: bool,
}

/// Deletes missions of the log in `data` that have been over for too long.
pub(crate) fn retain(arguments: &Retain, data: &Path) -> Result<(), Box<dyn Error>> {
    let store = EventStore::open(data)?;
    let over = over_for(
        &store.reader()?,
        Duration::from_hours(24) * u32::from(arguments.days),
    )?;
    for id in &over {
        print(&format!("{id}\n"))?;
    }
    if arguments.dry_run {
        return Ok(());
    }
    runtime()?.block_on(async {
        for id in &over {
            store.delete(id.clone(), expire_order()).await?;
        }
        store.close().await
    })?;
    print(&format!(
        "{} missions deleted; pilotfish vacuum gives their room back\n",
        over.len()
    ))?;
    Ok(())
}

/// Gives the room of what was deleted back to the disk.
pub(crate) fn vacuum(data: &Path) -> Result<(), Box<dyn Error>> {
    let size = || fs::metadata(data.join(FILE_NAME)).map_or(0, |file| file.len());
    let store = EventStore::open(data)?;
    let before = size();
    let spinner = ProgressBar::new_spinner().with_message("writing the mission log anew");
    spinner.enable_steady_tick(Duration::from_millis(100));
    let vacuumed = runtime()?.block_on(async {
        store.vacuum().await?;
        store.close().await
    });
    spinner.finish_and_clear();
    vacuumed?;
    print(&format!("{before} bytes before, {} now\n", size()))?;
    Ok(())
}

fn runtime() -> std::io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread().build()
}
