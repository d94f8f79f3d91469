//! The event log: what happened to every mission, on disk before anyone is told that it did.
//!
//! ```text
//! actors ── Append ──► one writer thread: BEGIN; every append that waits; COMMIT (fsync) ──► each is told
//! readers ── connections of their own, which see whole commits only
//! ```
//! SQLite in WAL mode with `synchronous = FULL`: what was acknowledged survives a power cut. Appends that wait while
//! one commit is on its way to the disk share the next.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{SyncSender, TrySendError, sync_channel},
    },
    thread,
    time::Duration,
};

use rusqlite::{Connection, ErrorCode, OptionalExtension as _, params};
use sha2::{Digest as _, Sha256};
use tokio::sync::oneshot;

mod reader;
mod schema;
mod tail;
#[cfg(test)]
mod tests;
mod writer;

pub use reader::Reader;
use writer::{Order, Told, Writer, deleted};

/// Name of the log's file in the data directory.
pub const FILE_NAME: &str = "missions.sqlite3";

/// Name of the file whose lock says that somebody writes.
const LOCK_NAME: &str = "missions.lock";

/// Appends that may wait for the writer: a second of a thousand missions.
const WAITING_MAX: usize = 1_024;

/// What the write-ahead file may keep of the disk when it is empty, bytes.
const JOURNAL_BYTES: i64 = 16 << 20;

/// How long a connection waits for another's lock. Only a checkpoint takes one.
const LOCK_TIME: Duration = Duration::from_secs(5);

/// An event of a mission as it is stored: what it is of is known to its reader only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// Its number in its mission, from 1 on without a gap.
    pub sequence: u64,
    /// What kind it is.
    pub kind: String,
    /// JSON.
    pub body: Vec<u8>,
}

/// A mission as the list of all missions shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Its number, by which lists are ordered and continued.
    pub number: u64,
    /// Its name in paths.
    pub id: String,
    /// JSON of what it was last.
    pub summary: Vec<u8>,
}

/// What is to be appended to one mission, all of it or nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Append {
    /// The mission's name.
    pub mission: String,
    /// The mission's number; none for one that these events make. Names are given again after a mission is deleted,
    /// numbers are not.
    pub number: Option<u64>,
    /// Events, whose sequence continues that of the mission.
    pub events: Vec<Event>,
    /// Where the mission is in its life after them: by it those under way are found at a start.
    pub status: String,
    /// What the mission is after them, JSON.
    pub summary: Vec<u8>,
    /// What the fold of all events up to the last of these comes to, where it is worth keeping.
    pub snapshot: Option<Vec<u8>>,
    /// The client's key of the request that these answer, and the answer.
    pub answered: Option<Answered>,
}

/// An answer that is given again to whoever sends the same key again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answered {
    /// The client's key.
    pub key: String,
    /// What was asked, as a hash: the same key for something else is a mistake.
    pub request: [u8; 32],
    /// The answer, JSON.
    pub answer: Vec<u8>,
}

/// What was asked for, as a hash, and what was answered.
pub type Before = ([u8; 32], Vec<u8>);

/// What became of an append.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Appended {
    /// It was stored.
    Now,
    /// Its key had been answered before, with this; nothing of it was stored.
    Before(Vec<u8>),
    /// Its key had been answered before, when it was asked for something else; nothing of it was stored.
    KeyTaken,
    /// The mission was deleted; nothing was stored.
    Gone,
    /// The mission has gone on without whoever asks; nothing was stored.
    Overtaken,
}

/// Why the log does not do what it should.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// The directory or the file cannot be used.
    #[error("cannot open the mission log {path}: {reason}")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file was written by a later version of this program.
    #[error(
        "the mission log {path} has schema {found}, this program knows up to {known}: use the newer program"
    )]
    TooNew {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: u32,
        /// The newest known.
        known: u32,
    },
    /// The file was written by an earlier version of this program.
    #[error(
        "the mission log {path} has schema {found}, this program reads {known}: start the service once, which brings \
         it there"
    )]
    TooOld {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: u32,
        /// What is read.
        known: u32,
    },
    /// Another program writes to it.
    #[error(
        "the mission log {path} is in use by another pilotfish: stop that one, or choose another --data directory"
    )]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// There is no room.
    #[error("the disk under the mission log is full: nothing was stored; make room and send it again")]
    Full,
    /// What was written cannot be read back as it was.
    #[error("the mission log is damaged: {0}")]
    Damaged(String),
    /// The disk does not take it.
    #[error("the mission log cannot be written: {0}; nothing was stored")]
    Refused(String),
    /// More is to be written than the disk takes.
    #[error("the mission log is behind: nothing was stored; try again in a moment")]
    Busy,
    /// The writer has ended.
    #[error("the mission log is closed")]
    Closed,
}

impl From<rusqlite::Error> for LogError {
    fn from(error: rusqlite::Error) -> Self {
        let text = error.to_string();
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => Self::Damaged(text),
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Busy,
            _ => Self::Refused(text),
        }
    }
}

/// The log of a data directory. Clones share it.
#[derive(Clone, Debug)]
pub struct Log {
    shared: Arc<Shared>,
    writer: SyncSender<Order>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    /// Locked as long as this lives.
    _lock: File,
    /// What was found to be wrong with what is stored.
    damage: Mutex<Option<String>>,
}

