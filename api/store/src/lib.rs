//! The event store: keeps the events of every mission on the disk before a client learns of them.
//!
//! ```text
//! actors ── Append ──► a writer thread: BEGIN; all waiting appends; COMMIT (fsync) ──► replies
//! readers ── their own connections, which see complete commits only
//! ```
//! SQLite in WAL mode with `synchronous = FULL`: acknowledged events survive a power cut. Appends
//! during a commit share the next one. Before a reply, the writer checks the files' paths and lists
//! the events in a file of their own. The store reads no event. Messages call it the mission log.
//!
//! The module `postgres` has the same store in a database that several services share.

#![cfg_attr(not(feature = "postgres"), expect(dead_code, reason = "the database that is left out uses it"))]

use std::fmt::Debug;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clock::Clock;
use parking_lot::Mutex;
use rusqlite::Connection;
use rustix::fs::statvfs;
use tokio::sync::{
    mpsc::{Sender, channel, error::TrySendError},
    oneshot,
};

mod acknowledged;
mod command;
#[cfg(feature = "postgres")]
mod copy;
mod copy_rows;
mod digest;
mod entry;
mod error;
mod files;
mod known;
mod locked;
mod metrics;
mod open_files;
mod ownership;
mod packed;
#[cfg_attr(not(feature = "postgres"), path = "without_postgres.rs")]
mod postgres;
mod reader;
pub mod roots;
mod rows;
mod salvage;
mod schema;
mod shares;
mod sql;
#[cfg(test)]
mod tests;
mod trusted_time;
mod writer;

use acknowledged::{Acknowledged, Compared, LIST_NAME};
use command::{LogWriter, Reply, WriterCommand, run};
#[cfg(feature = "postgres")]
pub use copy::{Copied, StorePlace, copy};

pub use entry::{
    Append, Appended, AuditEntry, KeyedAnswer, PreviousAnswer, Room, StoredEvent, StoredMission,
};
pub use error::StoreError;
use files::{configure, hide, make_private, note_lost, require_file_of_write_ahead, require_no_loss};
pub use metrics::StoreMetrics;
use open_files::{OpenFiles, lock};
#[doc(hidden)]
pub use ownership::Trouble;
pub use ownership::{Acquired, Member, Owned, Turn};
use packed::pack;
pub use postgres::Lease;
pub use reader::{EventReader, FILE_NAME};
pub use salvage::REST_NAME;
pub use trusted_time::TrustedClock;
use trusted_time::TrustedTime;
use writer::Writer;

/// File in the data directory that names acknowledged events that were missing at a start. The
/// service is not ready until a person deletes it.
const LOST_NAME: &str = "lost-events.txt";

/// Most appends that wait for the writer: one second of a thousand missions.
const WAITING_MAX: usize = 1_024;

/// The event store of a data directory, or of a database. Clones share it.
#[derive(Clone, Debug)]
pub struct EventStore {
    shared: Arc<Shared>,
    writer: Sender<WriterCommand>,
}

#[derive(Debug)]
struct Shared {
    backend: Box<dyn Backend>,
    lease: Option<Lease>,
    clock: TrustedClock,
    /// The first damage that was found.
    damage: Mutex<Option<String>>,
    metrics: StoreMetrics,
}

/// The place of a store, a directory or a database. Its writer is a [`LogWriter`].
trait Backend: Debug + Send + Sync {
    fn reader(&self) -> Result<EventReader, StoreError>;

    /// The store's file, if it has one.
    fn path(&self) -> Option<&Path> {
        None
    }

    /// Disturbs all connections from now on.
    fn trouble(&self, _: Option<Trouble>) {}
}

impl Backend for Arc<OpenFiles> {
    fn reader(&self) -> Result<EventReader, StoreError> {
        self.check()?;
        EventReader::open((**self).path(), Some(Arc::clone(self)))
    }

    fn path(&self) -> Option<&Path> {
        Some((**self).path())
    }
}

impl EventStore {
    /// Opens the store in `directory`. Creates both if missing, and migrates the store.
    pub fn open(directory: &Path, clock: &Clock) -> Result<Self, StoreError> {
        Self::open_with(directory, u64::MAX, clock)
    }

