//! Acknowledged events stay, and the count of probes rises. A store with less was set back, for
//! example by a restored dump; then the running service stores nothing until it starts again.

use std::collections::BTreeMap;

use super::{digest::Head, error::StoreError};

/// Most missions with a known last event: this process's own, and some earlier ones.
const KNOWN_MAX: usize = 4_096;

/// The least that the store must have.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// The last acknowledged event of unfinished missions, with their ids, by their numbers.
    pub(super) heads: BTreeMap<i64, (String, Head)>,
    /// The highest count of probes.
    count: i64,
    /// The first evidence that the store was set back.
    set_back: Option<String>,
}

impl Known {
    /// Fails once the store is known to be set back.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        match &self.set_back {
            None => Ok(()),
            Some(what) => Err(StoreError::SetBack(what.clone())),
        }
    }

    /// `true` if the mission's last event is known.
    pub(super) fn has(&self, mission: i64) -> bool {
        self.heads.contains_key(&mission)
    }

    /// Fails if the mission, whose last event is `stored`, lacks an acknowledged event.
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

    /// Notes a stored count of probes. Fails if it does not rise.
    pub(super) fn count(&mut self, count: i64) -> Result<(), StoreError> {
        if count <= self.count {
            let what = format!("its count of probes is {count}, and was {}", self.count);
            return Err(StoreError::SetBack(what));
        }
        self.count = count;
        Ok(())
    }

    /// Notes the last stored event of a mission.
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

    /// Makes every later check fail.
    pub(super) fn note(&mut self, what: &str) {
        if self.set_back.is_none() {
            tracing::error!(what, "the mission log was set back while the service was running");
            self.set_back = Some(what.to_owned());
        }
    }
}
