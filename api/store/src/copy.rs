//! Copies everything from one store to another, of either kind. No service uses either meanwhile.

use std::{path::PathBuf, time::Duration};

use clock::Clock;
use rusqlite::Connection;
use tokio_postgres::types::ToSql;

use super::{
    EventStore,
    error::StoreError,
    postgres::{self, batch::end, link::Link},
    reader::FILE_NAME,
    rows::{Param, Row, Rows},
    sql::{with_nul, without_nul},
};

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

/// A type of column.
#[derive(Clone, Copy)]
enum Kind {
    Whole,
    Real,
    OptionalReal,
    Text,
    /// A text that may have a NUL.
    Key,
    Bytes,
}
use Kind::{Bytes, Key, OptionalReal, Real, Text, Whole};

/// A table: its name, the condition of the copied rows, and its columns.
type Table = (&'static str, &'static str, &'static [(&'static str, Kind)]);

/// The rows of missions that are not deleted.
const KEPT: &str = "WHERE mission IN (SELECT number FROM missions WHERE status <> 'deleted')";

/// In the order of their references.
const TABLES: [Table; 7] = [
    (
        "missions",
        "WHERE status <> 'deleted' ORDER BY number",
        &[
            ("number", Whole),
            ("id", Text),
            ("status", Text),
            ("summary", Bytes),
            ("owner", Text),
            ("bytes", Whole),
            ("over_s", OptionalReal),
            ("sequence", Whole),
            ("head", Bytes),
            ("digest", Bytes),
        ],
    ),
    (
        "events",
        KEPT,
        &[
            ("mission", Whole),
            ("sequence", Whole),
            ("kind", Text),
            ("body", Bytes),
            ("digest", Bytes),
        ],
    ),
    (
        "snapshots",
        KEPT,
        &[
            ("mission", Whole),
            ("sequence", Whole),
            ("body", Bytes),
            ("digest", Bytes),
        ],
    ),
    (
        "answered",
        KEPT,
        &[
            ("mission", Whole),
            ("key", Key),
            ("request", Bytes),
            ("answer", Bytes),
        ],
    ),
    (
        "orders",
        "ORDER BY number",
        &[
            ("number", Whole),
            ("at_s", Real),
            ("caller", Text),
            ("request", Text),
            ("mission", Text),
            ("action", Text),
        ],
    ),
    ("salts", "", &[("salt", Bytes)]),
    (
        "guards",
        "",
        &[
            ("protected", Whole),
            ("trusted_s", Real),
            ("agreed_s", Real),
            ("clock_s", Real),
            ("up_s", Real),
        ],
    ),
];

/// Empties the tables that the schema has filled.
const WITH_ROW: &str = "DELETE FROM salts; DELETE FROM guards;";

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
            copy_all(&source.0, &Target::Sqlite(&connection))
        }
        StorePlace::Database(url) => {
            let database = postgres::open(url)?;
            copy_all(&source.0, &Target::Postgres(&database.connect_for(PATIENCE)?))
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
                let first = store
                    .reader()?
                    .0
                    .first(services, &[], |row| row.get::<String>(0))?;
                match first {
                    None => Ok(store),
                    Some(_) => Err(self
                        .refused("services use it: stop them (after one was killed: start one for two leases, and stop it)")),
                }
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

/// The writing connection.
enum Target<'a> {
    Sqlite(&'a Connection),
    Postgres(&'a Link),
}

impl Target<'_> {
    fn batch(&self, statements: &str) -> Result<(), StoreError> {
        match self {
            Self::Sqlite(connection) => Ok(connection.execute_batch(statements)?),
            Self::Postgres(link) => link.batch(statements),
        }
    }

    fn insert(&self, statement: &str, values: &[Box<dyn Param>]) -> Result<(), StoreError> {
        match self {
            Self::Sqlite(connection) => {
                let mut insert = connection.prepare_cached(statement)?;
                let values = values.iter().map(|value| &**value as &dyn rusqlite::ToSql);
                insert.execute(rusqlite::params_from_iter(values))?;
            }
            Self::Postgres(link) => {
                let values: Vec<_> = values
                    .iter()
                    .map(|value| &**value as &(dyn ToSql + Sync))
                    .collect();
                link.execute(statement, &values)?;
            }
        }
        Ok(())
    }
}

fn copy_all(source: &Rows, target: &Target<'_>) -> Result<Copied, StoreError> {
    target.batch("BEGIN")?;
    target.batch(WITH_ROW)?;
    let mut copied = Copied::default();
    for (table, rows, columns) in TABLES {
        let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
        let places: Vec<String> = (1..=columns.len()).map(|place| format!("?{place}")).collect();
        let (names, places) = (names.join(", "), places.join(", "));
        let insert = format!("INSERT INTO {table} ({names}) VALUES ({places})");
        let mut n = 0;
        source.each(&format!("SELECT {names} FROM {table} {rows}"), &[], &mut |row| {
            let values = columns.iter().enumerate();
            let values = values.map(|(column, (_, kind))| value(row, column, *kind, target));
            target.insert(&insert, &values.collect::<Result<Vec<_>, _>>()?)?;
            n += 1;
            Ok(true)
        })?;
        match table {
            "missions" => copied.missions = n,
            "events" => copied.events = n,
            _ => {}
        }
    }
    match target {
        Target::Sqlite(_) => target.batch("COMMIT")?,
        Target::Postgres(link) => {
            link.batch(COMPLETE)?;
            end(link)?;
        }
    }
    Ok(copied)
}

fn value(row: &Row<'_>, column: usize, kind: Kind, to: &Target<'_>) -> Result<Box<dyn Param>, StoreError> {
    Ok(match kind {
        Kind::Whole => Box::new(row.get::<i64>(column)?),
        Kind::Real => Box::new(row.get::<f64>(column)?),
        Kind::OptionalReal => Box::new(row.get::<Option<f64>>(column)?),
        Kind::Text => Box::new(row.get::<String>(column)?),
        Kind::Key => {
            let key: String = row.get(column)?;
            Box::new(match to {
                Target::Sqlite(_) => with_nul(&key),
                Target::Postgres(_) => without_nul(&key).into_owned(),
            })
        }
        Kind::Bytes => Box::new(row.get::<Vec<u8>>(column)?),
    })
}
