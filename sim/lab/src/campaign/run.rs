//! Flies the rest of a campaign on several threads.

use std::num::NonZeroUsize;

use super::design::{Campaign, Chunk};
use super::directory::{Directory, DirectoryError};
use super::fly::no_rows;
use super::queue::in_parallel;
use super::rows::Rows;
use super::tune::{Tuned, tune, tuned_in};
use super::work::{Work, flown};

/// Progress of a campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Tuned laws, and laws to tune.
    pub tuned: (u64, u64),
    /// Runs that are done, and the largest number of runs.
    pub runs: (u64, u64),
    /// Runs that this process flew.
    pub flown: u64,
    /// Missions that failed.
    pub failed: u64,
}

/// Flies the runs of `campaign` that `directory` lacks, `jobs` at a time, and collects all rows.
/// Neither threads nor interruptions change the rows.
pub fn run(
    campaign: &Campaign,
    directory: &Directory,
    jobs: NonZeroUsize,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Rows, DirectoryError> {
    if directory.is_collected()? {
        return directory.rows();
    }
    let all = campaign.chunks();
    let wanted = directory.manifest.shard.chunks(&all);
    let done = directory.chunks_done()?;
    let is_done = |chunk: &Chunk| done.contains(&chunk.number);
    let (stored, left): (Vec<Chunk>, Vec<Chunk>) = wanted.iter().copied().partition(is_done);
    let runs_of = |chunk: &Chunk| chunk.count * campaign.runs_per_condition(chunk.case);
    let mut state = Progress {
        runs: (stored.iter().map(runs_of).sum(), wanted.iter().map(runs_of).sum()),
        ..Progress::default()
    };
    let mut note_tuned = |tuned| {
        state.tuned = tuned;
        progress(state);
    };
    let gains = found_gains(campaign, directory, &left, jobs, &mut note_tuned)?;
    // Few chunks are flown one after the other, each by all threads.
    let (at_once, threads) =
        if jobs.get() <= left.len() { (jobs, NonZeroUsize::MIN) } else { (NonZeroUsize::MIN, jobs) };
    // Numbers of runs and of failed runs.
    let fly = |chunk: &Chunk| -> Result<(usize, usize), DirectoryError> {
        let rows = flown(campaign, *chunk, &gains[chunk.case], threads)?;
        directory.store_chunk(chunk.number, &rows)?;
        let failures = rows.words("failure").unwrap_or_default();
        Ok((rows.len(), failures.iter().filter(|why| !why.is_empty()).count()))
    };
    let mut note = |chunk: &Chunk, flown: &Result<(usize, usize), DirectoryError>| {
        if let Ok((runs, failed)) = *flown {
            state.runs.0 += runs_of(chunk);
            state.flown += runs as u64;
            state.failed += failed as u64;
        }
        progress(state);
    };
    in_parallel(&left, at_once, fly, &mut note)?;
    directory.collect(wanted, no_rows(campaign))
}

/// The gains of every case with chunks left, read from the directory or tuned now.
fn found_gains(
    campaign: &Campaign,
    directory: &Directory,
    left: &[Chunk],
    jobs: NonZeroUsize,
    progress: &mut (dyn FnMut((u64, u64)) + Send),
) -> Result<Vec<Vec<Tuned>>, DirectoryError> {
    let cases = (0..campaign.cases.len()).filter(|case| left.iter().any(|chunk| chunk.case == *case));
    let searches = cases.flat_map(|case| {
        let controllers = tuned_in(campaign, case).into_iter();
        controllers.map(move |controller| (case, controller))
    });
    let searches: Vec<(usize, usize)> = searches.collect();
    let mut done = (0, searches.len() as u64);
    progress(done);
    let search = |&(case, controller): &(usize, usize)| {
        if let Some(found) = directory.gains(case, controller) {
            return Ok(found);
        }
        let found = tune(campaign, case, controller, &mut |_| {});
        let json = serde_json::to_vec_pretty(&found).expect("texts and numbers only");
        directory.store_work(Work::Tune { case, controller }, &json)?;
        Ok(found)
    };
    let mut note = |_: &(usize, usize), outcome: &Result<Tuned, DirectoryError>| {
        done.0 += u64::from(outcome.is_ok());
        progress(done);
    };
    let found = in_parallel(&searches, jobs, search, &mut note)?;
    let mut gains = vec![vec![]; campaign.cases.len()];
    for ((case, _), tuned) in searches.iter().zip(found) {
        gains[*case].push(tuned);
    }
    Ok(gains)
}

/// The number of processors.
pub fn jobs() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
