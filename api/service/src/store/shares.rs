//! How much of the disk the missions of each client take, so that no client fills it for the others.

use std::collections::HashMap;

use rusqlite::Connection;

/// What an event takes beside its body, bytes.
const BESIDE_BODY: u64 = 64;

/// The room of each client that made missions, and the most that one may take. Snapshots, which do not grow with a mission,
/// are not counted, and neither is what a deleted mission leaves until it is purged.
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

    /// Whether `owner` may take as much.
    pub(super) fn has_room(&self, owner: &str, bytes: u64) -> bool {
        let taken = self.taken.get(owner).copied().unwrap_or(0);
        taken.saturating_add(bytes) <= self.most
    }

    pub(super) fn take(&mut self, Taken { owner, bytes }: Taken) {
        *self.taken.entry(owner).or_default() += bytes;
    }

    pub(super) fn give_back(&mut self, Taken { owner, bytes }: &Taken) {
        if let Some(taken) = self.taken.get_mut(owner) {
            *taken = taken.saturating_sub(*bytes);
        }
    }

    /// What events of such bodies take.
    pub(super) fn room_of<'a>(bodies: impl Iterator<Item = &'a [u8]>) -> u64 {
        bodies.map(|body| body.len() as u64 + BESIDE_BODY).sum()
    }
}
