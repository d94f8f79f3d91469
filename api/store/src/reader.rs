//! Reads complete commits.

use std::{path::Path, sync::Arc};

use rusqlite::{Connection, OpenFlags};
use wire::mission::Order;

use super::digest::{CHECKPOINT, digest};
use super::entry::{FIND_ANSWER, PreviousAnswer, StoredEvent, StoredMission};
use super::error::StoreError;
use super::locked::Locked;
use super::open_files::OpenFiles;
use super::packed::unpack;
use super::rows::{MISSION, Param, Rows, SqlRow, stored_mission};
use super::schema;
use super::sql::{LOCK_TIME, limit, signed, unsigned};

/// Name of the store's file in the data directory.
pub const FILE_NAME: &str = "missions.sqlite3";

const PAGE: usize = 64;

/// Reads the event store.
#[derive(Debug)]
pub struct EventReader(
    pub(super) Box<dyn Rows>,
    /// The writer's lock in the same process. It is dropped after the connection.
    #[expect(dead_code, reason = "holds the lock")]
    Option<Arc<OpenFiles>>,
);

impl EventReader {
    /// Reads the store in `directory`; a service may be writing to it.
    pub fn of(directory: &Path) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        if !path.try_exists().map_err(StoreError::at(&path))? {
            let reason = "there is no such file: give the data directory of the service with --data";
            return Err(StoreError::open(&path, &reason));
        }
        let connection = connect(&path)?;
        schema::require_newest(&connection, &path)?;
        Ok(Self(Box::new(connection), None))
    }

    pub(super) fn in_database(connection: impl Rows + 'static) -> Self {
        Self(Box::new(connection), None)
    }

    pub(super) fn open(path: &Path, files: Option<Arc<OpenFiles>>) -> Result<Self, StoreError> {
        Ok(Self(Box::new(connect(path)?), files))
    }

    /// The missions with numbers above `after`, in order, and `true` if more follow: at most
    /// `most`, and at most `bytes` of summaries except for a single longer one.
    pub fn missions(
        &self,
        after: u64,
        most: usize,
        bytes: usize,
    ) -> Result<(Vec<StoredMission>, bool), StoreError> {
        let page = "number > ?1 AND status <> 'deleted' ORDER BY number LIMIT ?2";
        let mut listed: Vec<StoredMission> = vec![];
        let (mut left, mut more) = (bytes, false);
        let params: [&dyn Param; 2] = [&signed(after), &limit(most.saturating_add(1))];
        self.0.each(&select_missions(page), &params, &mut |row| {
            let mission = stored_mission(row)?;
            more = listed.len() == most || (left < mission.summary.len() && !listed.is_empty());
            if !more {
                left = left.saturating_sub(mission.summary.len());
                listed.push(mission);
            }
            Ok(!more)
        })?;
        Ok((listed, more))
    }

    /// All missions with `status`, in order.
    pub fn missions_with_status(&self, status: &str) -> Result<Vec<StoredMission>, StoreError> {
        self.missions_where("status = ?1 ORDER BY number", &[&status])
    }

    /// The mission with the id `id`.
    pub fn mission(&self, id: &str) -> Result<Option<StoredMission>, StoreError> {
        let mut named = self.missions_where("id = ?1 AND status <> 'deleted'", &[&self.0.text(id)])?;
        Ok(named.pop())
    }

    fn missions_where(
        &self,
        condition: &str,
        params: &[&dyn Param],
    ) -> Result<Vec<StoredMission>, StoreError> {
        self.0.all(&select_missions(condition), params, stored_mission)
    }

    /// At most `most` orders with numbers above `after`, of one mission or of all.
    pub fn orders(&self, mission: Option<&str>, after: u64, most: usize) -> Result<Vec<Order>, StoreError> {
        // PostgreSQL takes the type of a parameter from its first use.
        let page = "SELECT number, mission, at_s, caller, request, action FROM orders
            WHERE ?1 < number AND (mission = ?2 OR ?2 IS NULL) ORDER BY number LIMIT ?3";
        let mission = mission.map(|id| self.0.text(id));
        let params: [&dyn Param; 3] = [&signed(after), &mission, &limit(most)];
        self.0.all(page, &params, |row| {
            Ok(Order {
                number: unsigned(row.get(0)?),
                mission: row.get(1)?,
                at_s: row.get(2)?,
                caller: row.get(3)?,
                request_id: row.get(4)?,
                action: row.get(5)?,
            })
        })
    }

    /// The last orders of a mission, at most `most`, newest first.
    pub fn last_orders(&self, mission: &str, most: usize) -> Result<Vec<Order>, StoreError> {
        let newest = "SELECT number FROM orders WHERE mission = ?1 ORDER BY number DESC LIMIT 1 OFFSET ?2";
        let after = self.0.first(newest, &[&mission, &limit(most)], |row| row.get(0))?;
        let mut orders = self.orders(Some(mission), after.map_or(0, unsigned), most)?;
        orders.reverse();
        Ok(orders)
    }

    /// Number of unfinished missions that `caller` has created.
    pub fn count_open(&self, caller: &str) -> Result<usize, StoreError> {
        let count =
            "SELECT count(*) FROM missions WHERE status IN ('created', 'running', 'paused') AND EXISTS
            (SELECT 1 FROM orders WHERE mission = id AND action = 'create' AND caller = ?1)";
        let open: Option<i64> = self.0.first(count, &[&caller], |row| row.get(0))?;
        Ok(usize::try_from(open.unwrap_or(0)).unwrap_or(usize::MAX))
    }

    /// The secret of this store from which ids are derived.
    pub fn salt(&self) -> Result<Vec<u8>, StoreError> {
        self.0.one("SELECT salt FROM salts", |row| row.get(0))
    }

    /// The answer to an earlier request with the key, and the hash of that request.
    pub fn answered(&self, mission: &str, key: &str) -> Result<Option<PreviousAnswer>, StoreError> {
        let (mission, key) = (self.0.text(mission), self.0.text(key));
        let found =
            self.0.first(FIND_ANSWER, &[&mission, &key], |row| Ok((row.get::<Vec<u8>>(0)?, row.get(1)?)))?;
        let Some((request, answer)) = found else {
            return Ok(None);
        };
        let request = request.try_into();
        let request = request.map_err(|_| StoreError::Damaged(format!("the key {key} has no hash")))?;
        Ok(Some((request, answer)))
    }

    /// The newest checkpoint, and the sequence of its last event.
    pub fn snapshot(&self, mission: u64) -> Result<Option<(u64, Vec<u8>)>, StoreError> {
        let newest =
            "SELECT sequence, body, digest, (SELECT digest FROM events WHERE mission = snapshots.mission
            AND sequence = snapshots.sequence) FROM snapshots WHERE mission = ?1";
        let found = self.0.first(newest, &[&signed(mission)], |row| {
            let (sequence, body): (_, Vec<u8>) = (row.get(0)?, row.get(1)?);
            let (stored, before): (Vec<u8>, Option<Vec<u8>>) = (row.get(2)?, row.get(3)?);
            let before = before.unwrap_or_default();
            let expected = digest(signed(mission), sequence, CHECKPOINT, &before, &body);
            Ok((unsigned(sequence), body, stored == expected))
        })?;
        match found {
            Some((sequence, _, false)) => {
                let what = format!("its checkpoint at event {sequence} is not what was stored");
                Err(self.damaged(mission, &what))
            }
            Some((sequence, body, true)) => Ok(Some((sequence, unpack(body)?))),
            None => Ok(None),
        }
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
                return Err(self.damaged(mission, &format!("events {} to {last} are missing", after + 1)));
            };
            after = end.sequence;
            page.iter().try_for_each(&mut *take)?;
        }
        Ok(())
    }

    /// At most `most` events after `sequence`, in order. A gap is an error.
    pub fn events(&self, mission: u64, after: u64, most: usize) -> Result<Vec<StoredEvent>, StoreError> {
        let page = select_events("sequence - 1 = ?2", "sequence > ?2 ORDER BY sequence LIMIT ?3");
        let params: [&dyn Param; 3] = [&signed(mission), &signed(after), &limit(most)];
        let read: Vec<_> = self.0.all(&page, &params, Linked::read)?;
        let mut before = None;
        let numbered = read.into_iter().zip(after.saturating_add(1)..);
        let events = numbered.map(|(mut linked, next)| {
            linked.before = before.take().or(linked.before);
            before = Some(linked.digest.clone());
            if linked.event.sequence != next {
                return Err(self.damaged(mission, &format!("event {next} is missing")));
            }
            linked.whole().map_err(|fault| self.damaged(mission, &fault))
        });
        events.collect()
    }

    /// The last event of `kind` up to `sequence`.
    pub fn last_of_kind(
        &self,
        mission: u64,
        kind: &str,
        sequence: u64,
    ) -> Result<Option<StoredEvent>, StoreError> {
        let condition = "kind = ?2 AND sequence <= ?3 ORDER BY sequence DESC LIMIT 1";
        let (last, number) = (select_events("TRUE", condition), signed(mission));
        let found = self.0.first(&last, &[&number, &kind, &signed(sequence)], Linked::read)?;
        found.map(Linked::whole).transpose().map_err(|fault| self.damaged(mission, &fault))
    }

    /// The error for missing data of a mission: damage, unless the mission is being deleted. A
    /// deletion marks the mission first and then removes its events step by step.
    pub fn damaged(&self, mission: u64, what: &str) -> StoreError {
        let mark = "SELECT id FROM missions WHERE number = ?1 AND status <> 'deleted'";
        let found = self.0.first(mark, &[&signed(mission)], |row| row.get::<String>(0));
        match found {
            Ok(Some(id)) => StoreError::Damaged(format!("mission {id}: {what}")),
            Ok(None) => StoreError::Gone,
            Err(error) => error,
        }
    }

    /// Number of the mission's last event; 0 without events.
    pub fn last_sequence(&self, mission: u64) -> Result<u64, StoreError> {
        let row = format!("SELECT {} FROM missions WHERE number = ?1", Locked::COLUMNS);
        let found = self.0.first(&row, &[&signed(mission)], Locked::read)?;
        let last = found.map_or(Ok(0), |found| found.last());
        last.map(unsigned).map_err(|fault| self.damaged(mission, &fault))
    }

    /// Ids of the missions that were over before `trusted_s`, trusted Unix time, s.
    pub fn over_before(&self, trusted_s: f64) -> Result<Vec<String>, StoreError> {
        let over =
            "SELECT id FROM missions WHERE status IN ('finished', 'failed') AND over_s <= ?1 ORDER BY number";
        self.0.all(over, &[&trusted_s], |row| row.get(0))
    }

    /// `true` if the service has had tokens.
    pub fn is_protected(&self) -> Result<bool, StoreError> {
        let protected: i64 = self.0.one("SELECT protected FROM guards", |row| row.get(0))?;
        Ok(protected != 0)
    }
}

