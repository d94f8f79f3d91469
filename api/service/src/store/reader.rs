//! Reads whole commits, and fails at what is not as it was stored.

use std::{
    fs::{self, File},
    io,
    path::Path,
    sync::Arc,
    thread,
    time::Instant,
};

use rusqlite::{Connection, OpenFlags, OptionalExtension as _, Params, params};

use super::{
    entry::{Order, StoredEvent, StoredMission, StoredOrder},
    error::StoreError,
    idempotency::{self, PreviousAnswer},
    make_private, schema,
    sql::{LOCK_TIME, SNAPSHOT, digest, limit, order_digest, signed, summary_digest, unsigned},
};

/// Name of the store's file in the data directory.
pub const FILE_NAME: &str = "missions.sqlite3";

/// Events and missions that are read at once.
const PAGE: usize = 64;

/// A mission of a list, or that it is damaged, which keeps no other from being read.
pub type MaybeDamaged = Result<StoredMission, StoreError>;

/// Reads the event store.
#[derive(Debug)]
pub struct EventReader(pub(super) Connection);

impl EventReader {
    /// Reads the store in `directory`, whether a service writes to it or not.
    pub fn of(directory: &Path) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        if !path.exists() {
            let reason = "there is none: name the directory that the service was started with, --data";
            return Err(StoreError::open(&path, &reason));
        }
        let reader = Self::open(&path)?;
        schema::require_newest(&reader.0, &path)?;
        Ok(reader)
    }

    pub(super) fn open(path: &Path) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(path, flags)?;
        connection.busy_timeout(LOCK_TIME)?;
        Ok(Self(connection))
    }

    /// At most `most` missions whose number is above `after`, in order.
    pub fn missions(&self, after: u64, most: usize) -> Result<Vec<MaybeDamaged>, StoreError> {
        let page = "number > ?1 AND status <> 'deleted' ORDER BY number LIMIT ?2";
        self.missions_where(page, params![signed(after), limit(most)])
    }

    /// All missions of that status, in order.
    pub fn missions_with_status(&self, status: &str) -> Result<Vec<MaybeDamaged>, StoreError> {
        self.missions_where("status = ?1 ORDER BY number", [status])
    }

    /// The mission of that name.
    pub fn mission(&self, id: &str) -> Result<Option<StoredMission>, StoreError> {
        let mut named = self.missions_where("id = ?1 AND status <> 'deleted'", [id])?;
        named.pop().transpose()
    }

    fn missions_where(&self, condition: &str, params: impl Params) -> Result<Vec<MaybeDamaged>, StoreError> {
        let select = format!("SELECT number, id, status, summary, digest FROM missions WHERE {condition}");
        let mut statement = self.0.prepare_cached(&select)?;
        let mut rows = statement.query(params)?;
        let mut missions = vec![];
        while let Some(row) = rows.next()? {
            let (number, id, status, summary, stored): (i64, String, String, Vec<u8>, Vec<u8>) =
                row.try_into()?;
            let is_whole = stored == summary_digest(&id, &status, &summary);
            let mission = StoredMission {
                number: unsigned(number),
                id,
                summary,
            };
            missions.push(if is_whole {
                Ok(mission)
            } else {
                Err(StoreError::Damaged(format!(
                    "the summary of mission number {number}"
                )))
            });
        }
        Ok(missions)
    }

    /// At most `most` orders after the one numbered `after`, of one mission or of all.
    pub fn orders(
        &self,
        mission: Option<&str>,
        after: u64,
        most: usize,
    ) -> Result<Vec<StoredOrder>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT number, at_s, caller, request, mission, action, digest FROM orders
             WHERE ?1 < number AND (?2 IS NULL OR mission = ?2) ORDER BY number LIMIT ?3",
        )?;
        let mut rows = statement.query(params![signed(after), mission, limit(most)])?;
        let mut orders = vec![];
        while let Some(row) = rows.next()? {
            let order = Order {
                at_s: row.get(1)?,
                caller: row.get(2)?,
                request: row.get(3)?,
                action: row.get(5)?,
            };
            let (number, mission, stored): (i64, String, Vec<u8>) = (row.get(0)?, row.get(4)?, row.get(6)?);
            if stored != order_digest(&mission, &order) {
                return Err(StoreError::Damaged(format!("order number {number}")));
            }
            orders.push(StoredOrder {
                number: unsigned(number),
                mission,
                order,
            });
        }
        Ok(orders)
    }

    /// How many missions that `caller` made are neither over nor deleted.
    pub fn count_open(&self, caller: &str) -> Result<usize, StoreError> {
        let mut count = self.0.prepare_cached(
            "SELECT count(*) FROM missions WHERE status IN ('created', 'running', 'paused') AND EXISTS
             (SELECT 1 FROM orders WHERE mission = id AND action = 'create' AND caller = ?1)",
        )?;
        let open: i64 = count.query_row([caller], |row| row.get(0))?;
        Ok(usize::try_from(open).unwrap_or(usize::MAX))
    }

    /// A secret of this store, of which ids are made.
    pub fn salt(&self) -> Result<Vec<u8>, StoreError> {
        Ok(self.0.query_row("SELECT salt FROM salts", [], |row| row.get(0))?)
    }

    /// The earlier answer to the client's key, and the hash of its request.
    pub fn answered(&self, mission: &str, key: &str) -> Result<Option<PreviousAnswer>, StoreError> {
        Ok(idempotency::find(&self.0, mission, key)?)
    }

    /// The newest snapshot, and the sequence of the last event in it.
    pub fn snapshot(&self, mission: u64) -> Result<Option<(u64, Vec<u8>)>, StoreError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT sequence, body, digest FROM snapshots WHERE mission = ?1")?;
        let found = statement.query_row([signed(mission)], |row| row.try_into());
        let found: Option<(i64, Vec<u8>, Vec<u8>)> = found.optional()?;
        let Some((sequence, body, stored)) = found else {
            return Ok(None);
        };
        if stored != digest(signed(mission), sequence, SNAPSHOT, &body) {
            return Err(self.damaged(mission, format!("the snapshot of mission number {mission}")));
        }
        Ok(Some((unsigned(sequence), body)))
    }

    /// Hands over every event after `after` up to `last`, some at a time.
    pub fn each(
        &self,
        mission: u64,
        mut after: u64,
        last: u64,
        take: &mut dyn FnMut(&StoredEvent) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        while after < last {
            let left = usize::try_from(last - after).unwrap_or(PAGE);
            let page = self.events(mission, after, left.min(PAGE))?;
            let Some(end) = page.last() else {
                let what = format!("events after {after} of mission number {mission} are not there");
                return Err(self.damaged(mission, what));
            };
            after = end.sequence;
            page.iter().try_for_each(&mut *take)?;
        }
        Ok(())
    }

    /// At most `most` events after `sequence`, in order: the next ones, without a gap, as they were stored.
    pub fn events(&self, mission: u64, after: u64, most: usize) -> Result<Vec<StoredEvent>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT sequence, kind, body, digest FROM events WHERE mission = ?1 AND sequence > ?2
             ORDER BY sequence LIMIT ?3",
        )?;
        let mut rows = statement.query(params![signed(mission), signed(after), limit(most)])?;
        let mut events = vec![];
        let mut next = signed(after).saturating_add(1);
        while let Some(row) = rows.next()? {
            let (sequence, kind, body, stored): (i64, String, Arc<[u8]>, Vec<u8>) = row.try_into()?;
            if sequence != next || stored != digest(signed(mission), sequence, &kind, &body) {
                return Err(self.damaged(mission, format!("event {next} of mission number {mission}")));
            }
            next += 1;
            events.push(StoredEvent {
                sequence: unsigned(sequence),
                kind,
                body,
            });
        }
        Ok(events)
    }

    /// The last event of that kind up to `sequence`, as it was stored.
    pub fn last_of_kind(
        &self,
        mission: u64,
        kind: &str,
        sequence: u64,
    ) -> Result<Option<StoredEvent>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT sequence, body, digest FROM events WHERE mission = ?1 AND kind = ?2 AND sequence <= ?3
             ORDER BY sequence DESC LIMIT 1",
        )?;
        let found = statement.query_row(params![signed(mission), kind, signed(sequence)], |row| {
            row.try_into()
        });
        let found: Option<(i64, Arc<[u8]>, Vec<u8>)> = found.optional()?;
        let Some((sequence, body, stored)) = found else {
            return Ok(None);
        };
        if stored != digest(signed(mission), sequence, kind, &body) {
            return Err(self.damaged(mission, format!("event {sequence} of mission number {mission}")));
        }
        Ok(Some(StoredEvent {
            sequence: unsigned(sequence),
            kind: kind.to_owned(),
            body,
        }))
    }

    /// Why something of a mission is not there as it was stored: damage, unless the mission is deleted. Deleting marks
    /// the mission first and then removes its events, some at a time.
    pub fn damaged(&self, mission: u64, what: String) -> StoreError {
        let mark = "SELECT 1 FROM missions WHERE number = ?1 AND status <> 'deleted'";
        let kept = self
            .0
            .prepare_cached(mark)
            .and_then(|mut statement| statement.exists([signed(mission)]));
        match kept {
            Ok(true) => StoreError::Damaged(what),
            Ok(false) => StoreError::Gone,
            Err(error) => error.into(),
        }
    }

    /// Number of the mission's last event; 0 of one without events.
    pub fn last_sequence(&self, mission: u64) -> Result<u64, StoreError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT max(sequence) FROM events WHERE mission = ?1")?;
        let last: Option<i64> = statement.query_row([signed(mission)], |row| row.get(0))?;
        Ok(last.map_or(0, unsigned))
    }

    /// Writes everything up to the last commit into a new store in `directory`, which is made if it is not there, and
    /// inspects it. Whole or not at all; services may write meanwhile.
    pub fn back_up(&self, directory: &Path) -> Result<(), StoreError> {
        let path = directory.join(FILE_NAME);
        let partial = directory.join(format!("{FILE_NAME}.partial"));
        let failed = |error: io::Error| StoreError::open(&path, &error);
        if path.exists() {
            return Err(StoreError::open(
                &path,
                &"there is one already: name another directory",
            ));
        }
        make_private(directory, &partial).map_err(failed)?;
        // What an earlier try left is no part of this one.
        File::create(&partial).map_err(failed)?;
        let name = partial.to_string_lossy();
        let written = self
            .0
            .execute("VACUUM INTO ?1", [&name])
            .map_err(StoreError::from)
            .and_then(|_| Self::open(&partial)?.inspect())
            .and_then(|()| {
                File::open(&partial)
                    .and_then(|file| file.sync_all())
                    .and_then(|()| fs::rename(&partial, &path))
                    .and_then(|()| File::open(directory)?.sync_all())
                    .map_err(failed)
            });
        if written.is_err() {
            // Nothing is lost with it.
            let _ = fs::remove_file(&partial);
        }
        written
    }

    /// Reads everything, and fails at what is not as it was stored.
    pub(super) fn inspect(&self) -> Result<(), StoreError> {
        let verdict: String = self.0.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        if verdict != "ok" {
            return Err(StoreError::Damaged(verdict));
        }
        let mut after = 0;
        loop {
            let some: Vec<_> = self
                .missions(after, PAGE)?
                .into_iter()
                .collect::<Result<_, _>>()?;
            let Some(end) = some.last() else { return Ok(()) };
            after = end.number;
            for mission in &some {
                match self.inspect_mission(mission.number) {
                    Ok(()) | Err(StoreError::Gone) => {}
                    Err(error) => return Err(error),
                }
            }
        }
    }

    fn inspect_mission(&self, mission: u64) -> Result<(), StoreError> {
        self.snapshot(mission)?;
        let mut after = 0;
        loop {
            let start = Instant::now();
            let page = self.events(mission, after, PAGE)?;
            let Some(end) = page.last() else { return Ok(()) };
            after = end.sequence;
            // Planners need the processor more.
            thread::sleep(start.elapsed());
        }
    }
}
