//! A campaign as pieces of work that can be done anywhere, and what they come to as bytes.
//!
//! [`run()`](super::run()) does them on the threads of one process; a program that spreads them over machines sends a [`Work`], and keeps what
//! comes of it under [`Work::name`].

use serde::{Deserialize, Serialize};

use super::{
    chunk::flown,
    design::Campaign,
    directory::{Directory, DirectoryError, Manifest},
    fly::TO_THE_END,
    tune::{Gains, Tuned, tune, tuned_in},
};

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Work {
    /// Find the gains of one law in one arena.
    Tune {
        /// The arena's number.
        arena: usize,
        /// The controller's number.
        controller: usize,
    },
    /// Fly a chunk, once the gains of its arena are found.
    Fly {
        /// The chunk's number.
        chunk: u64,
    },
}

/// Why a piece of work cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum WorkError {
    /// Not of this campaign.
    #[error("the campaign has no {0:?}")]
    NotOfCampaign(Work),
    /// The gains that a chunk needs are none.
    #[error("gains of the chunk's laws are missing or damaged")]
    NoGains,
    /// What it came to cannot be written.
    #[error("rows cannot be written")]
    Rows(#[from] record::ExportError),
}

impl Work {
    /// The name of what it comes to.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Tune { arena, controller } => format!("gains/{arena}-{controller}"),
            Self::Fly { chunk } => format!("chunks/{chunk}"),
        }
    }

    /// The work that has to be done before the chunks of `arena` can be flown.
    #[must_use]
    pub fn before(campaign: &Campaign, arena: usize) -> Vec<Self> {
        let laws = tuned_in(campaign, arena).into_iter();
        laws.map(|controller| Self::Tune { arena, controller }).collect()
    }

    /// The chunks of `arena`.
    #[must_use]
    pub fn chunks(campaign: &Campaign, arena: usize) -> Vec<Self> {
        let chunks = campaign.chunks().into_iter().filter(|chunk| chunk.arena == arena);
        chunks.map(|chunk| Self::Fly { chunk: chunk.number }).collect()
    }

    /// The arena that it is in; none of another campaign's.
    #[must_use]
    pub fn arena(self, campaign: &Campaign) -> Option<usize> {
        match self {
            Self::Tune { arena, .. } => (arena < campaign.arenas.len()).then_some(arena),
            Self::Fly { chunk } => campaign
                .chunks()
                .into_iter()
                .find(|other| other.number == chunk)
                .map(|chunk| chunk.arena),
        }
    }

    /// Does it. `before` is what [`Self::before`] came to, in that order; a search for gains needs none of it.
    pub fn done(
        self,
        campaign: &Campaign,
        manifest: &Manifest,
        before: &[Vec<u8>],
    ) -> Result<Vec<u8>, WorkError> {
        match self {
            Self::Tune { arena, controller } => {
                if self.arena(campaign).is_none() || !tuned_in(campaign, arena).contains(&controller) {
                    return Err(WorkError::NotOfCampaign(self));
                }
                let tuned = tune(campaign, arena, controller, TO_THE_END).expect("nothing stops it");
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
                    .filter(|tuned| tuned.len() == tuned_in(campaign, chunk.arena).len())
                    .ok_or(WorkError::NoGains)?;
                let mut bytes = vec![];
                flown(campaign, *chunk, &Gains(tuned)).write(manifest.about(), &mut bytes)?;
                Ok(bytes)
            }
        }
    }
}

impl Directory {
    /// Keeps what a piece of work came to somewhere else, as if it had been done here.
    pub fn keep_work(&self, work: Work, bytes: &[u8]) -> Result<(), DirectoryError> {
        self.keep_bytes(&work.name(), bytes)
    }
}
