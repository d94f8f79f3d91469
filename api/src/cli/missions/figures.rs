//! `pilotfish figures`: the source paper's figures as a page.

use std::{error::Error, path::PathBuf};

use clap::Args;
use lab::figures::{PaperMissions, page};

use crate::cli::{
    out_file::{OutFile, print},
    progress::{bar, show},
};

#[derive(Debug, Args)]
pub(crate) struct Figures {
    /// File for the page.
    #[arg(long, value_name = "FILE.html")]
    out: PathBuf,
    /// Seed of the starting positions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End each mission after at most this many seconds.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..))]
    duration_s: Option<u32>,
}

/// Simulates the paper's missions, writes its figures, and prints its numbers beside the simulated ones.
pub(crate) fn figures(arguments: &Figures) -> Result<(), Box<dyn Error>> {
    // Before the missions, so that a file that cannot be written does not waste them.
    let file = OutFile::new(&arguments.out)?;
    let bar = bar();
    let duration_max = arguments.duration_s.map_or(f64::INFINITY, f64::from);
    let missions = PaperMissions::fly(arguments.seed, duration_max, &mut |scenario, done| {
        show(&bar, scenario, done);
    })?;
    bar.finish_and_clear();
    let (page, numbers) = page(&missions);
    file.write_text(&page)?;
    Ok(print(&numbers)?)
}
