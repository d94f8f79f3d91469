//! `pilotfish replay`: recomputes every plan of a stored mission, and compares the bytes.

use std::error::Error;

use clap::Args;
use indicatif::ProgressBar;
use service::missions::replay::{self, Replayed};
use store::EventReader;

use crate::cli::{config::Config, out_file::print};

#[derive(Debug, Args)]
pub(crate) struct Replay {
    /// The mission's id.
    mission: String,
}

/// Prints the number of equal plans.
pub(crate) fn replay(arguments: &Replay, config: &Config) -> Result<(), Box<dyn Error>> {
    let reader = match &config.store {
        Some(url) => EventReader::of_database(url)?,
        None => EventReader::of(&config.data)?,
    };
    let bar = ProgressBar::new(0);
    let replayed = replay::replay(&reader, &arguments.mission, &mut |at, of| {
        bar.set_length(of);
        bar.set_position(at);
    })?;
    bar.finish_and_clear();
    let mission = &arguments.mission;
    let Some(replayed) = replayed else {
        return Err(format!("unknown mission {mission}; GET /v1/missions lists all").into());
    };
    let Replayed { events, equal, cut_short, different } = replayed;
    let n_different = different.len();
    let n_plans = equal + cut_short + n_different as u64;
    print(&format!(
        "{mission}: {events} events, {n_plans} plans: {equal} equal byte for byte, {n_different} different, {cut_short} not \
         compared because their deadline cut them short\n"
    ))?;
    let Some(first) = different.first() else {
        return Ok(());
    };
    Err(format!("{n_different} of {n_plans} plans differ from the stored answers, first in event {first}")
        .into())
}
