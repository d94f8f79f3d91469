//! `pilotfish retention` and `pilotfish vacuum` free disk space while no service runs.

use std::{error::Error, fs, path::Path, time::Duration};

use clap::Args;
use clock::Clock;
use service::missions::retention::expire_order;
use store::{EventStore, FILE_NAME};

use crate::cli::{config::Config, out_file::print, progress::with_spinner};

#[derive(Debug, Args)]
pub(crate) struct Retain {
    /// Delete missions that ended more than this many days ago.
    #[arg(long, value_name = "DAYS")]
    days: u16,
    /// Only list them.
    #[arg(long)]
    dry_run: bool,
    /// Take this machine's clock as right, although it jumped while the log was watched.
    #[arg(long)]
    trust_clock: bool,
}

/// Least difference of clocks that is mentioned, s.
const NOTABLE: f64 = 3_600.0;

const DAY: Duration = Duration::from_hours(24);

pub(crate) fn retain(arguments: &Retain, config: &Config) -> Result<(), Box<dyn Error>> {
    let clock = Clock::machine();
    let store = match &config.store {
        Some(url) => EventStore::open_database(url, None, u64::MAX, &clock)?,
        None => EventStore::open(&config.data, &clock)?,
    };
    let runtime = runtime()?;
    if arguments.trust_clock && !arguments.dry_run {
        runtime.block_on(store.believe_clock())?;
    }
    let ahead_s = store.clock().clock_ahead_s();
    if NOTABLE < ahead_s.abs() && !arguments.trust_clock {
        eprintln!(
            "pilotfish: this machine's clock is {:.1} days ahead of the time that the log has seen pass, by which missions are \
             old; if the clock is right, add --trust-clock",
            ahead_s / DAY.as_secs_f64()
        );
    }
    let kept = DAY * u32::from(arguments.days);
    let now_s = if arguments.trust_clock { clock.unix_s() } else { store.clock().now_s() };
    let until = now_s - kept.as_secs_f64();
    let over = store.reader()?.over_before(until)?;
    for id in &over {
        print(&format!("{id}\n"))?;
    }
    if arguments.dry_run {
        return Ok(());
    }
    runtime.block_on(async {
        for id in &over {
            store.delete(id.clone(), expire_order(&clock)).await?;
        }
        store.close().await
    })?;
    let next = match &config.store {
        Some(_) => "services that run return their disk space",
        None => "`pilotfish vacuum` returns their disk space",
    };
    print(&format!("{} missions deleted; {next}\n", over.len()))?;
    Ok(())
}

pub(crate) fn vacuum(data: &Path) -> Result<(), Box<dyn Error>> {
    let size = || fs::metadata(data.join(FILE_NAME)).map_or(0, |file| file.len());
    let store = EventStore::open(data, &Clock::machine())?;
    let before = size();
    let runtime = runtime()?;
    with_spinner("rewriting the mission log", || {
        runtime.block_on(async {
            store.vacuum().await?;
            store.close().await
        })
    })?;
    print(&format!("{before} bytes before, {} bytes now\n", size()))?;
    Ok(())
}

fn runtime() -> std::io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread().build()
}
