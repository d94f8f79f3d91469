//! Versions of the store's tables. A version, once released, never changes; a change is a new one.

use std::path::Path;

use rusqlite::{Connection, Transaction, params};

use super::{
    error::StoreError,
    sql::{SNAPSHOT, digest, summary_digest},
};

/// The step from each version to the next, in order.
const STEPS: [fn(&Transaction<'_>) -> rusqlite::Result<()>; 5] = [first, digests, summaries, orders, shares];

/// Missions, their events, a snapshot of each, and the requests that were answered.
fn first(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    transaction.execute_batch(
        "
CREATE TABLE missions (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    status TEXT NOT NULL,
    summary BLOB NOT NULL
) STRICT;
CREATE INDEX missions_by_status ON missions (status);
CREATE TABLE events (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    sequence INTEGER NOT NULL,
    kind TEXT NOT NULL,
    body BLOB NOT NULL,
    PRIMARY KEY (mission, sequence)
) STRICT, WITHOUT ROWID;
CREATE TABLE snapshots (
    mission INTEGER PRIMARY KEY REFERENCES missions (number) ON DELETE CASCADE,
    sequence INTEGER NOT NULL,
    body BLOB NOT NULL
) STRICT;
CREATE TABLE answered (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    key TEXT NOT NULL,
    request BLOB NOT NULL,
    answer BLOB NOT NULL,
    PRIMARY KEY (mission, key)
) STRICT, WITHOUT ROWID;
",
    )
}

/// Digests, which show damage, and a row that probes whether anything can be stored.
fn digests(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    transaction.execute_batch(
        "
ALTER TABLE events ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
ALTER TABLE snapshots ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
CREATE TABLE probes (count INTEGER NOT NULL, room BLOB NOT NULL) STRICT;
INSERT INTO probes VALUES (0, x'');
",
    )?;
    let mut rows = transaction.prepare("SELECT mission, sequence, kind, body FROM events")?;
    let mut mark =
        transaction.prepare("UPDATE events SET digest = ?3 WHERE mission = ?1 AND sequence = ?2")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        let (mission, sequence, kind, body): (i64, i64, String, Vec<u8>) = row.try_into()?;
        mark.execute(params![
            mission,
            sequence,
            digest(mission, sequence, &kind, &body)
        ])?;
    }
    let mut rows = transaction.prepare("SELECT mission, sequence, body FROM snapshots")?;
    let mut mark = transaction.prepare("UPDATE snapshots SET digest = ?2 WHERE mission = ?1")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        let (mission, sequence, body): (i64, i64, Vec<u8>) = row.try_into()?;
        mark.execute(params![mission, digest(mission, sequence, SNAPSHOT, &body)])?;
    }
    Ok(())
}

/// Digests of the missions' summaries too, and a salt that makes ids unguessable.
fn summaries(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    transaction.execute_batch(
        "
ALTER TABLE missions ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
CREATE TABLE salts (salt BLOB NOT NULL) STRICT;
INSERT INTO salts VALUES (randomblob(32));
",
    )?;
    let mut rows = transaction.prepare("SELECT number, id, status, summary FROM missions")?;
    let mut mark = transaction.prepare("UPDATE missions SET digest = ?2 WHERE number = ?1")?;
    let mut rows = rows.query([])?;
    while let Some(row) = rows.next()? {
        let (number, id, status, summary): (i64, String, String, Vec<u8>) = row.try_into()?;
        mark.execute(params![number, summary_digest(&id, &status, &summary)])?;
    }
    Ok(())
}

/// Who ordered what of which mission.
fn orders(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    transaction.execute_batch(
        "
CREATE TABLE orders (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    at_s REAL NOT NULL,
    caller TEXT NOT NULL,
    request TEXT NOT NULL,
    mission TEXT NOT NULL,
    action TEXT NOT NULL,
    digest BLOB NOT NULL
) STRICT;
CREATE INDEX orders_by_mission ON orders (mission, number);
",
    )
}

/// Who made each mission, and how much its events take, bytes.
fn shares(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    transaction.execute_batch(
        "
ALTER TABLE missions ADD COLUMN owner TEXT NOT NULL DEFAULT '';
ALTER TABLE missions ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;
UPDATE missions SET
    owner = coalesce((SELECT caller FROM orders WHERE mission = id AND action = 'create' ORDER BY number DESC LIMIT 1), ''),
    bytes = coalesce((SELECT sum(length(body) + 64) FROM events WHERE mission = number), 0);
",
    )
}

/// The newest version.
fn newest() -> u32 {
    u32::try_from(STEPS.len()).expect("a handful")
}

/// The version of the stored tables. Fails if this program does not know it.
fn version(connection: &Connection, path: &Path) -> Result<u32, StoreError> {
    let found: u32 = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
    let known = newest();
    if known < found {
        return Err(StoreError::TooNew {
            path: path.to_owned(),
            found,
            known,
        });
    }
    Ok(found)
}

/// Brings the tables to the newest version, a whole step at a time.
pub(super) fn migrate(connection: &mut Connection, path: &Path) -> Result<(), StoreError> {
    let found = version(connection, path)?;
    for (step, next) in STEPS.iter().zip(1_u32..).skip(found as usize) {
        let transaction = connection.transaction()?;
        step(&transaction)?;
        transaction.pragma_update(None, "user_version", next)?;
        transaction.commit()?;
        if 0 < found {
            tracing::info!(path = %path.display(), version = next, "brought the mission log to a newer schema");
        }
    }
    Ok(())
}

/// Refuses older tables where the caller may not migrate them.
pub(super) fn require_newest(connection: &Connection, path: &Path) -> Result<(), StoreError> {
    let found = version(connection, path)?;
    let known = newest();
    if found < known {
        return Err(StoreError::TooOld {
            path: path.to_owned(),
            found,
            known,
        });
    }
    Ok(())
}

#[cfg(test)]
pub(super) fn step(connection: &mut Connection, version: usize) {
    let transaction = connection.transaction().expect("begins");
    STEPS[version](&transaction).expect("is SQL");
    let next = u32::try_from(version + 1).expect("small");
    transaction
        .pragma_update(None, "user_version", next)
        .expect("is written");
    transaction.commit().expect("is written");
}