    /// As [`Self::open`]; the missions of one client may take at most `share` bytes.
    pub fn open_with(directory: &Path, share: u64, clock: &Clock) -> Result<Self, StoreError> {
        let path = directory.join(FILE_NAME);
        let database = make_private(directory, &path).map_err(StoreError::at(&path))?;
        lock(&database, &path)?;
        require_file_of_write_ahead(&path)?;
        let mut connection = Connection::open(&path).map_err(StoreError::at(&path))?;
        schema::require_log(&connection, &path)?;
        configure(&connection).map_err(StoreError::at(&path))?;
        schema::migrate(&mut connection, &path)?;
        // A file that is no log keeps its mode: it was refused above.
        for suffix in ["", "-wal", "-shm"] {
            hide(&directory.join(format!("{FILE_NAME}{suffix}")));
        }
        Self::start(connection, &path, database, share, clock)
    }

    fn start(
        connection: Connection,
        path: &Path,
        database: File,
        share: u64,
        machine: &Clock,
    ) -> Result<Self, StoreError> {
        let refused = StoreError::at::<io::Error>(path);
        let directory = path.parent().unwrap_or(Path::new("."));
        let open_files = Arc::new(OpenFiles::new(path, database).map_err(&refused)?);
        let opened = Acknowledged::open(directory, machine);
        let (acknowledged, listed) = opened.map_err(StoreError::at(&directory.join(LIST_NAME)))?;
        let Compared { lost, outdated } = acknowledged::compare(&connection, listed, machine.unix_s())
            .unwrap_or_else(|error| {
                tracing::error!(%error, "cannot tell which acknowledged events are missing");
                Compared::default()
            });
        if !lost.is_empty() {
            let lost = lost.join("\n");
            tracing::error!(lost, "acknowledged events are missing from the mission log");
            note_lost(&directory.join(LOST_NAME), &lost).map_err(&refused)?;
        }
        let mut time = TrustedTime::read(&connection)?;
        time.resume(machine);
        time.write(&connection, TrustedTime::WRITE)?;
        let clock = TrustedClock::new(time, machine);
        let metrics = StoreMetrics::default();
        let mut writer = Writer::new(
            connection,
            Arc::clone(&open_files),
            acknowledged,
            clock.clone(),
            share,
            metrics.clone(),
        )?;
        // The losses were noted above.
        writer.list(outdated);
        Self::run(open_files, None, clock, metrics, writer).map_err(refused)
    }

