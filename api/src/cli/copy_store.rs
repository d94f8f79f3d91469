//! `pilotfish copy-store`: moves the missions of a data directory to a database, or back.

use std::error::Error;

use clap::Args;
use clock::Clock;
use store::{Copied, StorePlace, copy};

use crate::cli::{out_file::print, progress::with_spinner};

#[derive(Debug, Args)]
pub(crate) struct CopyStore {
    /// The store of the missions: a data directory, or the postgres:// URL of a database.
    #[arg(long, value_name = "DIRECTORY|URL")]
    from: String,
    /// The other store, also a directory or a database: without missions, created if missing.
    #[arg(long, value_name = "DIRECTORY|URL")]
    to: String,
}

/// Copies all missions with their events, answers and orders.
pub(crate) fn copy_store(arguments: &CopyStore) -> Result<(), Box<dyn Error>> {
    let (from, to) = (place(&arguments.from), place(&arguments.to));
    let Copied { missions, events } =
        with_spinner("copying the mission log", || copy(&from, &to, &Clock::machine()))?;
    Ok(print(&format!("copied {missions} missions with {events} events; the source is as it was\n"))?)
}

fn place(text: &str) -> StorePlace {
    if text.contains("://") {
        StorePlace::Database(text.to_owned())
    } else {
        StorePlace::Directory(text.into())
    }
}
