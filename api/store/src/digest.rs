//! Chained digests of a mission's events. Readers find a changed, lost, moved or exchanged event,
//! checkpoint or summary.
//!
//! ```text
//! event       d_n = H(mission, n, kind, d_(n−1), body)    d_0 is empty
//! checkpoint  H(mission, n, "checkpoint", d_n, body)      d_n: of the last event in it
//! summary     H(mission, n, "STATUS ID", d_n, body)       d_n: of the mission's last event
//! ```
//! H, half of SHA-256, reveals damage, not an adversary. Copies of a store keep mission numbers.

use rusqlite::{Connection, functions::FunctionFlags};
use sha2::{Digest as _, Sha256};

use super::{entry::Append, sql::signed};

/// Kind of a checkpoint in H.
pub(super) const CHECKPOINT: &str = "checkpoint";

const BYTES: usize = 16;

/// H of `body`, which follows an event with the digest `before`.
pub(super) fn digest(mission: i64, sequence: i64, kind: &str, before: &[u8], body: &[u8]) -> Vec<u8> {
    let digest = Sha256::new()
        .chain_update(mission.to_be_bytes())
        .chain_update(sequence.to_be_bytes())
        .chain_update((kind.len() as u64).to_be_bytes())
        .chain_update(kind)
        .chain_update(before)
        .chain_update(body)
        .finalize();
    digest[..BYTES].to_vec()
}

/// Kind of a summary in H.
pub(super) fn summary_of(status: &str, id: &str) -> String {
    format!("{status} {id}")
}

/// A mission's last event.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Head {
    pub(super) mission: i64,
    /// 0 without events.
    pub(super) sequence: i64,
    pub(super) digest: Vec<u8>,
}

/// The digests of an append's events, summary and checkpoint.
pub(super) struct Links {
    pub(super) events: Vec<Vec<u8>>,
    /// The mission's last event after the append.
    pub(super) head: Head,
    pub(super) summary: Vec<u8>,
    pub(super) checkpoint: Option<Vec<u8>>,
}

impl Head {
    pub(super) fn of_new(mission: i64) -> Self {
        Self { mission, sequence: 0, digest: vec![] }
    }

    pub(super) fn extend(&self, append: &Append) -> Links {
        let (mission, mut head) = (self.mission, self.clone());
        let events = append.events.iter().map(|event| {
            head.sequence = signed(event.sequence);
            head.digest = digest(mission, head.sequence, &event.kind, &head.digest, &event.body);
            head.digest.clone()
        });
        let events = events.collect();
        let of = |kind: &str, body: &[u8]| digest(mission, head.sequence, kind, &head.digest, body);
        Links {
            events,
            summary: of(&summary_of(&append.status, &append.mission), &append.summary),
            checkpoint: append.snapshot.as_ref().map(|body| of(CHECKPOINT, body)),
            head,
        }
    }
}

/// Registers [`digest`] in SQLite, for [`fill`].
pub(super) fn register(connection: &Connection) -> rusqlite::Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC;
    connection.create_scalar_function("digest_of", 5, flags, |given| {
        let (kind, before, body): (String, Option<Vec<u8>>, Vec<u8>) =
            (given.get(2)?, given.get(3)?, given.get(4)?);
        let before = before.unwrap_or_default();
        Ok(digest(given.get(0)?, given.get(1)?, &kind, &before, &body))
    })
}

/// SQL of both stores that computes missing digests. Events after a gap get none: readers name it.
macro_rules! fill {
    () => {
        "
WITH RECURSIVE chain (mission, sequence, digest) AS (
    SELECT mission, sequence, digest_of(mission, sequence, kind, NULL, body) FROM events WHERE sequence = 1
    UNION ALL
    SELECT events.mission, events.sequence, digest_of(events.mission, events.sequence, kind, chain.digest, body)
    FROM chain JOIN events ON events.mission = chain.mission AND events.sequence = chain.sequence + 1
)
UPDATE events SET digest = chain.digest FROM chain
    WHERE events.mission = chain.mission AND events.sequence = chain.sequence;
UPDATE missions SET sequence = coalesce((SELECT max(sequence) FROM events WHERE mission = number), 0);
UPDATE missions SET head = events.digest FROM events WHERE mission = number AND events.sequence = missions.sequence;
UPDATE missions SET digest = digest_of(number, sequence, status || ' ' || id, head, summary);
UPDATE snapshots SET digest = digest_of(mission, sequence, 'checkpoint',
    (SELECT digest FROM events WHERE mission = snapshots.mission AND sequence = snapshots.sequence), body);
"
    };
}
pub(super) use fill;