impl Log {
    /// Opens the log in `directory`, both made if they are not there, and brought to the newest schema.
    pub fn open(directory: &Path) -> Result<Self, LogError> {
        let path = directory.join(FILE_NAME);
        let refused = |reason: String| LogError::Open {
            path: path.clone(),
            reason,
        };
        fs::create_dir_all(directory).map_err(|error| refused(error.to_string()))?;
        let lock = lock(directory, &path)?;
        tail::check(&path)?;
        let mut connection = Connection::open(&path).map_err(|error| refused(error.to_string()))?;
        configure(&connection).map_err(|error| refused(error.to_string()))?;
        schema::migrate(&mut connection, &path)?;
        Self::start(connection, path, lock)
    }

    fn start(connection: Connection, path: PathBuf, lock: File) -> Result<Self, LogError> {
        let purge = deleted(&connection)?;
        let (writer, orders) = sync_channel(WAITING_MAX);
        let started = thread::Builder::new()
            .name("mission-log".to_owned())
            .spawn(move || {
                let writer = Writer {
                    connection,
                    purge,
                    stuck: false,
                    refused: None,
                };
                writer.run(&orders);
            });
        if let Err(error) = started {
            return Err(LogError::Open {
                path,
                reason: error.to_string(),
            });
        }
        let shared = Shared {
            path,
            _lock: lock,
            damage: Mutex::default(),
        };
        Ok(Self {
            shared: Arc::new(shared),
            writer,
        })
    }

    /// Stores `append`. When this answers `Ok`, it is on the disk, or was before.
    pub async fn append(&self, append: Append) -> Result<Appended, LogError> {
        self.ask(|told| Order::Append(append, told)).await
    }

    /// Forgets the mission called `id`; whether there was one.
    pub async fn delete(&self, id: String) -> Result<bool, LogError> {
        self.ask(|told| Order::Delete(id, told)).await
    }

    /// Tries whether something can be stored, and says what was found to be damaged.
    pub async fn probe(&self) -> Result<(), LogError> {
        let damage = self
            .shared
            .damage
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        match damage {
            Some(what) => Err(LogError::Damaged(what)),
            None => self.ask(Order::Probe).await,
        }
    }

    async fn ask<T>(&self, order: impl FnOnce(Told<T>) -> Order) -> Result<T, LogError> {
        let (told, answer) = oneshot::channel();
        self.writer.try_send(order(told)).map_err(|error| match error {
            TrySendError::Full(_) => LogError::Busy,
            TrySendError::Disconnected(_) => LogError::Closed,
        })?;
        answer.await.map_err(|_| LogError::Closed)?
    }

    /// A connection that reads. It sees whole commits only.
    pub fn reader(&self) -> Result<Reader, LogError> {
        Reader::open(&self.shared.path)
    }

    /// Reads all there is for damage, which [`Self::probe`] then tells of. Takes its time.
    pub fn inspect(&self) {
        match self.reader().and_then(|reader| reader.inspect()) {
            Ok(()) => {}
            Err(LogError::Damaged(what)) => self.note_damage(what),
            Err(other) => self.note_damage(other.to_string()),
        }
    }

    /// Remembers what was found to be damaged.
    pub fn note_damage(&self, what: String) {
        tracing::error!(what, "the mission log is not what was stored");
        let mut damage = self.shared.damage.lock().unwrap_or_else(PoisonError::into_inner);
        damage.get_or_insert(what);
    }
}

/// Takes the directory for this process alone.
fn lock(directory: &Path, path: &Path) -> Result<File, LogError> {
    let refused = |reason: std::io::Error| LogError::Open {
        path: path.to_owned(),
        reason: reason.to_string(),
    };
    let file = File::create(directory.join(LOCK_NAME)).map_err(refused)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(LogError::InUse {
            path: path.to_owned(),
        }),
        Err(TryLockError::Error(error)) => Err(refused(error)),
    }
}

/// WAL, and a commit that waits for the disk.
fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(LOCK_TIME)?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "journal_size_limit", JOURNAL_BYTES)?;
    connection.pragma_update(None, "foreign_keys", true)
}

/// What the client's key was answered with, and what it had asked for.
fn answered(connection: &Connection, mission: &str, key: &str) -> rusqlite::Result<Option<Before>> {
    let mut statement = connection.prepare_cached(
        "SELECT request, answer FROM answered JOIN missions ON number = mission WHERE id = ?1 AND key = ?2
         AND status <> 'deleted'",
    )?;
    statement
        .query_row(params![mission, key], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()
}

/// What stands in place of an event's kind in the digest of a snapshot.
const SNAPSHOT: &str = "snapshot";

/// By what it is known again that a row is what was stored: SQLite itself notices damage to its own structure only.
fn digest(mission: i64, sequence: i64, kind: &str, body: &[u8]) -> [u8; 16] {
    let mut hash = Sha256::new();
    hash.update(mission.to_le_bytes());
    hash.update(sequence.to_le_bytes());
    hash.update(kind);
    hash.update([0]);
    hash.update(body);
    let mut short = [0; 16];
    short.copy_from_slice(&hash.finalize()[..16]);
    short
}

fn limit(most: usize) -> i64 {
    i64::try_from(most).unwrap_or(i64::MAX)
}

/// SQLite counts with a sign; nothing here comes near its end.
fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

fn unsigned(number: i64) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
