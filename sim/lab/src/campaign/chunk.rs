//! The rows of a chunk.

use std::num::NonZeroUsize;

use super::{
    design::{Campaign, Chunk, Run},
    fly::{RunGains, bound, result},
    queue::in_parallel,
    rows::{Rows, RunResult},
    tune::Gains,
};
use crate::http_guide::NoGuidance;

/// Flies the runs of a chunk with its case's gains, except those that an earlier run represents.
pub(super) fn flown(
    campaign: &Campaign,
    chunk: Chunk,
    gains: &Gains,
    threads: NonZeroUsize,
) -> Result<Rows, NoGuidance> {
    let mut rows: Vec<RunResult> = vec![];
    for condition in chunk.conditions() {
        let with_gains = |run: Run| Some((run, gains.of_run(campaign, run.controller, run.objective)?));
        let runs: Vec<(Run, RunGains)> = campaign
            .runs_in(condition)
            .into_iter()
            .filter_map(with_gains)
            .collect();
        let fly = |(run, gains): &(Run, RunGains)| result(campaign, *run, gains);
        let flown = in_parallel(&runs, threads, fly, &mut |_, _| {})?;
        let bound_rms_m = bound(campaign, condition);
        rows.extend(flown.into_iter().map(|row| RunResult { bound_rms_m, ..row }));
    }
    Ok(Rows::of(&rows, &campaign.parameter_keys()))
}
