//! Reads complete commits.

use std::{path::Path, sync::Arc};

use rusqlite::{Connection, OpenFlags, OptionalExtension as _, Params, Row, params};
use wire::mission::Order;

use super::{
    entry::{StoredEvent, StoredMission},
    error::StoreError,
    idempotency::{self, PreviousAnswer},
    place::Place,
    schema,
    sql::{LOCK_TIME, limit, signed, unsigned},
};

/// Name of the store's file in the data directory.
pub const FILE_NAME: &str = "missions.sqlite3";

/// Events that are read at once.
const PAGE: usize = 64;

/// Reads the event store.
#[derive(Debug)]
pub struct EventReader(
    pub(super) Connection,
    /// Guard of the writing service in the same process. It is dropped after the connection.
    #[expect(dead_code, reason = "holds the lock")]
    Option<Arc<Place>>,
);

impl EventReader {
    /// Reads the store in `directory`; a service may be writing to it.
    pub fn of(directory: &Path) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        if !path
            .try_exists()
            .map_err(|error| StoreError::open(&path, &error))?
        {
            let reason = "there is no such file: give the data directory of the service with --data";
            return Err(StoreError::open(&path, &reason));
        }
        let reader = Self::open(&path, None)?;
        schema::require_newest(&reader.0, &path)?;
        Ok(reader)
    }

    pub(super) fn open(path: &Path, place: Option<Arc<Place>>) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(path, flags)?;
        connection.busy_timeout(LOCK_TIME)?;
        Ok(Self(connection, place))
    }

    /// The missions with numbers above `after`, in order, and whether more follow: at most `most`, and no more than `bytes` of
    /// them except for one that is longer.
    pub fn missions(
        &self,
        after: u64,
        most: usize,
        bytes: usize,
    ) -> Result<(Vec<StoredMission>, bool), StoreError> {
        let page = "number > ?1 AND status <> 'deleted' ORDER BY number";
        let mut statement = self.0.prepare_cached(&select_missions(page))?;
        let mut listed = vec![];
        let mut left = bytes;
        for mission in statement.query_map([signed(after)], stored_mission)? {
            let mission = mission?;
            if listed.len() == most || (left < mission.summary.len() && !listed.is_empty()) {
                return Ok((listed, true));
            }
            left = left.saturating_sub(mission.summary.len());
            listed.push(mission);
        }
        Ok((listed, false))
    }

    /// All missions with that status, in order.
    pub fn missions_with_status(&self, status: &str) -> Result<Vec<StoredMission>, StoreError> {
        self.missions_where("status = ?1 ORDER BY number", [status])
    }

    /// The mission with that id.
    pub fn mission(&self, id: &str) -> Result<Option<StoredMission>, StoreError> {
        let mut named = self.missions_where("id = ?1 AND status <> 'deleted'", [id])?;
        Ok(named.pop())
    }

    fn missions_where(&self, condition: &str, params: impl Params) -> Result<Vec<StoredMission>, StoreError> {
        let mut statement = self.0.prepare_cached(&select_missions(condition))?;
        let missions = statement.query_map(params, stored_mission)?;
        Ok(missions.collect::<rusqlite::Result<_>>()?)
    }

    /// At most `most` orders after the one numbered `after`, of one mission or of all.
    pub fn orders(&self, mission: Option<&str>, after: u64, most: usize) -> Result<Vec<Order>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT number, mission, at_s, caller, request, action FROM orders
             WHERE ?1 < number AND (?2 IS NULL OR mission = ?2) ORDER BY number LIMIT ?3",
        )?;
        let orders = statement.query_map(params![signed(after), mission, limit(most)], |row| {
            Ok(Order {
                number: unsigned(row.get(0)?),
                mission: row.get(1)?,
                at_s: row.get(2)?,
                caller: row.get(3)?,
                request_id: row.get(4)?,
                action: row.get(5)?,
            })
        })?;
        Ok(orders.collect::<rusqlite::Result<_>>()?)
    }

    /// The last orders of a mission, at most `most`, the newest first.
    pub fn last_orders(&self, mission: &str, most: usize) -> Result<Vec<Order>, StoreError> {
        let newest = "SELECT number FROM orders WHERE mission = ?1 ORDER BY number DESC LIMIT 1 OFFSET ?2";
        let after = self
            .0
            .prepare_cached(newest)?
            .query_row(params![mission, limit(most)], |row| row.get(0));
        let after = after.optional()?.map_or(0, unsigned);
        let mut orders = self.orders(Some(mission), after, most)?;
        orders.reverse();
        Ok(orders)
    }

    /// How many unfinished missions `caller` has created.
    pub fn count_open(&self, caller: &str) -> Result<usize, StoreError> {
        let mut count = self.0.prepare_cached(
            "SELECT count(*) FROM missions WHERE status IN ('created', 'running', 'paused') AND EXISTS
             (SELECT 1 FROM orders WHERE mission = id AND action = 'create' AND caller = ?1)",
        )?;
        let open: i64 = count.query_row([caller], |row| row.get(0))?;
        Ok(usize::try_from(open).unwrap_or(usize::MAX))
    }

    /// A secret of this store, from which ids are derived.
    pub fn salt(&self) -> Result<Vec<u8>, StoreError> {
        Ok(self.0.query_row("SELECT salt FROM salts", [], |row| row.get(0))?)
    }

    /// The answer to an earlier request with the key, and the hash of that request.
    pub fn answered(&self, mission: &str, key: &str) -> Result<Option<PreviousAnswer>, StoreError> {
        Ok(idempotency::find(&self.0, mission, key)?)
    }

    /// The newest snapshot, and the sequence of the last event in it.
    pub fn snapshot(&self, mission: u64) -> Result<Option<(u64, Vec<u8>)>, StoreError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT sequence, body FROM snapshots WHERE mission = ?1")?;
        let found = statement.query_row([signed(mission)], |row| Ok((unsigned(row.get(0)?), row.get(1)?)));
        Ok(found.optional()?)
    }

    /// Calls `take` with every event after `after` up to `last`.
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
                let what = format!("events after {after} of mission number {mission} are missing");
                return Err(self.damaged(mission, what));
            };
            after = end.sequence;
            page.iter().try_for_each(&mut *take)?;
        }
        Ok(())
    }

    /// At most `most` events after `sequence`, in order. A gap is an error.
    pub fn events(&self, mission: u64, after: u64, most: usize) -> Result<Vec<StoredEvent>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT sequence, kind, body FROM events WHERE mission = ?1 AND sequence > ?2 ORDER BY sequence LIMIT ?3",
        )?;
        let found = statement.query_map(params![signed(mission), signed(after), limit(most)], event)?;
        let events = found.collect::<rusqlite::Result<Vec<_>>>()?;
        for (event, next) in events.iter().zip(after.saturating_add(1)..) {
            if event.sequence != next {
                return Err(self.damaged(mission, format!("event {next} of mission number {mission}")));
            }
        }
        Ok(events)
    }

    /// The last event of that kind up to `sequence`.
    pub fn last_of_kind(
        &self,
        mission: u64,
        kind: &str,
        sequence: u64,
    ) -> Result<Option<StoredEvent>, StoreError> {
        let mut statement = self.0.prepare_cached(
            "SELECT sequence, kind, body FROM events WHERE mission = ?1 AND kind = ?2 AND sequence <= ?3
             ORDER BY sequence DESC LIMIT 1",
        )?;
        let found = statement.query_row(params![signed(mission), kind, signed(sequence)], event);
        Ok(found.optional()?)
    }

    /// The error for missing data of a mission: damage, unless the mission is being deleted. A deletion marks the mission
    /// first and then removes its events step by step.
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

    /// Number of the mission's last event; 0 without events.
    pub fn last_sequence(&self, mission: u64) -> Result<u64, StoreError> {
        let mut statement = self
            .0
            .prepare_cached("SELECT max(sequence) FROM events WHERE mission = ?1")?;
        let last: Option<i64> = statement.query_row([signed(mission)], |row| row.get(0))?;
        Ok(last.map_or(0, unsigned))
    }

    /// Ids of the missions that have been over since before `trusted_s`, trusted Unix time, s.
    pub fn over_before(&self, trusted_s: f64) -> Result<Vec<String>, StoreError> {
        let over =
            "SELECT id FROM missions WHERE status IN ('finished', 'failed') AND over_s <= ?1 ORDER BY number";
        let mut statement = self.0.prepare_cached(over)?;
        let ids = statement.query_map([trusted_s], |row| row.get(0))?;
        Ok(ids.collect::<rusqlite::Result<_>>()?)
    }

    /// Whether the service had tokens.
    pub fn is_protected(&self) -> Result<bool, StoreError> {
        Ok(self
            .0
            .query_row("SELECT protected FROM guards", [], |row| row.get(0))?)
    }
}

fn select_missions(condition: &str) -> String {
    format!("SELECT number, id, summary FROM missions WHERE {condition}")
}

/// The mission of a row of [`select_missions`].
fn stored_mission(row: &Row<'_>) -> rusqlite::Result<StoredMission> {
    Ok(StoredMission {
        number: unsigned(row.get(0)?),
        id: row.get(1)?,
        summary: row.get(2)?,
    })
}

/// The event of a row of `sequence, kind, body`.
pub(super) fn event(row: &Row<'_>) -> rusqlite::Result<StoredEvent> {
    Ok(StoredEvent {
        sequence: unsigned(row.get(0)?),
        kind: row.get(1)?,
        body: row.get(2)?,
    })
}
