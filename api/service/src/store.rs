//! The event store: the events of every mission, on the disk before any client learns of them.
//!
//! ```text
//! actors ── Append ──► one writer thread: BEGIN; all waiting appends; COMMIT (fsync) ──► a reply to each
//! readers ── their own connections, which see complete commits only
//! ```
//! SQLite in WAL mode with `synchronous = FULL`: acknowledged events survive a power cut. Appends that arrive during a
//! commit share the next one. Before a reply, the writer makes sure that the files are still at their paths, and adds the
//! events to a list outside the write-ahead file. The store does not know what events mean. Messages call it the mission log.

use std::{
    fs::{self, DirBuilder, File, OpenOptions, Permissions},
    io::{self, Write as _},
    os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _, PermissionsExt as _},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{SyncSender, TrySendError, sync_channel},
    },
    thread,
};

use rusqlite::{Connection, config::DbConfig};
use tokio::sync::oneshot;

use crate::metrics::StoreMetrics;

mod acknowledged;
mod entry;
mod error;
mod idempotency;
mod place;
mod reader;
mod salvage;
mod schema;
mod shares;
mod sql;
#[cfg(test)]
mod tests;
mod trusted_time;
mod writer;

use acknowledged::{Acknowledged, LIST_NAME};

pub use entry::{Append, Appended, AuditEntry, Room, StoredEvent, StoredMission};
pub use error::StoreError;
pub use idempotency::{KeyedAnswer, PreviousAnswer};
use place::{Place, lock};
pub use reader::{EventReader, FILE_NAME};
pub use salvage::REST_NAME;
use sql::LOCK_TIME;
pub use trusted_time::TrustedClock;
use trusted_time::TrustedTime;
use writer::{Command, Reply, Writer};

/// Name of the file that says which acknowledged events were missing at a start. The service is not ready until a person
/// deletes it.
const LOST_NAME: &str = "lost-events.txt";

/// Appends that may wait for the writer: one second of a thousand missions.
const WAITING_MAX: usize = 1_024;

/// Size to which the write-ahead file is truncated when it is empty, bytes.
const JOURNAL_BYTES: i64 = 16 << 20;

/// The event store of a data directory. Clones share it.
#[derive(Clone, Debug)]
pub struct EventStore {
    shared: Arc<Shared>,
    writer: SyncSender<Command>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    place: Arc<Place>,
    clock: TrustedClock,
    /// The first damage that was found.
    damage: Mutex<Option<String>>,
    metrics: StoreMetrics,
}

