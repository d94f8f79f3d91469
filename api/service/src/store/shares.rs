//! How much of the disk the missions of each client take. What goes on by itself is counted and never refused.

use std::collections::HashMap;

use rusqlite::Connection;

use super::entry::{Append, Room};

/// What an event, an answer that is kept or an order takes beside its text, bytes.
const BESIDE_TEXT: u64 = 64;

/// The room of each client that made missions, and the most that one may take. Snapshots, which do not grow with a mission,
/// are not counted, and neither is what a deleted mission leaves until it is purged. Missions from before orders were kept
/// belong to no client.
#[derive(Debug)]
pub(super) struct Shares {
    most: u64,
    taken: HashMap<String, u64>,
}

/// Room that a commit takes.
#[derive(Debug)]
pub(super) struct Taken {
    pub(super) owner: String,
    pub(super) bytes: u64,
}

impl Shares {
    /// As the missions of the store take it.
    pub(super) fn read(connection: &Connection, most: u64) -> rusqlite::Result<Self> {
        let sums = "SELECT owner, sum(bytes) FROM missions WHERE status <> 'deleted' GROUP BY owner";
        let taken = connection
            .prepare(sums)?
            .query_map([], |row| Ok((row.get(0)?, row.get::<_, i64>(1)?.unsigned_abs())))?
            .collect::<rusqlite::Result<_>>()?;
        Ok(Self { most, taken })
    }

    /// Whether `owner` may store an append that takes as much.
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

    /// What an append takes, bytes.
    pub(super) fn bytes_of(append: &Append) -> u64 {
        let events = append.events.iter().map(|event| event.body.len());
        let answer = append.answered.iter().map(|answered| answered.answer.len());
        let order = append
            .order
            .iter()
            .map(|order| order.caller.len() + order.request.len());
        let texts = events.chain(answer).chain(order);
        texts.map(|length| length as u64 + BESIDE_TEXT).sum()
    }
}
