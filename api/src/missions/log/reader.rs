//! Those that read: whole commits only, and nothing that is not as it was stored.

use std::{path::Path, thread, time::Instant};

use rusqlite::{Connection, OpenFlags, OptionalExtension as _, params};

use super::{
    Before, Event, FILE_NAME, LOCK_TIME, Listed, LogError, SNAPSHOT, answered, digest, limit, schema, signed,
    unsigned,
};

/// Events and missions that are read at once.
const PAGE: usize = 64;

/// Reads the log.
#[derive(Debug)]
pub struct Reader(pub(super) Connection);

impl Reader {
    /// Reads the log in `directory`, whether a service writes to it or not.
    pub fn of(directory: &Path) -> Result<Self, LogError> {
        let path = directory.join(FILE_NAME);
        if !path.exists() {
            return Err(LogError::Open {
                path,
                reason: "there is none: name the directory that the service was started with, --data"
                    .to_owned(),
            });
        }
        let reader = Self::open(&path)?;
        schema::require_newest(&reader.0, &path)?;
        Ok(reader)
    }

    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(path, flags)?;
        connection.busy_timeout(LOCK_TIME)?;
        Ok(Self(connection))
    }

    /// At most `most` missions whose number is above `after`, in order.
    pub fn missions(&self, after: u64, most: usize) -> Result<Vec<Listed>, LogError> {
        let mut statement = self.0.prepare_cached(
            "SELECT number, id, summary FROM missions WHERE number > ?1 AND status <> 'deleted'
             ORDER BY number LIMIT ?2",
        )?;
        let rows = statement.query_map(params![signed(after), limit(most)], listed)?;
        Ok(rows.collect::<rusqlite::Result<_>>()?)
    }

    /// All missions whose life is there, in order.
    pub fn missions_that_are(&self, status: &str) -> Result<Vec<Listed>, LogError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT number, id, summary FROM missions WHERE status = ?1 ORDER BY number")?;
        let rows = statement.query_map([status], listed)?;
        Ok(rows.collect::<rusqlite::Result<_>>()?)
    }

    /// The mission of that name.
    pub fn mission(&self, id: &str) -> Result<Option<Listed>, LogError> {
        let mut statement = self.0.prepare_cached(
            "SELECT number, id, summary FROM missions WHERE id = ?1 AND status <> 'deleted'",
        )?;
        Ok(statement.query_row([id], listed).optional()?)
    }

    /// What the client's key was answered with, and the hash of what it had asked for.
    pub fn answered(&self, mission: &str, key: &str) -> Result<Option<Before>, LogError> {
        Ok(answered(&self.0, mission, key)?)
    }

    /// The last fold that was kept, and the sequence of the event it reaches to.
    pub fn snapshot(&self, mission: u64) -> Result<Option<(u64, Vec<u8>)>, LogError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT sequence, body, digest FROM snapshots WHERE mission = ?1")?;
        let found = statement
            .query_row([signed(mission)], |row| {
                Ok((
                    row.get::<_, i64>(0)?,
                    row.get::<_, Vec<u8>>(1)?,
                    row.get::<_, Vec<u8>>(2)?,
                ))
            })
            .optional()?;
        let Some((sequence, body, stored)) = found else {
            return Ok(None);
        };
        if stored != digest(signed(mission), sequence, SNAPSHOT, &body) {
            return Err(LogError::Damaged(format!(
                "the snapshot of mission number {mission}"
            )));
        }
        Ok(Some((unsigned(sequence), body)))
    }

    /// Hands over every event after `after` up to `last`, some at a time.
    pub fn each(
        &self,
        mission: u64,
        mut after: u64,
        last: u64,
        take: &mut dyn FnMut(&Event) -> Result<(), LogError>,
    ) -> Result<(), LogError> {
        while after < last {
            let left = usize::try_from(last - after).unwrap_or(PAGE);
            let page = self.events(mission, after, left.min(PAGE))?;
            let Some(end) = page.last() else {
                return Err(LogError::Damaged(format!(
                    "events after {after} of mission number {mission} are not there"
                )));
            };
            after = end.sequence;
            page.iter().try_for_each(&mut *take)?;
        }
        Ok(())
    }

    /// At most `most` events after `sequence`, in order: the next ones, without a gap, as they were stored.
    pub fn events(&self, mission: u64, after: u64, most: usize) -> Result<Vec<Event>, LogError> {
        let mut statement = self.0.prepare_cached(
            "SELECT sequence, kind, body, digest FROM events WHERE mission = ?1 AND sequence > ?2
             ORDER BY sequence LIMIT ?3",
        )?;
        let mut rows = statement.query(params![signed(mission), signed(after), limit(most)])?;
        let mut events = vec![];
        let mut next = signed(after).saturating_add(1);
        while let Some(row) = rows.next()? {
            let (sequence, kind, body): (i64, String, Vec<u8>) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let stored: Vec<u8> = row.get(3)?;
            if sequence != next || stored != digest(signed(mission), sequence, &kind, &body) {
                return Err(LogError::Damaged(format!(
                    "event {next} of mission number {mission}"
                )));
            }
            next += 1;
            events.push(Event {
                sequence: unsigned(sequence),
                kind,
                body,
            });
        }
        Ok(events)
    }

    /// Number of the mission's last event; 0 of one without events.
    pub fn last_sequence(&self, mission: u64) -> Result<u64, LogError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT max(sequence) FROM events WHERE mission = ?1")?;
        let last: Option<i64> = statement.query_row([signed(mission)], |row| row.get(0))?;
        Ok(last.map_or(0, unsigned))
    }

    /// Reads everything, and fails at what is not as it was stored.
    pub(super) fn inspect(&self) -> Result<(), LogError> {
        let verdict: String = self.0.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        if verdict != "ok" {
            return Err(LogError::Damaged(verdict));
        }
        let mut after = 0;
        loop {
            let some = self.missions(after, PAGE)?;
            let Some(end) = some.last() else { return Ok(()) };
            after = end.number;
            for mission in &some {
                self.inspect_mission(mission.number)?;
            }
        }
    }

    fn inspect_mission(&self, mission: u64) -> Result<(), LogError> {
        self.snapshot(mission)?;
        let mut after = 0;
        loop {
            let start = Instant::now();
            let page = self.events(mission, after, PAGE)?;
            let Some(end) = page.last() else { return Ok(()) };
            after = end.sequence;
            // Whoever plans goes first.
            thread::sleep(start.elapsed());
        }
    }
}

fn listed(row: &rusqlite::Row<'_>) -> rusqlite::Result<Listed> {
    Ok(Listed {
        number: unsigned(row.get(0)?),
        id: row.get(1)?,
        summary: row.get(2)?,
    })
}