impl EventStore {
    /// Opens the store in `directory`, creates both if missing, and migrates the store to the newest schema.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        Self::open_with(directory, u64::MAX)
    }

    /// As [`Self::open`]; the missions of one client may take at most `share` bytes.
    pub fn open_with(directory: &Path, share: u64) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        let refused = |error: io::Error| StoreError::open(&path, &error);
        let database = make_private(directory, &path).map_err(refused)?;
        lock(&database, &path)?;
        for name in [
            FILE_NAME.to_owned(),
            format!("{FILE_NAME}-wal"),
            format!("{FILE_NAME}-shm"),
        ] {
            hide(&directory.join(name));
        }
        require_file_of_write_ahead(&path)?;
        let mut connection = Connection::open(&path)
            .and_then(|connection| configure(&connection).map(|()| connection))
            .map_err(|error| StoreError::open(&path, &error))?;
        schema::migrate(&mut connection, &path)?;
        Self::start(connection, &path, database, share)
    }

    fn start(connection: Connection, path: &Path, database: File, share: u64) -> Result<Self, StoreError> {
        let refused = |error: io::Error| StoreError::open(path, &error);
        let directory = path.parent().unwrap_or(Path::new("."));
        let place = Arc::new(Place::new(path, database).map_err(refused)?);
        let (acknowledged, entries) = Acknowledged::open(directory)
            .map_err(|error| StoreError::open(&directory.join(LIST_NAME), &error))?;
        match acknowledged::missing(&connection, &entries) {
            Ok(None) => {}
            Ok(Some(lost)) => {
                tracing::error!(lost, "acknowledged events are missing from the mission log");
                note_lost(&directory.join(LOST_NAME), &lost).map_err(refused)?;
            }
            Err(error) => tracing::error!(%error, "cannot tell which acknowledged events are missing"),
        }
        let mut time = TrustedTime::read(&connection)?;
        time.resume();
        time.write(&connection)?;
        let clock = TrustedClock::new(time);
        let (sender, commands) = sync_channel(WAITING_MAX);
        let metrics = StoreMetrics::default();
        let mut writer = Writer::new(
            connection,
            Arc::clone(&place),
            acknowledged,
            clock.clone(),
            share,
            metrics.clone(),
        )?;
        // What is missing was noted: the list begins again.
        writer.merge();
        let thread = thread::Builder::new().name("mission-log".to_owned());
        thread.spawn(move || writer.run(commands)).map_err(refused)?;
        let shared = Shared {
            path: path.to_owned(),
            place,
            clock,
            damage: Mutex::default(),
            metrics,
        };
        Ok(Self {
            shared: Arc::new(shared),
            writer: sender,
        })
    }

    /// Its metrics.
    pub(crate) fn metrics(&self) -> &StoreMetrics {
        &self.shared.metrics
    }

    /// Appends. After `Ok` the events are on the disk, from this or an earlier request with the same key.
    pub async fn append(&self, append: Append) -> Result<Appended, StoreError> {
        self.send(|reply| Command::Append(append, reply)).await
    }

    /// Deletes the mission called `id`, and stores who ordered it. False if there is no such mission.
    pub async fn delete(&self, id: String, order: AuditEntry) -> Result<bool, StoreError> {
        let deleted = self.send(|reply| Command::Delete(id, order, reply)).await?;
        if deleted && self.damage().is_some() {
            // The damage may be gone with the mission.
            let store = self.clone();
            thread::spawn(move || {
                let verdict = store.verdict();
                *store.damage() = verdict;
            });
        }
        Ok(deleted)
    }

    /// The time by which tokens expire and old missions are deleted.
    #[must_use]
    pub fn clock(&self) -> &TrustedClock {
        &self.shared.clock
    }

    /// Reads the machine's clocks, and stores the trusted time. Call it every few minutes.
    pub async fn read_clocks(&self) -> Result<(), StoreError> {
        let time = self.shared.clock.read_clocks();
        self.send(|reply| Command::KeepTime(time, reply)).await
    }

    /// Takes the machine's time, because a person says that it is right.
    pub async fn believe_clock(&self) -> Result<(), StoreError> {
        let time = self.shared.clock.believe_clock();
        self.send(|reply| Command::KeepTime(time, reply)).await
    }

    /// Stores that the service has tokens: it never runs without them again.
    pub async fn protect(&self) -> Result<(), StoreError> {
        self.send(Command::Protect).await
    }

    /// Returns the disk space of deleted missions. Appends wait meanwhile.
    pub async fn vacuum(&self) -> Result<(), StoreError> {
        self.send(Command::Vacuum).await
    }

    /// Fails if damage was found or the store cannot be written.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let damage = self.damage().clone();
        if let Some(what) = damage {
            return Err(StoreError::Damaged(what));
        }
        let lost = self.shared.path.with_file_name(LOST_NAME);
        match fs::read_to_string(&lost) {
            Ok(what) => {
                return Err(StoreError::Damaged(format!(
                    "acknowledged events are missing. Read and delete {}: {what}",
                    lost.display()
                )));
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(StoreError::open(&lost, &error)),
        }
        self.send(Command::Probe).await
    }

    async fn send<T>(&self, command: impl FnOnce(Reply<T>) -> Command) -> Result<T, StoreError> {
        let (reply, answer) = oneshot::channel();
        self.writer
            .try_send(command(reply))
            .map_err(|error| match error {
                TrySendError::Full(_) => StoreError::Busy,
                TrySendError::Disconnected(_) => StoreError::Closed,
            })?;
        answer.await.map_err(|_| StoreError::Unanswered)?
    }

    /// Ends the writer after all earlier appends, and merges the write-ahead file. Later appends fail.
    pub async fn close(&self) -> Result<(), StoreError> {
        self.send(Command::Close).await
    }

    /// A reading connection. It sees complete commits only.
    pub fn reader(&self) -> Result<EventReader, StoreError> {
        self.shared.place.check()?;
        EventReader::open(&self.shared.path, Some(Arc::clone(&self.shared.place)))
    }

    /// Checks the whole file for damage, which [`Self::probe`] then reports. Slow.
    pub fn inspect(&self) {
        if let Some(what) = self.verdict() {
            self.note_damage(what);
        }
    }

    fn verdict(&self) -> Option<String> {
        match self.reader().and_then(|reader| reader.inspect()) {
            Ok(()) => None,
            Err(StoreError::Damaged(what)) => Some(what),
            Err(other) => Some(other.to_string()),
        }
    }

    /// Remembers the first damage that was found.
    pub fn note_damage(&self, what: String) {
        tracing::error!(what, "the mission log is damaged");
        self.damage().get_or_insert(what);
    }

    fn damage(&self) -> MutexGuard<'_, Option<String>> {
        self.shared.damage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Creates the directory and the file if missing, readable by the service's user only. SQLite gives its other files the
