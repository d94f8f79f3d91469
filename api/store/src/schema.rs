//! Versions of the store's tables. A released version never changes; changes are new versions.

use std::path::Path;

use rusqlite::Connection;

use super::digest::{fill, register};
use super::error::StoreError;
use super::writer::writing;

const NEWEST: u32 = 9;

/// The migrations from each version to the next.
const STEPS: [&str; NEWEST as usize] =
    [FIRST, PROBES, SALTS, ORDERS, SHARES, WITHOUT_DIGESTS, GUARDS, DIGESTS, PACKED];

/// Missions, their events, a checkpoint of each, and answered requests.
const FIRST: &str = "
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
";

/// A row for tests of writing. Versions 2 to 5 had digests of rows.
const PROBES: &str = "
ALTER TABLE events ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
ALTER TABLE snapshots ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
CREATE TABLE probes (count INTEGER NOT NULL, room BLOB NOT NULL) STRICT;
INSERT INTO probes VALUES (0, x'');
";

/// A salt that makes ids unguessable.
const SALTS: &str = "
ALTER TABLE missions ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
CREATE TABLE salts (salt BLOB NOT NULL) STRICT;
INSERT INTO salts VALUES (randomblob(32));
";

const ORDERS: &str = "
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
";

/// The client of each mission, and the bytes of its events.
const SHARES: &str = "
ALTER TABLE missions ADD COLUMN owner TEXT NOT NULL DEFAULT '';
ALTER TABLE missions ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;
UPDATE missions SET
    owner = coalesce((SELECT caller FROM orders WHERE mission = id AND action = 'create' ORDER BY number DESC LIMIT 1), ''),
    bytes = coalesce((SELECT sum(length(body) + 64) FROM events WHERE mission = number), 0);
";

/// Drops the digests of rows; SQLite's own checks remain.
const WITHOUT_DIGESTS: &str = "
ALTER TABLE missions DROP COLUMN digest;
ALTER TABLE events DROP COLUMN digest;
ALTER TABLE snapshots DROP COLUMN digest;
ALTER TABLE orders DROP COLUMN digest;
";

/// The service's protection by tokens, the trusted time, and each mission's end in trusted time. No
/// boot lasts 1e300 s, so the first start counts as another boot.
const GUARDS: &str = "
CREATE TABLE guards (
    protected INTEGER NOT NULL,
    trusted_s REAL NOT NULL,
    agreed_s REAL NOT NULL,
    clock_s REAL NOT NULL,
    up_s REAL NOT NULL
) STRICT;
INSERT INTO guards SELECT 0, coalesce(max(at_s), 0.0), 0.0, coalesce(max(at_s), 0.0), 1e300 FROM orders;
ALTER TABLE missions ADD COLUMN over_s REAL;
UPDATE missions SET over_s = json_extract(CAST(summary AS TEXT), '$.finished_s')
    WHERE status IN ('finished', 'failed') AND json_valid(CAST(summary AS TEXT));
";

/// The number and digest of the last event; digests of events, checkpoints and summaries.
const DIGESTS: &str = concat!(
    "
ALTER TABLE events ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
ALTER TABLE snapshots ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
ALTER TABLE missions ADD COLUMN sequence INTEGER NOT NULL DEFAULT 0;
ALTER TABLE missions ADD COLUMN head BLOB NOT NULL DEFAULT x'';
ALTER TABLE missions ADD COLUMN digest BLOB NOT NULL DEFAULT x'';
",
    fill!()
);

/// Bodies may be packed. Older programs cannot read those.
const PACKED: &str = "";

/// The version of the stored tables, which must be from `oldest` to the newest.
fn version(connection: &Connection, path: &Path, oldest: u32) -> Result<u32, StoreError> {
    let found = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
    require_version(path, found, [oldest, NEWEST])
}

/// The version `found` of the tables at `path`, if a program that knows these versions reads it.
pub(super) fn require_version(path: &Path, found: u32, [oldest, known]: [u32; 2]) -> Result<u32, StoreError> {
    let path = path.to_owned();
    if known < found {
        Err(StoreError::TooNew(path, found, known))
    } else if found < oldest {
        Err(StoreError::TooOld(path, found, known))
    } else {
        Ok(found)
    }
}

/// Fails for the database of another program: one with other tables.
pub(super) fn require_log(connection: &Connection, path: &Path) -> Result<(), StoreError> {
    let found = version(connection, path, 0)?;
    let tables = "SELECT count(*), count(*) FILTER (WHERE name IN ('missions', 'events')) FROM sqlite_schema WHERE type = 'table'";
    let (all, own): (u32, u32) = connection.query_row(tables, [], |row| row.try_into())?;
    let is_ours = if found == 0 { all == 0 } else { own == 2 };
    is_ours.then_some(()).ok_or_else(|| StoreError::open(path, &"it is the database of another program"))
}

/// Migrates the tables to the newest version in one transaction: a full disk changes nothing.
pub(super) fn migrate(connection: &mut Connection, path: &Path) -> Result<(), StoreError> {
    let found = version(connection, path, 0)?;
    if found == NEWEST {
        return Ok(());
    }
    register(connection)?;
    let transaction = writing(connection)?;
    for step in &STEPS[found as usize..] {
        transaction.execute_batch(step)?;
    }
    transaction.pragma_update(None, "user_version", NEWEST)?;
    transaction.commit()?;
    if 0 < found {
        tracing::info!(path = %path.display(), version = NEWEST, "migrated the mission log");
    }
    Ok(())
}

/// Fails for older tables: readers do not migrate.
pub(super) fn require_newest(connection: &Connection, path: &Path) -> Result<(), StoreError> {
    version(connection, path, NEWEST).map(drop)
}

#[cfg(test)]
pub(super) fn step(connection: &mut Connection, version: usize) {
    let transaction = connection.transaction().expect("begins");
    transaction.execute_batch(STEPS[version]).expect("is SQL");
    let next = u32::try_from(version + 1).expect("small");
    transaction.pragma_update(None, "user_version", next).expect("is written");
    transaction.commit().expect("is written");
}
