//! `pilotfish replay`: makes every plan of a stored mission again, and compares the answers to the byte.

use std::{error::Error, path::Path};

use clap::Args;
use indicatif::ProgressBar;
use service::{
    missions::replay::{self, Replayed},
    store::EventReader,
};

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Replay {
    /// The mission's id.
    mission: String,
}

/// Why the plans were not compared, or are not the same.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotReplayed {
    #[error("there is no mission {0}; GET /v1/missions lists them")]
    Unknown(String),
    #[error("{n_different} of {n_plans} plans are not what was answered then, the first in event {first}")]
    Different {
        n_different: usize,
        n_plans: u64,
        first: u64,
    },
}

/// Prints how many plans came out the same.
pub(crate) fn replay(arguments: &Replay, data: &Path) -> Result<(), Box<dyn Error>> {
    let reader = EventReader::of(data)?;
    let bar = ProgressBar::new(0);
    let replayed = replay::replay(&reader, &arguments.mission, &mut |at, of| {
        bar.set_length(of);
        bar.set_position(at);
    })?;
    bar.finish_and_clear();
    let Some(replayed) = replayed else {
        return Err(NotReplayed::Unknown(arguments.mission.clone()).into());
    };
    let Replayed {
        events,
        equal,
        cut_short,
        different,
    } = replayed;
    let n_plans = equal + cut_short + different.len() as u64;
    print(&format!(
        "{}: {events} events, {n_plans} plans: {equal} equal to the byte, {} different, {cut_short} cut short by their \
         deadline and not compared\n",
        arguments.mission,
        different.len()
    ))?;
    match different.first() {
        None => Ok(()),
        Some(&first) => Err(NotReplayed::Different {
            n_different: different.len(),
            n_plans,
            first,
        }
        .into()),
    }
}
