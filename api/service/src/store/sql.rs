//! What the store's reader and its writer share: digests and numbers.

use std::time::Duration;

use sha2::{Digest as _, Sha256};

use super::entry::Order;

/// How long a connection waits for another's lock. Only a checkpoint takes one.
pub(super) const LOCK_TIME: Duration = Duration::from_secs(5);

/// A snapshot's digest has this instead of an event's kind.
pub(super) const SNAPSHOT: &str = "snapshot";

/// An order's digest has this instead.
const ORDER: &str = "order";

/// Shows that a row is what was stored: SQLite itself notices only damage to its own structure.
pub(super) fn digest(mission: i64, sequence: i64, kind: &str, body: &[u8]) -> [u8; 16] {
    let mut hash = Sha256::new();
    hash.update(mission.to_le_bytes());
    hash.update(sequence.to_le_bytes());
    hash.update(kind);
    hash.update([0]);
    hash.update(body);
    let mut short = [0; 16];
    short.copy_from_slice(&hash.finalize()[..16]);
    short
}

/// Shows that a mission in the list of all is what was stored.
pub(super) fn summary_digest(id: &str, status: &str, summary: &[u8]) -> [u8; 16] {
    digest(0, 0, &format!("{id}\0{status}"), summary)
}

/// Shows that an order is what was stored.
pub(super) fn order_digest(mission: &str, order: &Order) -> [u8; 16] {
    let Order {
        at_s,
        caller,
        request,
        action,
    } = order;
    let said = format!("{mission}\0{caller}\0{request}\0{action}");
    digest(0, 0, ORDER, &[&at_s.to_le_bytes(), said.as_bytes()].concat())
}

pub(super) fn limit(most: usize) -> i64 {
    i64::try_from(most).unwrap_or(i64::MAX)
}

/// SQLite counts with a sign; nothing here comes near its end.
pub(super) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn unsigned(number: i64) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
