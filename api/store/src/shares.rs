//! Disk space used by the missions of each client. Plans are counted but never refused.

use std::collections::HashMap;

use super::entry::{Append, Room};
use super::error::StoreError;
use super::rows::{Rows, SqlRow};

/// Bytes of an event, a stored answer or an order beside its text.
const BESIDE_TEXT: u64 = 64;

/// Bytes of each client's missions, and the limit of one client. Checkpoints (they do not grow) and
/// deleted missions do not count. Missions from before schema 4 belong to no client.
#[derive(Debug)]
pub(super) struct Shares {
    most: u64,
    taken: HashMap<String, u64>,
}

/// The bytes of a commit, and their owner.
#[derive(Debug)]
pub(super) struct Taken {
    pub(super) owner: String,
    pub(super) bytes: u64,
}

impl Taken {
    /// Number, owner and bytes of a mission that a deletion has hidden.
    pub(super) fn hidden(row: &dyn SqlRow) -> Result<(i64, Self), StoreError> {
        let (owner, bytes) = (row.get(1)?, row.get::<i64>(2)?.unsigned_abs());
        Ok((row.get(0)?, Self { owner, bytes }))
    }
}

impl Shares {
    const SUMS: &str =
        "SELECT owner, CAST(sum(bytes) AS BIGINT) FROM missions WHERE status <> 'deleted' GROUP BY owner";

    pub(super) fn new(most: u64) -> Self {
        Self { most, taken: HashMap::new() }
    }

    pub(super) fn read(&mut self, rows: &dyn Rows) -> Result<(), StoreError> {
        self.taken = rows.all(Self::SUMS, &[], |row| Ok((row.get(0)?, row.get::<i64>(1)?.unsigned_abs())))?;
        Ok(())
    }

    pub(super) fn is_unlimited(&self) -> bool {
        self.most == u64::MAX
    }

    pub(super) fn has_room(&self, owner: &str, bytes: u64, room: Room) -> bool {
        let most = match room {
            Room::Share => self.most,
            Room::Half => self.most / 2,
            Room::Any => return true,
        };
        let taken = self.taken.get(owner).copied().unwrap_or(0);
        owner.is_empty() || taken.saturating_add(bytes) <= most
    }

    pub(super) fn take(&mut self, Taken { owner, bytes }: Taken) {
        *self.taken.entry(owner).or_default() += bytes;
    }

    pub(super) fn give_back(&mut self, Taken { owner, bytes }: &Taken) {
        if let Some(taken) = self.taken.get_mut(owner) {
            *taken = taken.saturating_sub(*bytes);
        }
    }

    pub(super) fn bytes_of(append: &Append) -> u64 {
        let events = append.events.iter().map(|event| event.body.len());
        let answer = append.answered.iter().map(|answered| answered.answer.len());
        let order = append.order.iter().map(|order| order.caller.len() + order.request.len());
        events.chain(answer).chain(order).map(|length| length as u64 + BESIDE_TEXT).sum()
    }
}
