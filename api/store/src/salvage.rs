//! Copies of the store: complete while a service writes, or the readable part of a damaged one.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use rusqlite::Connection;
use serde_json::json;

use super::copy_rows::copy_rows;
use super::entry::StoredMission;
use super::error::StoreError;
use super::files::{make_private, private_file};
use super::packed::unpack;
use super::reader::{EventReader, FILE_NAME};
use super::rows::Rows;
use super::schema;
use super::sql::signed;

/// Name of the file with the readable events of damaged missions.
pub const REST_NAME: &str = "damaged-missions.ndjson";

impl EventReader {
    /// Copies everything up to the last commit to a new store in `directory`, which it creates, and
    /// checks it. The copy appears complete or not at all; a service may be writing meanwhile.
    ///
    /// A copy of a damaged store has every mission that can be read to its end; [`REST_NAME`] has
    /// the readable events of the others. Returns a line for each fault. A store in PostgreSQL is
    /// refused: use `pg_basebackup`.
    pub fn back_up(&self, directory: &Path) -> Result<Vec<String>, StoreError> {
        let (path, rest) = (directory.join(FILE_NAME), directory.join(REST_NAME));
        let why = "PostgreSQL makes its own backups: use pg_basebackup, or pg_dump";
        let file = self.0.file().ok_or_else(|| StoreError::open(&path, &why))?;
        for path in [&path, &rest] {
            if path.try_exists().map_err(StoreError::at(path))? {
                let why = "the file exists: choose another directory";
                return Err(StoreError::open(path, &why));
            }
        }
        let partial = directory.join(format!("{FILE_NAME}.partial"));
        let failed = |error: io::Error| StoreError::open(&path, &error);
        make_private(directory, &partial).map_err(failed)?;
        let copied = copy(file, &partial).or_else(|error| match error {
            StoreError::Damaged(_) => salvage(file, &partial, &rest),
            other => Err(other),
        });
        let written = copied.and_then(|damage| {
            File::open(&partial)
                .and_then(|file| file.sync_all())
                .and_then(|()| fs::rename(&partial, &path))
                .and_then(|()| File::open(directory)?.sync_all())
                .map_err(failed)?;
            Ok(damage)
        });
        if written.is_err() {
            for path in [&partial, &rest] {
                let _ = fs::remove_file(path);
            }
        }
        written
    }

    /// Checks a file's structure, and the missions in the store.
    pub(super) fn inspect(&self) -> Result<(), StoreError> {
        let file = self.0.file();
        file.map_or(Ok(()), check_structure)?;
        // A database is not read as a whole, because every starting service would do that.
        match self.damage(file.is_some())?.pop() {
            None => Ok(()),
            Some(what) => Err(StoreError::Damaged(what)),
        }
    }

    /// The first fault of each damaged mission. `every_event`: reads all, not only the last.
    pub(super) fn damage(&self, every_event: bool) -> Result<Vec<String>, StoreError> {
        let (mut found, mut after, mut more) = (vec![], 0, true);
        while more {
            let (page, follows) = self.missions(after, PAGE, PAGE_BYTES)?;
            after = page.last().map_or(after, |mission| mission.number);
            more = follows;
            for mission in &page {
                match self.check(mission, every_event) {
                    Ok(()) | Err(StoreError::Gone) => {}
                    Err(StoreError::Damaged(what)) => found.push(what),
                    Err(other) => return Err(other),
                }
            }
        }
        Ok(found)
    }

    fn check(&self, mission: &StoredMission, every_event: bool) -> Result<(), StoreError> {
        mission.summary()?;
        let last = self.last_sequence(mission.number)?;
        if every_event {
            self.each(mission.number, 0, last, &mut |_| Ok(()))?;
        }
        self.snapshot(mission.number).map(drop)
    }
}

/// Missions per query, and the bytes of their summaries.
const PAGE: usize = 256;
const PAGE_BYTES: usize = 1 << 20;

/// Runs SQLite's own check.
fn check_structure(from: &Connection) -> Result<(), StoreError> {
    let verdict: String = from.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
    match verdict.as_str() {
        "ok" => Ok(()),
        _ => Err(StoreError::Damaged(verdict)),
    }
}

/// Copies every used page.
fn copy(from: &Connection, to: &Path) -> Result<Vec<String>, StoreError> {
    empty(to)?;
    from.execute("VACUUM INTO ?1", [&to.to_string_lossy()])?;
    checked(to)
}

