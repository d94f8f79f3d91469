//! Constants and conversions of the store's reader and writer.

use std::time::Duration;

/// How long a connection waits for a lock. Only a checkpoint takes one.
pub(super) const LOCK_TIME: Duration = Duration::from_secs(5);

pub(super) fn limit(most: usize) -> i64 {
    i64::try_from(most).unwrap_or(i64::MAX)
}

/// SQLite has signed integers; numbers here are far below their maximum.
pub(super) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn unsigned(number: i64) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
