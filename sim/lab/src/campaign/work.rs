//! A campaign as pieces of work that any machine can do, with results as bytes.
//!
//! [`run()`](super::run()) flies a campaign in one process. A program with many machines sends them
//! [`Work`] and keeps each result under [`Work::name`].

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::design::{Campaign, Chunk, Run};
use super::directory::{Directory, DirectoryError, Manifest};
use super::fly::{RunGains, bound, no_rows, result};
use super::queue::in_parallel;
use super::rows::{Rows, RunRow};
use super::tune::{Tuned, gains_of, tune, tuned_in};
use crate::http_guide::NoGuidance;

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Work {
    /// Tune one law in one case.
    Tune {
        /// The case's number.
        case: usize,
        /// The controller's number.
        controller: usize,
    },
    /// Fly a chunk; needs the gains of its case.
    Fly {
        /// The chunk's number.
        chunk: u64,
    },
}

/// A piece of work cannot be done.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum WorkError {
    #[error("the campaign has no {0:?}")]
    NotOfCampaign(Work),
    #[error("gains of the chunk's laws are missing or damaged")]
    NoGains,
    #[error(transparent)]
    Guide(#[from] NoGuidance),
    #[error("rows cannot be written")]
    Rows(#[from] record::ExportError),
}

impl Work {
    /// The name of its result.
    pub fn name(self) -> String {
        match self {
            Self::Tune { case, controller } => format!("gains/{case}-{controller}"),
            Self::Fly { chunk } => format!("chunks/{chunk}"),
        }
    }

    /// The work that must be done before the chunks of `case`.
    pub fn before(campaign: &Campaign, case: usize) -> Vec<Self> {
        let laws = tuned_in(campaign, case).into_iter();
        laws.map(|controller| Self::Tune { case, controller }).collect()
    }

    /// The chunks of `case`.
    pub fn chunks(campaign: &Campaign, case: usize) -> Vec<Self> {
        let chunks = campaign.chunks().into_iter().filter(|chunk| chunk.case == case);
        chunks.map(|chunk| Self::Fly { chunk: chunk.number }).collect()
    }

    /// Its case; none if it belongs to another campaign.
    pub fn case(self, campaign: &Campaign) -> Option<usize> {
        match self {
            Self::Tune { case, .. } => (case < campaign.cases.len()).then_some(case),
            Self::Fly { chunk } => Some(campaign.chunk(chunk)?.case),
        }
    }

    /// Does it. `before` holds the results of [`Self::before`] in order; tuning needs none.
    pub fn done(
        self,
        campaign: &Campaign,
        manifest: &Manifest,
        before: &[Vec<u8>],
    ) -> Result<Vec<u8>, WorkError> {
        match self {
            Self::Tune { case, controller } => {
                if self.case(campaign).is_none() || !tuned_in(campaign, case).contains(&controller) {
                    return Err(WorkError::NotOfCampaign(self));
                }
                let tuned = tune(campaign, case, controller, &mut |_| {});
                Ok(serde_json::to_vec(&tuned).expect("texts and numbers only"))
            }
            Self::Fly { chunk } => {
                let chunk = campaign.chunk(chunk).ok_or(WorkError::NotOfCampaign(self))?;
                let tuned = before.iter().map(|bytes| serde_json::from_slice(bytes).ok());
                let tuned: Option<Vec<Tuned>> = tuned.collect();
                let is_whole = |tuned: &Vec<Tuned>| tuned.len() == tuned_in(campaign, chunk.case).len();
                let gains = tuned.filter(is_whole).ok_or(WorkError::NoGains)?;
                let rows = flown(campaign, chunk, &gains, NonZeroUsize::MIN)?;
                let mut bytes = vec![];
                rows.write(&manifest.about(), &mut bytes)?;
                Ok(bytes)
            }
        }
    }
}

impl Directory {
    /// Stores the result of work that was done elsewhere.
    pub fn store_work(&self, work: Work, bytes: &[u8]) -> Result<(), DirectoryError> {
        self.store_bytes(&work.name(), bytes)
    }
}

/// Flies the runs of a chunk with its case's gains, except those that an earlier run represents.
pub(super) fn flown(
    campaign: &Campaign,
    chunk: Chunk,
    gains: &[Tuned],
    threads: NonZeroUsize,
) -> Result<Rows, NoGuidance> {
    let mut rows: Vec<RunRow> = vec![];
    for condition in chunk.conditions() {
        let with_gains = |run: Run| Some((run, gains_of(run, campaign, gains)?));
        let runs = campaign.runs_in(condition).into_iter().filter_map(with_gains);
        let runs: Vec<(Run, RunGains)> = runs.collect();
        let bound_rms_m = bound(campaign, condition);
        let fly = |(run, gains): &(Run, RunGains)| result(campaign, *run, gains, bound_rms_m);
        rows.extend(in_parallel(&runs, threads, fly, &mut |_, _| {})?);
    }
    if rows.is_empty() {
        return Ok(no_rows(campaign));
    }
    Ok(Rows::of(rows))
}
