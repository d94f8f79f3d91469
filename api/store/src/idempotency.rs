//! Idempotency keys: a repeated request with the same key gets its first answer again.

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

/// The answer to a request with a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyedAnswer {
    /// The client's key.
    pub key: String,
    /// Hash of the request; detects the same key in a different request.
    pub request: [u8; 32],
    /// The answer, JSON.
    pub answer: Vec<u8>,
}

/// Hash of an earlier request, and its answer.
pub type PreviousAnswer = ([u8; 32], Vec<u8>);

/// Selects a [`PreviousAnswer`] by mission and key.
pub(super) const FIND: &str = "SELECT request, answer FROM answered JOIN missions ON number = mission
    WHERE id = ?1 AND key = ?2 AND status <> 'deleted'";

/// The answer to an earlier request with the key, and the hash of that request.
pub(super) fn find(
    connection: &Connection,
    mission: &str,
    key: &str,
) -> rusqlite::Result<Option<PreviousAnswer>> {
    connection
        .prepare_cached(FIND)?
        .query_row(params![mission, key], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()
}

/// Stores an answer of mission `number` under its key.
pub(super) fn keep(
    transaction: &Transaction<'_>,
    number: i64,
    answered: &KeyedAnswer,
) -> rusqlite::Result<()> {
    let KeyedAnswer { key, request, answer } = answered;
    transaction
        .prepare_cached("INSERT INTO answered (mission, key, request, answer) VALUES (?1, ?2, ?3, ?4)")?
        .execute(params![number, key, request, answer])?;
    Ok(())
}
