//! `pilotfish figures`: the source paper's figures as files.

use std::{error::Error, fmt::Write as _, path::PathBuf};

use clap::Args;
use lab::figures::{PaperMissions, draw, gallery, stated, table};

use super::{
    files::OTHER_DIRECTORY,
    progress::{bar, show},
};
use crate::cli::out_file::{OutFile, directory, print};

#[derive(Debug, Args)]
pub(crate) struct Figures {
    /// Directory for the pictures and `index.html`, which shows them; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed of the starting positions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End every mission after this many seconds, if it is not over before.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..))]
    duration_s: Option<u32>,
}

/// Flies the paper's missions, writes its figures, and prints its numbers beside the measured ones.
pub(crate) fn figures(arguments: &Figures) -> Result<(), Box<dyn Error>> {
    // Before the missions: a directory that cannot be written should not cost them.
    directory(&arguments.out, OTHER_DIRECTORY)?;
    let index = arguments.out.join("index.html");
    OutFile::new(&index, OTHER_DIRECTORY)?;

    let bar = bar();
    let duration_max = arguments.duration_s.map_or(f64::INFINITY, f64::from);
    let missions = PaperMissions::fly(arguments.seed, duration_max, &mut |scenario, done| {
        show(&bar, scenario, done);
    })?;
    bar.finish_and_clear();

    let (figures, rows) = (draw(&missions), stated(&missions));
    let mut files: Vec<(PathBuf, String)> = figures
        .iter()
        .map(|figure| (arguments.out.join(figure.file_name()), figure.svg.clone()))
        .collect();
    // Last: where it is, so is what it shows.
    files.push((index, gallery(&figures, &rows)));
    let mut written = String::new();
    for (path, text) in files {
        OutFile::new(&path, OTHER_DIRECTORY)?.write_text(&text)?;
        writeln!(written, "{}", path.display()).expect("a string takes everything");
    }
    Ok(print(&format!("{written}\n{}", table(&rows)))?)
}