/// same mode. Returns the file.
fn make_private(directory: &Path, path: &Path) -> io::Result<File> {
    DirBuilder::new().recursive(true).mode(0o700).create(directory)?;
    let database = private_file(path)?;
    File::open(directory)?.sync_all()?;
    Ok(database)
}

/// Opens a file at its end; creates it if missing, for this user only.
fn private_file(path: &Path) -> io::Result<File> {
    OpenOptions::new()
        .append(true)
        .create(true)
        .mode(0o600)
        .open(path)
}

/// Adds to the file that says what was lost.
fn note_lost(path: &Path, lost: &str) -> io::Result<()> {
    let mut file = private_file(path)?;
    writeln!(file, "{lost}")?;
    file.sync_all()
}

/// Makes a file of an older version private.
fn hide(path: &Path) {
    if let Err(error) = fs::set_permissions(path, Permissions::from_mode(0o600))
        && error.kind() != io::ErrorKind::NotFound
    {
        tracing::warn!(%error, path = %path.display(), "other users may read the mission log");
    }
}

/// Fails where the store's file was emptied or lost: SQLite deletes a write-ahead file beside an empty file.
fn require_file_of_write_ahead(path: &Path) -> Result<(), StoreError> {
    let bytes = |path: &Path| match fs::metadata(path) {
        Ok(file) => Ok(file.len()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(0),
        Err(error) => Err(StoreError::open(path, &error)),
    };
    let ahead = path.with_extension("sqlite3-wal");
    if bytes(path)? == 0 && 0 < bytes(&ahead)? {
        return Err(StoreError::Damaged(format!(
            "{} is empty or missing, but its write-ahead file {} is not; restore the directory from a backup",
            path.display(),
            ahead.display()
        )));
    }
    Ok(())
}

/// WAL, and a commit that waits for the disk.
fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(LOCK_TIME)?;
    // Has an effect only before the first table is created; an older store keeps its space until `VACUUM`.
    connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "journal_size_limit", JOURNAL_BYTES)?;
    // The writer merges, and knows then that everything is merged.
    connection.pragma_update(None, "wal_autocheckpoint", 0)?;
    // The last connection would delete the write-ahead file by its path, where another service's may be by then.
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    connection.pragma_update(None, "foreign_keys", true)
}