fn connect(path: &Path) -> Result<Connection, StoreError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(LOCK_TIME)?;
    Ok(connection)
}

fn select_missions(condition: &str) -> String {
    format!("SELECT {MISSION} FROM missions WHERE {condition}")
}

/// Selects events of mission `?1`; those that meet `first` with their predecessor's digest.
fn select_events(first: &str, condition: &str) -> String {
    format!(
        "SELECT mission, sequence, kind, body, digest, CASE WHEN {first} THEN (SELECT digest FROM events AS earlier
         WHERE earlier.mission = events.mission AND earlier.sequence = events.sequence - 1) END
         FROM events WHERE mission = ?1 AND {condition}"
    )
}

/// An event, and its link to the previous event.
struct Linked {
    event: StoredEvent,
    mission: i64,
    digest: Vec<u8>,
    before: Option<Vec<u8>>,
}

impl Linked {
    /// Reads a row of [`select_events`].
    fn read(row: &dyn SqlRow) -> Result<Self, StoreError> {
        let event = StoredEvent {
            sequence: unsigned(row.get(1)?),
            kind: row.get(2)?,
            body: row.get::<Vec<u8>>(3)?.into(),
        };
        Ok(Self { event, mission: row.get(0)?, digest: row.get(4)?, before: row.get(5)? })
    }

    /// The event, or its fault.
    fn whole(self) -> Result<StoredEvent, String> {
        let StoredEvent { sequence, kind, body } = self.event;
        if self.before.is_none() && 1 < sequence {
            return Err(format!("event {} is missing", sequence - 1));
        }
        let before = self.before.as_deref().unwrap_or_default();
        let expected = digest(self.mission, signed(sequence), &kind, before, &body);
        let is_whole = self.digest == expected;
        let body = is_whole.then(|| unpack(body.to_vec()).ok()).flatten();
        let body = body.ok_or_else(|| format!("event {sequence} is not what was stored"))?;
        Ok(StoredEvent { sequence, kind, body: body.into() })
    }
}
