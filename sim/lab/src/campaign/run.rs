//! Does what is left to be done of a campaign, on several threads.

use std::{num::NonZeroUsize, sync::Mutex};

use super::{
    chunk::{Part, Parts, Piece},
    design::{Campaign, Chunk, World},
    directory::{Directory, DirectoryError},
    fly::{GoOn, Stopped, TO_THE_END},
    rows::Rows,
    tune::{Gains, tune, tuned_in},
};
use queue::in_parallel;

pub(super) mod queue;

/// How far a campaign is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Laws whose gains are found, and that are to be found.
    pub tuned: (u64, u64),
    /// Runs that are done, at most this many of all.
    pub runs: (u64, u64),
    /// Runs of this process.
    pub flown: u64,
    /// Missions that failed.
    pub failed: u64,
}

/// What watches a campaign that is flown.
pub struct Watch<'a> {
    /// Hears how far it is.
    pub progress: &'a mut (dyn FnMut(Progress) + Send),
    /// Says whether to go on.
    pub go_on: GoOn<'a>,
}

/// Why a campaign was not flown to its end.
#[derive(Debug, thiserror::Error)]
pub enum Unflown {
    /// It was stopped. What was done by then is kept.
    #[error("the campaign was stopped")]
    Stopped,
    /// Its directory is of no use.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
}

impl From<Stopped> for Unflown {
    fn from(_: Stopped) -> Self {
        Self::Stopped
    }
}

/// Flies what is missing in `directory` of `campaign`, `jobs` runs at once, and puts all rows together. Equal campaigns give equal
/// rows, on any number of threads and however often they are interrupted.
pub fn run(
    campaign: &Campaign,
    directory: &Directory,
    jobs: NonZeroUsize,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Rows, DirectoryError> {
    let watch = Watch {
        progress,
        go_on: TO_THE_END,
    };
    run_watched(campaign, directory, jobs, watch).map_err(|unflown| match unflown {
        Unflown::Stopped => unreachable!("nothing stops it"),
        Unflown::Directory(error) => error,
    })
}

/// As [`run()`], until `watch` says to stop: at once, between two plans of the missions that are in the air.
pub fn run_watched(
    campaign: &Campaign,
    directory: &Directory,
    jobs: NonZeroUsize,
    Watch { progress, go_on }: Watch<'_>,
) -> Result<Rows, Unflown> {
    if directory.is_collected() {
        return Ok(directory.rows()?);
    }
    let all = campaign.chunks();
    let wanted = directory.manifest.shard.chunks(&all);
    let done = directory.chunks_done()?;
    let left: Vec<Chunk> = wanted
        .iter()
        .copied()
        .filter(|chunk| !done.contains(&chunk.number))
        .collect();
    let runs_of = |chunk: &Chunk| {
        chunk.count
            * campaign
                .runs_in(World {
                    arena: chunk.arena,
                    replicate: 0,
                    tuning: false,
                })
                .len() as u64
    };
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
    let watch = (&mut note_tuned as &mut (dyn FnMut((u64, u64)) + Send), go_on);
    let gains = found_gains(campaign, directory, &left, jobs, watch)?;
    // Piece by piece, so that no thread waits while another one flies the rest of a chunk.
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
    let fly_piece = |&(k, piece): &(usize, Piece)| -> Result<Flown, Unflown> {
        let part = piece.done(campaign, &gains[left[k].arena], go_on)?;
        let flown = match &part {
            Part::Row(Some(row)) => Flown {
                runs: 1,
                failed: row.outcome.is_err().into(),
            },
            Part::Row(None) | Part::Bound(..) => Flown::default(),
        };
        let mut parts = parts[k].lock().expect("no piece panics while it holds a lock");
        if parts.keep(part) == n_parts[k] {
            directory.keep_chunk(left[k].number, &std::mem::take(&mut *parts).rows(campaign))?;
        }
        Ok(flown)
    };
    let mut note = |(_, piece): &(usize, Piece), outcome: &Result<Flown, Unflown>| {
        if let Ok(flown) = outcome {
            state.runs.0 += u64::from(matches!(piece, Piece::Fly(_)));
            state.flown += flown.runs;
            state.failed += flown.failed;
        }
        progress(state);
    };
    in_parallel(&pieces, jobs, fly_piece, &mut note)?;
    Ok(directory.collect(wanted, Rows::of(&[], &campaign.parameter_keys()))?)
}

/// What a piece flew.
#[derive(Clone, Copy, Debug, Default)]
struct Flown {
    runs: u64,
    failed: u64,
}

/// The gains of every arena that has chunks left; those that were found before are read.
fn found_gains(
    campaign: &Campaign,
    directory: &Directory,
    left: &[Chunk],
    jobs: NonZeroUsize,
    (progress, go_on): (&mut (dyn FnMut((u64, u64)) + Send), GoOn<'_>),
) -> Result<Vec<Gains>, Unflown> {
    let arenas = (0..campaign.arenas.len()).filter(|arena| left.iter().any(|chunk| chunk.arena == *arena));
    let searches: Vec<(usize, usize)> = arenas
        .flat_map(|arena| {
            tuned_in(campaign, arena)
                .into_iter()
                .map(move |controller| (arena, controller))
        })
        .collect();
    let mut done = (0, searches.len() as u64);
    progress(done);
    let search = |&(arena, controller): &(usize, usize)| {
        if let Some(found) = directory.gains(arena, controller) {
            return Ok(found);
        }
        let found = tune(campaign, arena, controller, go_on)?;
        directory.keep_gains(arena, controller, &found)?;
        Ok(found)
    };
    let found = in_parallel(&searches, jobs, search, &mut |_, outcome: &Result<_, Unflown>| {
        done.0 += u64::from(outcome.is_ok());
        progress(done);
    })?;
    let mut gains = vec![Gains::default(); campaign.arenas.len()];
    for ((arena, _), tuned) in searches.iter().zip(found) {
        gains[*arena].0.push(tuned);
    }
    Ok(gains)
}

/// As many runs at once as there are processors.
#[must_use]
pub fn jobs() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
