//! What this process knows of its store: acknowledged events stay, and the count of probes only rises. Where the store has less, it was
//! set back under the running service, as by a dump that was restored: then nothing more is stored until the service starts again.

use std::collections::BTreeMap;

use super::{digest::Head, error::StoreError};

/// Most missions whose last event is known: those that this process has, and some that it had.
const KNOWN_MAX: usize = 4_096;

/// What the store must have.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// The last acknowledged event of unfinished missions, with their ids, by their numbers.
    pub(super) heads: BTreeMap<i64, (String, Head)>,
    /// The highest count of probes.
    count: i64,
    /// How the store was found to be set back.
    set_back: Option<String>,
}

impl Known {
    /// Fails once the store was found to be set back.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        match &self.set_back {
            None => Ok(()),
            Some(what) => Err(StoreError::SetBack(what.clone())),
        }
    }

    /// Whether the mission's last event is known.
    pub(super) fn has(&self, mission: i64) -> bool {
        self.heads.contains_key(&mission)
    }

    /// Fails if the mission, whose last event is `stored`, lacks an acknowledged one.
    pub(super) fn compare(&self, stored: &Head) -> Result<(), StoreError> {
        let Some((id, known)) = self.heads.get(&stored.mission) else {
            return Ok(());
        };
        if known.sequence < stored.sequence || known == stored {
            return Ok(());
        }
        let (last, acknowledged) = (stored.sequence, known.sequence);
        Err(StoreError::SetBack(if last == acknowledged {
            format!("event {last} of mission {id} is not the acknowledged one")
        } else {
            format!("mission {id} has events up to {last}, and {acknowledged} was acknowledged")
        }))
    }

    /// Takes the count of a probe that is stored. Fails if it does not rise.
    pub(super) fn count(&mut self, count: i64) -> Result<(), StoreError> {
        if count <= self.count {
            let what = format!("its count of probes is {count}, and was {}", self.count);
            return Err(StoreError::SetBack(what));
        }
        self.count = count;
        Ok(())
    }

    /// Takes the last event of a mission, which is stored.
    pub(super) fn add(&mut self, id: &str, head: Head, is_over: bool) {
        if is_over {
            self.heads.remove(&head.mission);
            return;
        }
        self.heads.insert(head.mission, (id.to_owned(), head));
        if KNOWN_MAX < self.heads.len() {
            self.heads.pop_first();
        }
    }

    /// From now on every check fails.
    pub(super) fn note(&mut self, what: &str) {
        if self.set_back.is_none() {
            tracing::error!(what, "the mission log was set back while the service was running");
            self.set_back = Some(what.to_owned());
        }
    }
}
