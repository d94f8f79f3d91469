//! The event store: the events of every mission, on the disk before any client hears of it.
//!
//! ```text
//! actors ── Append ──► one writer thread: BEGIN; all waiting appends; COMMIT (fsync) ──► a reply to each
//! readers ── connections of their own, which see whole commits only
//! ```
//! SQLite in WAL mode with `synchronous = FULL`: acknowledged events survive a power cut. Appends that wait while one
//! commit is on its way to the disk share the next. The store knows nothing of what events mean.

use std::{
    fs::{self, DirBuilder, File, OpenOptions, Permissions, TryLockError},
    io,
    os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _, PermissionsExt as _},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{SyncSender, TrySendError, sync_channel},
    },
    thread,
};

use rusqlite::Connection;
use tokio::sync::oneshot;

use crate::metrics::StoreMetrics;

mod entry;
mod error;
mod idempotency;
mod reader;
mod schema;
mod shares;
mod sql;
#[cfg(test)]
mod tests;
mod write_ahead;
mod writer;

pub use entry::{Append, Appended, Order, Room, StoredEvent, StoredMission, StoredOrder};
pub use error::StoreError;
pub use idempotency::{KeyedAnswer, PreviousAnswer};
pub use reader::{EventReader, FILE_NAME, MaybeDamaged};
use sql::LOCK_TIME;
use writer::{Command, Reply, Writer};

/// Name of the file whose lock belongs to the process that writes.
const LOCK_NAME: &str = "missions.lock";

/// Appends that may wait for the writer: a second of a thousand missions.
const WAITING_MAX: usize = 1_024;

/// Longest that the empty write-ahead file stays, bytes.
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
    /// Locked as long as this lives.
    _lock: File,
    /// Damage that was found in what is stored.
    damage: Mutex<Option<String>>,
    metrics: StoreMetrics,
}

impl EventStore {
    /// Opens the store in `directory`, makes both if they are not there, and brings the store to the newest schema.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        Self::open_with(directory, u64::MAX)
    }

    /// As [`Self::open`]; the missions of one client may take at most `share` bytes.
    pub fn open_with(directory: &Path, share: u64) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        make_private(directory, &path).map_err(|error| StoreError::open(&path, &error))?;
        let lock = lock(directory, &path)?;
        for name in [
            FILE_NAME.to_owned(),
            format!("{FILE_NAME}-wal"),
            format!("{FILE_NAME}-shm"),
        ] {
            hide(&directory.join(name));
        }
        write_ahead::check(&path)?;
        let mut connection = Connection::open(&path)
            .and_then(|connection| configure(&connection).map(|()| connection))
            .map_err(|error| StoreError::open(&path, &error))?;
        schema::migrate(&mut connection, &path)?;
        Self::start(connection, path, lock, share)
    }

    fn start(connection: Connection, path: PathBuf, lock: File, share: u64) -> Result<Self, StoreError> {
        let (sender, commands) = sync_channel(WAITING_MAX);
        let metrics = StoreMetrics::default();
        let writer = Writer::new(connection, share, metrics.clone())?;
        let thread = thread::Builder::new().name("mission-log".to_owned());
        thread
            .spawn(move || writer.run(&commands))
            .map_err(|error| StoreError::open(&path, &error))?;
        let shared = Shared {
            path,
            _lock: lock,
            damage: Mutex::default(),
            metrics,
        };
        Ok(Self {
            shared: Arc::new(shared),
            writer: sender,
        })
    }

    /// The data directory.
    pub(crate) fn directory(&self) -> &Path {
        self.shared.path.parent().unwrap_or(Path::new("."))
    }

    /// What it counts.
    pub(crate) fn metrics(&self) -> &StoreMetrics {
        &self.shared.metrics
    }

    /// Appends. After `Ok` it is on the disk, now or from an earlier request with the same key.
    pub async fn append(&self, append: Append) -> Result<Appended, StoreError> {
        self.send(|reply| Command::Append(append, reply)).await
    }

    /// Deletes the mission called `id`, as it was ordered; whether there was one.
    pub async fn delete(&self, id: String, order: Order) -> Result<bool, StoreError> {
        self.send(|reply| Command::Delete(id, order, reply)).await
    }

    /// Gives the room of everything that was deleted back to the disk. Nothing is stored meanwhile.
    pub async fn vacuum(&self) -> Result<(), StoreError> {
        self.send(Command::Vacuum).await
    }

    /// Fails if damage was found, or if nothing can be stored.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let damage = self.damage().clone();
        match damage {
            Some(what) => Err(StoreError::Damaged(what)),
            None => self.send(Command::Probe).await,
        }
    }

    async fn send<T>(&self, command: impl FnOnce(Reply<T>) -> Command) -> Result<T, StoreError> {
        let (reply, answer) = oneshot::channel();
        self.writer
            .try_send(command(reply))
            .map_err(|error| match error {
                TrySendError::Full(_) => StoreError::Busy,
                TrySendError::Disconnected(_) => StoreError::Closed,
            })?;
        answer.await.map_err(|_| StoreError::Closed)?
    }

    /// Ends the writer, once everything before is stored, and leaves the store's file whole by itself. Later appends fail.
    pub async fn close(&self) -> Result<(), StoreError> {
        self.send(Command::Close).await
    }

    /// A connection that reads. It sees whole commits only.
    pub fn reader(&self) -> Result<EventReader, StoreError> {
        EventReader::open(&self.shared.path)
    }

    /// Looks through everything for damage, which [`Self::probe`] then reports. Takes its time.
    pub fn inspect(&self) {
        match self.reader().and_then(|reader| reader.inspect()) {
            Ok(()) => {}
            Err(StoreError::Damaged(what)) => self.note_damage(what),
            Err(other) => self.note_damage(other.to_string()),
        }
    }

    /// Remembers the first damage that was found.
    pub fn note_damage(&self, what: String) {
        tracing::error!(what, "the mission log is not what was stored");
        self.damage().get_or_insert(what);
    }

    fn damage(&self) -> MutexGuard<'_, Option<String>> {
        self.shared.damage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Makes the directory and the store's file where they are not there. Only the service's user may read what is made here:
/// SQLite gives the files beside the store's the same mode.
fn make_private(directory: &Path, path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(directory)?;
    OpenOptions::new()
        .append(true)
        .create(true)
        .mode(0o600)
        .open(path)?;
    Ok(())
}

/// Takes a file of an older version from other users' eyes.
fn hide(path: &Path) {
    if let Err(error) = fs::set_permissions(path, Permissions::from_mode(0o600))
        && error.kind() != io::ErrorKind::NotFound
    {
        tracing::warn!(%error, path = %path.display(), "other users may read the mission log");
    }
}

/// Takes the directory for this process alone.
fn lock(directory: &Path, path: &Path) -> Result<File, StoreError> {
    let refused = |error| StoreError::open(path, &error);
    let file = File::create(directory.join(LOCK_NAME)).map_err(refused)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse {
            path: path.to_owned(),
        }),
        Err(TryLockError::Error(error)) => Err(refused(error)),
    }
}

/// WAL, and a commit that waits for the disk.
fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(LOCK_TIME)?;
    // Takes effect before the first table is made; an older store keeps its room until `VACUUM`.
    connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "journal_size_limit", JOURNAL_BYTES)?;
    connection.pragma_update(None, "foreign_keys", true)
}