    fn run(
        backend: impl Backend + 'static,
        lease: Option<Lease>,
        clock: TrustedClock,
        metrics: StoreMetrics,
        writer: impl LogWriter + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, commands) = channel(WAITING_MAX);
        let run = run(writer, commands, clock.machine.clone());
        clock.machine.spawn_thread("mission-log", run)?;
        let shared = Shared { backend: Box::new(backend), lease, clock, damage: Mutex::default(), metrics };
        Ok(Self { shared: Arc::new(shared), writer: sender })
    }

    /// This service's lease of missions; none if no other service can own them.
    pub fn lease(&self) -> Option<&Lease> {
        self.shared.lease.as_ref()
    }

    /// Time until the disk is full, at the rate since the last call; none if unknown.
    pub fn disk_lasts(&self, before: &mut Option<(Instant, u64)>) -> Option<Duration> {
        let disk = statvfs(self.shared.backend.path()?).ok()?;
        let free = disk.f_bavail.saturating_mul(disk.f_frsize);
        let now = (self.machine().now(), self.shared.metrics.free(free));
        let (then, stored) = before.replace(now)?;
        let seconds = now.0.saturating_duration_since(then).as_secs();
        let left = free.saturating_mul(seconds).checked_div(now.1.saturating_sub(stored));
        left.map(Duration::from_secs)
    }

    /// Counters of the store.
    pub fn metrics(&self) -> &StoreMetrics {
        &self.shared.metrics
    }

    /// Stores an append. After `Ok`, this or an earlier request with the key is on the disk.
    pub async fn append(&self, mut append: Append) -> Result<Appended, StoreError> {
        for event in &mut append.events {
            if let Some(packed) = pack(&event.body, packed::KEPT) {
                event.body = packed.into();
            }
        }
        let packed = append.snapshot.as_deref();
        let packed = packed.and_then(|body| pack(body, packed::OVERWRITTEN));
        append.snapshot = packed.or(append.snapshot);
        self.send(|reply| WriterCommand::Append(append, reply)).await
    }

    /// Deletes the mission `id` and stores the order. `false` if there is no such mission.
    pub async fn delete(&self, id: String, order: AuditEntry) -> Result<bool, StoreError> {
        let deleted = self.ask(move |writer| writer.delete(&id, &order)).await?;
        if deleted && self.shared.damage.lock().is_some() {
            // The damage may have been in this mission.
            let store = self.clone();
            self.machine().spawn_blocking(move || {
                let verdict = store.verdict();
                *store.shared.damage.lock() = verdict;
            });
        }
        Ok(deleted)
    }

    /// The machine's clock.
    pub fn machine(&self) -> &Clock {
        &self.shared.clock.machine
    }

    /// The time by which tokens expire and old missions are deleted.
    pub fn clock(&self) -> &TrustedClock {
        &self.shared.clock
    }

    /// Reads the machine's clocks, and stores the trusted time. Call it every few minutes.
    pub async fn read_clocks(&self) -> Result<(), StoreError> {
        let time = self.shared.clock.read_clocks();
        self.ask(move |writer| writer.keep_time(time)).await
    }

    /// Takes the machine's time, because a person has confirmed it.
    pub async fn believe_clock(&self) -> Result<(), StoreError> {
        let time = self.shared.clock.believe_clock();
        self.ask(move |writer| writer.set_time(time)).await
    }

    /// Notes that the service has tokens: it never runs without them again.
    pub async fn protect(&self) -> Result<(), StoreError> {
        self.ask(|writer| writer.protect()).await
    }

    /// Returns the disk space of deleted missions. Appends wait meanwhile.
    pub async fn vacuum(&self) -> Result<(), StoreError> {
        self.ask(|writer| writer.vacuum()).await
    }

    /// Limits the growth of the store's file to `pages` pages, like a full disk. For tests.
    #[doc(hidden)]
    pub async fn limit_growth(&self, pages: Option<u32>) -> Result<(), StoreError> {
        self.ask(move |writer| writer.limit_growth(pages)).await
    }

    /// Disturbs all connections to the database from now on. For tests.
    #[doc(hidden)]
    pub fn trouble(&self, trouble: Option<Trouble>) {
        self.shared.backend.trouble(trouble);
    }

    /// Fails if damage was found or the store cannot be written.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let damage = self.shared.damage.lock().clone();
        if let Some(what) = damage {
            return Err(StoreError::Damaged(what));
        }
        if let Some(path) = self.shared.backend.path() {
            require_no_loss(&path.with_file_name(LOST_NAME))?;
        }
        self.ask(|writer| writer.probe()).await
    }

    /// Lets the writer do `work`, after all earlier appends.
    async fn ask<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut dyn LogWriter) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        let command = |reply: Reply<T>| {
            WriterCommand::Do(Box::new(move |writer| {
                let _ = reply.send(work(writer));
            }))
        };
        self.send(command).await
    }

    async fn send<T>(&self, command: impl FnOnce(Reply<T>) -> WriterCommand) -> Result<T, StoreError> {
        let (reply, answer) = oneshot::channel();
        let sent = self.writer.try_send(command(reply));
        sent.map_err(|error| match error {
            TrySendError::Full(_) => StoreError::Busy,
            TrySendError::Closed(_) => StoreError::Closed,
        })?;
        answer.await.map_err(|_| StoreError::Unanswered)?
    }

    /// Ends the writer after earlier appends, and merges the write-ahead file. Later appends fail.
    pub async fn close(&self) -> Result<(), StoreError> {
        self.send(WriterCommand::Close).await
    }

    /// A reading connection. It sees complete commits only.
    pub fn reader(&self) -> Result<EventReader, StoreError> {
        self.shared.backend.reader()
    }

    /// Checks the whole file, slowly. [`Self::probe`] reports damage that it finds.
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

    /// Remembers the first damage.
    pub fn note_damage(&self, what: String) {
        tracing::error!(what, "the mission log is damaged");
        self.shared.damage.lock().get_or_insert(what);
    }
}
