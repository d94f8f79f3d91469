//! Statements that both stores execute, and conversions of their values.

use std::borrow::Cow;
use std::hash::{BuildHasher as _, RandomState};
use std::time::Duration;

/// Longest wait for a lock of a checkpoint or another program: missions answer within 10 s, and an
/// append may wait behind two others.
pub(super) const LOCK_TIME: Duration = Duration::from_secs(2);

/// Events of a deleted mission, or free pages, that one commit removes: some milliseconds.
pub(super) const PURGE: i64 = 500;

pub(super) const PURGE_EVENTS: &str = "DELETE FROM events WHERE mission = ?1 AND sequence <=
    (SELECT min(sequence) FROM events WHERE mission = ?1) + ?2";

/// Removes a mission without events: several services may remove those, one the mission.
pub(super) const PURGE_MISSION: &str = "DELETE FROM missions WHERE number = ?1
    AND NOT EXISTS (SELECT 1 FROM events WHERE mission = ?1)";

pub(super) const DELETED: &str = "SELECT number FROM missions WHERE status = 'deleted'";

pub(super) const PROTECT: &str = "UPDATE guards SET protected = 1";

pub(super) const ORDER: &str =
    "INSERT INTO orders (at_s, caller, request, mission, action) VALUES (?1, ?2, ?3, ?4, ?5)";

pub(super) fn limit(most: usize) -> i64 {
    i64::try_from(most).unwrap_or(i64::MAX)
}

/// An id that no other process has. It is not secret.
pub(super) fn new_id() -> String {
    format!("{:016x}", RandomState::new().hash_one(()))
}

/// Numbers here are far below the limit of SQLite's signed integers.
pub(super) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn unsigned(number: i64) -> u64 {
    u64::try_from(number).unwrap_or(0)
}

/// Separates a caller from a key; no header contains either character.
const NUL: char = '\0';
const UNIT_SEPARATOR: char = '\x1f';

/// The text as PostgreSQL stores it: it allows no NUL.
pub(super) fn without_nul(text: &str) -> Cow<'_, str> {
    if text.contains(NUL) { text.replace(NUL, &UNIT_SEPARATOR.to_string()).into() } else { text.into() }
}

/// Reverses [`without_nul`].
pub(super) fn with_nul(text: &str) -> String {
    text.replace(UNIT_SEPARATOR, &NUL.to_string())
}
