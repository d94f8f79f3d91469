//! The mission of an append, as its commit finds it, and the decision about the append.

use super::digest::Head;
use super::entry::{Append, Appended};
use super::error::StoreError;
use super::known::Known;
use super::rows::SqlRow;
use super::shares::{Shares, Taken};
use super::sql::signed;

pub(super) struct Locked {
    pub(super) head: Head,
    /// `true` if its last event is stored.
    is_whole: bool,
    owner: String,
}

impl Locked {
    /// The columns that [`Self::read`] reads.
    pub(super) const COLUMNS: &str =
        "number, sequence, head, (SELECT digest FROM events WHERE mission = number
        AND events.sequence = missions.sequence), owner";

    pub(super) fn read(row: &dyn SqlRow) -> Result<Self, StoreError> {
        let head = Head { mission: row.get(0)?, sequence: row.get(1)?, digest: row.get(2)? };
        let stored: Option<Vec<u8>> = row.get(3)?;
        Ok(Self { is_whole: head.digest == stored.unwrap_or_default(), head, owner: row.get(4)? })
    }

    /// Number of the mission's last event. Fails with the fault if that is not stored.
    pub(super) fn last(&self) -> Result<i64, String> {
        let last = self.head.sequence;
        let fault = || format!("its last event, {last}, is missing or is not what was stored");
        self.is_whole.then_some(last).ok_or_else(fault)
    }
}

/// The decision about an append: the bytes that it takes, or the reason against it. `mission` is
/// none for a new mission and for one that is gone.
pub(super) fn decide(
    append: &Append,
    mission: Option<&Locked>,
    shares: &Shares,
    known: &Known,
) -> Result<Result<Taken, Appended>, StoreError> {
    let owner = match (append.number, mission) {
        (None, _) => append.creator(),
        (Some(_), None) => return Ok(Err(Appended::MissionGone)),
        (Some(_), Some(mission)) => {
            known.compare(&mission.head)?;
            let first = append.events.first();
            if first.is_some_and(|event| signed(event.sequence) != mission.head.sequence + 1) {
                return Ok(Err(Appended::OutOfSequence));
            }
            let damaged = |fault| StoreError::Damaged(format!("mission {}: {fault}", append.mission));
            mission.last().map_err(damaged)?;
            &mission.owner
        }
    };
    let bytes = Shares::bytes_of(append);
    if !shares.has_room(owner, bytes, append.room) {
        return Ok(Err(Appended::ShareUsed));
    }
    let owner = owner.to_owned();
    Ok(Ok(Taken { owner, bytes }))
}
