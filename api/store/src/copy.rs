//! Copies everything from one store to another, of either kind. No service uses either meanwhile.

use std::{path::PathBuf, time::Duration};

use clock::Clock;
use rusqlite::Connection;

use super::EventStore;
use super::copy_rows::{TABLES, copy_rows};
use super::error::StoreError;
use super::postgres;
use super::postgres::batch::end;
use super::reader::FILE_NAME;
use super::rows::Rows;

/// Longest time for a statement of a copy: the last ones read every mission.
const PATIENCE: Duration = Duration::from_hours(1);

/// The place of a store.
#[derive(Clone, Debug)]
pub enum StorePlace {
    /// A data directory.
    Directory(PathBuf),
    /// The URL of a database.
    Database(String),
}

/// Numbers of copied rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Copied {
    /// Missions.
    pub missions: u64,
    /// Their events.
    pub events: u64,
}

/// The rows of missions that are not deleted.
const KEPT: &str = "WHERE mission IN (SELECT number FROM missions WHERE status <> 'deleted')";

/// Empties the tables that the schema has filled.
const BEGIN: &str = "BEGIN; DELETE FROM salts; DELETE FROM guards;";

/// Sets the next numbers, which only PostgreSQL keeps.
const COMPLETE: &str = "
    SELECT setval(pg_get_serial_sequence('missions', 'number'), coalesce((SELECT max(number) FROM missions), 1));
    SELECT setval(pg_get_serial_sequence('orders', 'number'), coalesce((SELECT max(number) FROM orders), 1));
";

/// Copies everything with its digests to a store without missions, in one transaction. Fails if
/// anything in `from` is damaged.
pub fn copy(from: &StorePlace, to: &StorePlace, clock: &Clock) -> Result<Copied, StoreError> {
    if let StorePlace::Directory(path) = from
        && !path.join(FILE_NAME).exists()
    {
        return Err(from.refused("there is no mission log"));
    }
    let source = from.open(clock)?;
    let target = to.open(clock)?;
    let before = target.reader()?;
    if !before.missions(0, 1, 0)?.0.is_empty() || !before.orders(None, 0, 1)?.is_empty() {
        return Err(to.refused("it has missions or orders already: choose an empty store"));
    }
    drop(before);
    let source = source.reader()?;
    if let Some(what) = source.damage(true)?.pop() {
        return Err(StoreError::Damaged(what));
    }
    match to {
        StorePlace::Directory(path) => {
            let connection = Connection::open(path.join(FILE_NAME))?;
            connection.execute_batch(BEGIN)?;
            let copied = copy_all(&*source.0, &connection)?;
            connection.execute_batch("COMMIT")?;
            Ok(copied)
        }
        StorePlace::Database(url) => {
            // The connection ends with its database.
            let database = postgres::open(url)?;
            let link = database.connect_for(PATIENCE)?;
            link.batch(BEGIN)?;
            let copied = copy_all(&*source.0, &link)?;
            link.batch(COMPLETE)?;
            end(&link)?;
            Ok(copied)
        }
    }
}

impl StorePlace {
    /// Opens the store. Fails while services use it.
    fn open(&self, clock: &Clock) -> Result<EventStore, StoreError> {
        match self {
            Self::Directory(path) => EventStore::open(path, clock),
            Self::Database(url) => {
                let store = EventStore::open_database(url, None, u64::MAX, clock)?;
                let services = "SELECT id FROM services";
                let first = store.reader()?.0.first(services, &[], |row| row.get::<String>(0))?;
                if first.is_some() {
                    let why = "services use it: stop them (after one was killed: start one for two leases, and stop it)";
                    return Err(self.refused(why));
                }
                Ok(store)
            }
        }
    }

    fn refused(&self, why: &str) -> StoreError {
        match self {
            Self::Directory(path) => StoreError::open(path, &why),
            Self::Database(_) => StoreError::open("of --from or --to".as_ref(), &why),
        }
    }
}

fn copy_all(from: &dyn Rows, to: &dyn Rows) -> Result<Copied, StoreError> {
    let mut copied = Copied::default();
    for (table, _) in TABLES {
        let condition = match table {
            "missions" => "WHERE status <> 'deleted' ORDER BY number",
            "events" | "snapshots" | "answered" => KEPT,
            "orders" => "ORDER BY number",
            _ => "",
        };
        let n = copy_rows(from, to, table, condition, &[])?;
        match table {
            "missions" => copied.missions = n,
            "events" => copied.events = n,
            _ => {}
        }
    }
    Ok(copied)
}