/// Copies the whole missions, and writes the readable events of the others to `rest`.
fn salvage(from: &Connection, to: &Path, rest: &Path) -> Result<Vec<String>, StoreError> {
    empty(to)?;
    let _one_moment = from.unchecked_transaction()?;
    let failed = |error: io::Error| StoreError::open(rest, &error);
    let mut others = BufWriter::new(private_file(rest).map_err(failed)?);
    let mut copy = Connection::open(to)?;
    schema::migrate(&mut copy, to)?;
    let mut copy = copy.transaction()?;
    let mut damage = vec![];
    copy.execute("DELETE FROM salts", [])?;
    if copy_rows(from, &*copy, "salts", "", &[]) != Ok(1) {
        copy.execute("INSERT INTO salts VALUES (randomblob(32))", [])?;
        damage.push(
            "cannot read the salt of mission ids: Idempotency-Keys of new missions start afresh".to_owned(),
        );
    }
    copy.execute("DELETE FROM guards", [])?;
    if copy_rows(from, &*copy, "guards", "", &[]) != Ok(1) {
        // The store may have been protected.
        copy.execute("INSERT INTO guards VALUES (1, 0.0, 0.0, 0.0, 0.0)", [])?;
        damage.push("cannot read the trusted time: the copy can be served only with tokens".to_owned());
    }
    let is_deleted = |number: &i64| {
        let status =
            from.query_row("SELECT status FROM missions WHERE number = ?1", [number], |row| row.get(0));
        status.is_ok_and(|status: String| status == "deleted")
    };
    for number in numbers(from, "missions").into_iter().filter(|number| !is_deleted(number)) {
        let whole = copy.savepoint()?;
        if copy_mission(from, &whole, number).is_ok() {
            whole.commit()?;
            continue;
        }
        drop(whole);
        let (id, last) = outline(from, number);
        let n_read = write_events(from, number, &id, last, &mut others).map_err(failed)?;
        damage.push(format!(
            "mission {id}: {n_read} of {} events can be read, and are in {REST_NAME}",
            last.max(n_read)
        ));
    }
    let is_lost = |number: &i64| copy_rows(from, &*copy, "orders", "WHERE number = ?1", &[number]).is_err();
    let lost = numbers(from, "orders").into_iter().filter(is_lost).count();
    if 0 < lost {
        damage.push(format!("{lost} orders of the audit cannot be read"));
    }
    copy.commit()?;
    let others = others.into_inner().map_err(io::IntoInnerError::into_error);
    others.and_then(|file| file.sync_all()).map_err(failed)?;
    damage.extend(checked(to)?);
    Ok(damage)
}

/// Copies one mission completely, or fails.
fn copy_mission(from: &Connection, to: &Connection, number: i64) -> Result<(), StoreError> {
    let kept = "WHERE number = ?1 AND status <> 'deleted'";
    copy_rows(from, to, "missions", kept, &[&number])?;
    let of_mission = |table| copy_rows(from, to, table, "WHERE mission = ?1", &[&number]);
    let n_events = of_mission("events")?;
    of_mission("snapshots")?;
    of_mission("answered")?;
    let (id, last) = outline(from, number);
    if n_events < last {
        return Err(StoreError::Damaged(format!("events of mission {id} are missing")));
    }
    Ok(())
}

/// The numbers of a table's rows; all numbers ever used if the rows cannot be read.
fn numbers(from: &Connection, table: &str) -> Vec<i64> {
    let rows: &dyn Rows = from;
    let all = format!("SELECT number FROM {table} ORDER BY number");
    let listed = rows.all(&all, &[], |row| row.get(0));
    let given = "SELECT seq FROM sqlite_sequence WHERE name = ?1";
    let given = || from.query_row(given, [table], |row| row.get(0));
    listed.unwrap_or_else(|_| (1..=given().unwrap_or(0)).collect())
}

/// The id of a mission and the sequence of its last event, or substitutes for unreadable ones.
fn outline(from: &Connection, number: i64) -> (String, u64) {
    let outline = "SELECT id, sequence FROM missions WHERE number = ?1";
    let read =
        from.query_row(outline, [number], |row| Ok((row.get(0)?, row.get::<_, i64>(1)?.unsigned_abs())));
    read.unwrap_or_else(|_| (format!("number {number}"), 0))
}

/// Writes the readable events, one JSON line each. Returns their number.
fn write_events(from: &Connection, number: i64, id: &str, last: u64, to: &mut impl Write) -> io::Result<u64> {
    let read = |sequence: u64| -> rusqlite::Result<(String, Vec<u8>)> {
        let one = "SELECT kind, body FROM events WHERE mission = ?1 AND sequence = ?2";
        let mut one = from.prepare_cached(one)?;
        one.query_row((number, signed(sequence)), |row| row.try_into())
    };
    let mut n_read = 0;
    for sequence in 1.. {
        let Ok((kind, body)) = read(sequence) else {
            if last <= sequence {
                break;
            }
            continue;
        };
        let body = unpack(body).unwrap_or_default();
        let body = String::from_utf8_lossy(&body);
        let line = json!({ "mission": id, "sequence": sequence, "kind": kind, "body": body });
        writeln!(to, "{line}")?;
        n_read += 1;
    }
    Ok(n_read)
}

/// Checks a copy. Returns a line for each damaged mission.
fn checked(copy: &Path) -> Result<Vec<String>, StoreError> {
    let copy = EventReader::open(copy, None)?;
    copy.0.file().map_or(Ok(()), check_structure)?;
    copy.damage(true)
}

/// Empties a file that an earlier attempt may have left.
fn empty(path: &Path) -> Result<(), StoreError> {
    File::create(path).map(drop).map_err(StoreError::at(path))
}
