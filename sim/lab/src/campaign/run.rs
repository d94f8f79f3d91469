//! Flies what is left of a campaign, on several threads.

use std::{num::NonZeroUsize, sync::Mutex};

use super::{
    chunk::{Part, Parts, Piece},
    design::{Campaign, Chunk},
    directory::{Directory, DirectoryError},
    rows::Rows,
    tune::{Gains, tune, tuned_in},
    work::Work,
};
use queue::in_parallel;

pub(super) mod queue;

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

/// Flies the runs of `campaign` that `directory` lacks, `jobs` at a time, and collects all rows. Equal campaigns give equal rows, with
/// any number of threads and interruptions.
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
    let left: Vec<Chunk> = wanted
        .iter()
        .copied()
        .filter(|chunk| !done.contains(&chunk.number))
        .collect();
    let runs_of = |chunk: &Chunk| chunk.count * campaign.runs_per_condition(chunk.case);
    let mut state = Progress {
        runs: (
            wanted
                .iter()
                .filter(|chunk| done.contains(&chunk.number))
                .map(runs_of)
                .sum(),
            wanted.iter().map(runs_of).sum(),
        ),
        ..Progress::default()
    };
    progress(state);
    let mut note_tuned = |tuned| {
        state.tuned = tuned;
        progress(state);
    };
    let gains = found_gains(campaign, directory, &left, jobs, &mut note_tuned)?;
    // In pieces, so that no thread waits while another flies the rest of a chunk.
    let pieces: Vec<(usize, Piece)> = left
        .iter()
        .enumerate()
        .flat_map(|(k, chunk)| {
            Piece::all(campaign, *chunk)
                .into_iter()
                .map(move |piece| (k, piece))
        })
        .collect();
    let mut n_parts = vec![0; left.len()];
    for (k, _) in &pieces {
        n_parts[*k] += 1;
    }
    let parts: Vec<Mutex<Parts>> = left.iter().map(|_| Mutex::default()).collect();
    let fly_piece = |&(k, piece): &(usize, Piece)| -> Result<Counts, DirectoryError> {
        let part = piece.done(campaign, &gains[left[k].case])?;
        let flown = match &part {
            Part::Run(Some(row)) => Counts {
                runs: 1,
                failed: row.outcome.is_err().into(),
            },
            Part::Run(None) | Part::Bound(..) => Counts::default(),
        };
        let mut parts = parts[k].lock().expect("no piece panics while it holds a lock");
        if parts.add(part) == n_parts[k] {
            directory.store_chunk(left[k].number, &std::mem::take(&mut *parts).rows(campaign))?;
        }
        Ok(flown)
    };
    let mut note = |(_, piece): &(usize, Piece), outcome: &Result<Counts, DirectoryError>| {
        if let Ok(flown) = outcome {
            state.runs.0 += u64::from(matches!(piece, Piece::Fly(_)));
            state.flown += flown.runs;
            state.failed += flown.failed;
        }
        progress(state);
    };
    in_parallel(&pieces, jobs, fly_piece, &mut note)?;
    directory.collect(wanted, Rows::of(&[], &campaign.parameter_keys()))
}

/// Runs of a piece.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    runs: u64,
    failed: u64,
}

/// The gains of every case with chunks left, read from the directory or tuned now.
fn found_gains(
    campaign: &Campaign,
    directory: &Directory,
    left: &[Chunk],
    jobs: NonZeroUsize,
    progress: &mut (dyn FnMut((u64, u64)) + Send),
) -> Result<Vec<Gains>, DirectoryError> {
    let cases = (0..campaign.cases.len()).filter(|case| left.iter().any(|chunk| chunk.case == *case));
    let searches: Vec<(usize, usize)> = cases
        .flat_map(|case| {
            tuned_in(campaign, case)
                .into_iter()
                .map(move |controller| (case, controller))
        })
        .collect();
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
    let found = in_parallel(&searches, jobs, search, &mut |_,
                                                           outcome: &Result<
        _,
        DirectoryError,
    >| {
        done.0 += u64::from(outcome.is_ok());
        progress(done);
    })?;
    let mut gains = vec![Gains::default(); campaign.cases.len()];
    for ((case, _), tuned) in searches.iter().zip(found) {
        gains[*case].0.push(tuned);
    }
    Ok(gains)
}

/// The number of processors.
#[must_use]
pub fn jobs() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
