//! A campaign as pieces of work that any machine can do, with results as bytes.
//!
//! [`run()`](super::run()) flies a campaign in one process. A program with many machines sends them
//! [`Work`] and keeps each result under [`Work::name`].

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::{
    chunk::flown,
    design::Campaign,
    directory::{Directory, DirectoryError, Manifest},
    tune::{Gains, Tuned, tune, tuned_in},
};
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
#[derive(Debug, thiserror::Error)]
pub enum WorkError {
    /// The work belongs to another campaign.
    #[error("the campaign has no {0:?}")]
    NotOfCampaign(Work),
    /// The gains of a chunk are missing.
    #[error("gains of the chunk's laws are missing or damaged")]
    NoGains,
    /// A law outside of this program is away.
    #[error(transparent)]
    Guide(#[from] NoGuidance),
    /// The result cannot be written.
    #[error("rows cannot be written")]
    Rows(#[from] record::ExportError),
}

impl Work {
    /// The name of its result.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Tune { case, controller } => format!("gains/{case}-{controller}"),
            Self::Fly { chunk } => format!("chunks/{chunk}"),
        }
    }

    /// The work that must be done before the chunks of `case`.
    #[must_use]
    pub fn before(campaign: &Campaign, case: usize) -> Vec<Self> {
        let laws = tuned_in(campaign, case).into_iter();
        laws.map(|controller| Self::Tune { case, controller }).collect()
    }

    /// The chunks of `case`.
    #[must_use]
    pub fn chunks(campaign: &Campaign, case: usize) -> Vec<Self> {
        let chunks = campaign.chunks().into_iter().filter(|chunk| chunk.case == case);
        chunks.map(|chunk| Self::Fly { chunk: chunk.number }).collect()
    }

    /// Its case; none if it belongs to another campaign.
    #[must_use]
    pub fn case(self, campaign: &Campaign) -> Option<usize> {
        match self {
            Self::Tune { case, .. } => (case < campaign.cases.len()).then_some(case),
            Self::Fly { chunk } => campaign
                .chunks()
                .into_iter()
                .find(|other| other.number == chunk)
                .map(|chunk| chunk.case),
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
                let chunks = campaign.chunks();
                let chunk = chunks
                    .iter()
                    .find(|other| other.number == chunk)
                    .ok_or(WorkError::NotOfCampaign(self))?;
                let tuned: Option<Vec<Tuned>> = before
                    .iter()
                    .map(|bytes| serde_json::from_slice(bytes).ok())
                    .collect();
                let tuned = tuned
                    .filter(|tuned| tuned.len() == tuned_in(campaign, chunk.case).len())
                    .ok_or(WorkError::NoGains)?;
                let mut bytes = vec![];
                flown(campaign, *chunk, &Gains(tuned), NonZeroUsize::MIN)?
                    .write(manifest.about(), &mut bytes)?;
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
