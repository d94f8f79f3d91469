//! The writer thread: waiting appends share a commit, and each gets its own reply.

use std::{sync::Arc, time::Duration};

use rusqlite::{Connection, Transaction, TransactionBehavior};

use super::acknowledged::{Acknowledged, Entry};
use super::command::{LogWriter, Waiting, reply_to_each, stored};
use super::digest::{Head, Links};
use super::entry::{Append, Appended, AuditEntry, FIND_ANSWER, KeyedAnswer, StoredEvent};
use super::error::StoreError;
use super::known::Known;
use super::locked::{Locked, decide};
use super::open_files::OpenFiles;
use super::rows::{Param, Rows};
use super::shares::{Shares, Taken};
use super::sql::{DELETED, PROTECT, PURGE, limit, signed};
use super::trusted_time::{TrustedClock, TrustedTime};
use crate::metrics::StoreMetrics;

const COMMIT_MAX: usize = 256;

const PURGE_RETRY: Duration = Duration::from_secs(1);

/// Bytes in the write-ahead file that cause a merge: SQLite's own limit of 1,000 pages.
const MERGE_BYTES: usize = 4 << 20;

/// Bytes that a commit writes beside its events: a page for each of five tables and indexes.
const COMMIT_BYTES: usize = 20 << 10;

/// Bytes that a step of freeing disk space writes.
const PURGE_BYTES: usize = 1 << 20;

/// Space beyond a refused append that makes the store ready again, bytes.
const PROBE_BYTES: usize = 64 << 10;

const CREATE: &str =
    "INSERT INTO missions (id, status, summary, owner) VALUES (?1, '', x'', ?2) RETURNING number";

const CHANGE: &str =
    "UPDATE missions SET status = ?2, summary = ?3, bytes = bytes + ?4, sequence = ?5, head = ?6, digest = ?7,
    over_s = CASE WHEN ?2 IN ('finished', 'failed') THEN coalesce(over_s, ?8) END WHERE number = ?1";

const HIDE: &str = "UPDATE missions SET status = 'deleted', id = 'deleted ' || number WHERE id = ?1
    RETURNING number, owner, bytes";

const EVENT: &str = "INSERT INTO events (mission, sequence, kind, body, digest) VALUES (?1, ?2, ?3, ?4, ?5)";

const SNAPSHOT: &str = "INSERT INTO snapshots (mission, sequence, body, digest) VALUES (?1, ?2, ?3, ?4)
    ON CONFLICT (mission) DO UPDATE SET sequence = ?2, body = ?3, digest = ?4";

const KEY: &str = "INSERT INTO answered (mission, key, request, answer) VALUES (?1, ?2, ?3, ?4)";

/// The only writing connection.
pub(super) struct Writer {
    connection: Connection,
    /// Deleted missions; their events are removed step by step while no command waits.
    purge: Vec<i64>,
    free_pages: bool,
    /// `true` if the last removal failed, for example on a full disk.
    stuck: bool,
    /// Size of the largest failed append, bytes. The store is ready once it can store this size.
    refused: Option<usize>,
    shares: Shares,
    known: Known,
    metrics: StoreMetrics,
    clock: TrustedClock,
    acknowledged: Acknowledged,
    /// Committed entries that could not be listed yet.
    unlisted: Vec<Entry>,
    /// Approximate bytes in the write-ahead file.
    unmerged: usize,
    /// Dropped after the connection.
    files: Arc<OpenFiles>,
}

impl Writer {
    pub(super) fn new(
        connection: Connection,
        files: Arc<OpenFiles>,
        acknowledged: Acknowledged,
        clock: TrustedClock,
        share: u64,
        metrics: StoreMetrics,
    ) -> Result<Self, StoreError> {
        let (rows, mut shares): (&dyn Rows, _) = (&connection, Shares::new(share));
        shares.read(rows)?;
        Ok(Self {
            shares,
            known: Known::default(),
            purge: rows.all(DELETED, &[], |row| row.get(0))?,
            connection,
            free_pages: true,
            stuck: false,
            refused: None,
            metrics,
            clock,
            acknowledged,
            unlisted: vec![],
            unmerged: 0,
            files,
        })
    }

    fn rows(&self) -> &dyn Rows {
        &self.connection
    }

    /// Merges a large write-ahead file.
    fn merge_much(&mut self) {
        if MERGE_BYTES <= self.unmerged {
            self.merge();
        }
    }

    /// Merges all that it can without waiting for readers.
    fn merge(&mut self) {
        self.unmerged = 0;
        if let Err(error) = merge(&self.connection, "PASSIVE") {
            tracing::warn!(%error, "cannot merge the write-ahead file of the mission log yet");
        }
    }

    /// Updates the list at the start. Missions are purged only after their deletion is listed.
    pub(super) fn list(&mut self, outdated: Vec<Entry>) {
        self.merge();
        let listed = self.confirm(outdated).and_then(|()| self.sync_list());
        if let Err(error) = listed {
            tracing::warn!(%error, "cannot write the list of acknowledged events");
            self.purge.clear();
        }
    }

    fn sync_list(&mut self) -> Result<(), StoreError> {
        self.acknowledged.sync().map_err(|error| StoreError::Unconfirmed(error.to_string()))
    }

    /// Makes sure that commits stay; after `Ok` they may be acknowledged.
    fn confirm(&mut self, committed: Vec<Entry>) -> Result<(), StoreError> {
        self.unlisted.extend(committed);
        self.files.check()?;
        let listed = self.acknowledged.add(&self.unlisted);
        listed.map_err(|error| StoreError::Unconfirmed(error.to_string()))?;
        self.unlisted.clear();
        Ok(())
    }

    /// Wait for commands before the next removal; none if nothing is left to remove.
    fn purge_in(&self) -> Option<Duration> {
        match (self.purge.is_empty(), self.stuck) {
            (true, _) => self.free_pages.then_some(Duration::ZERO),
            (false, true) => Some(PURGE_RETRY),
            (false, false) => Some(Duration::ZERO),
        }
    }

    fn sync_what_is_due(&mut self) {
        if self.acknowledged.sync_in() == Some(Duration::ZERO)
            && let Err(error) = self.acknowledged.sync()
        {
            tracing::warn!(%error, "the list of acknowledged events would not survive a power cut");
        }
    }

    /// Removes some events of deleted missions, or some free pages.
    fn purge_some(&mut self) {
        self.unmerged += PURGE_BYTES;
        self.merge_much();
        let Some(&number) = self.purge.last() else {
            // After an error, the next deletion tries again.
            self.free_pages = give_back(&self.connection).unwrap_or(false);
            return;
        };
        let purged = self.rows().purge(number);
        self.stuck = purged.is_err();
        match purged {
            Ok(true) => {
                self.purge.pop();
                self.free_pages = true;
            }
            Ok(false) => {}
            Err(error) => tracing::warn!(%error, "cannot free the disk space of a deleted mission yet"),
        }
    }
}

impl LogWriter for Writer {
    fn recover(&mut self) -> Result<(), StoreError> {
        self.shares.read(&self.connection)?;
        // A removal that panics must not panic at every turn.
        (self.stuck, self.free_pages) = (true, false);
        self.merge();
        Ok(())
    }

    fn commit_max(&self) -> usize {
        COMMIT_MAX
    }

    fn rest(&self) -> Option<Duration> {
        [self.purge_in(), self.acknowledged.sync_in()].into_iter().flatten().min()
    }

    fn after_command(&mut self) {
        self.sync_what_is_due();
    }

    fn upkeep(&mut self) {
        match (self.purge_in(), self.acknowledged.sync_in()) {
            (Some(purge), sync) if sync.is_none_or(|sync| purge <= sync) => self.purge_some(),
            _ => {}
        }
        self.sync_what_is_due();
    }

    fn store(&mut self, mut batch: Vec<Waiting>) {
        if batch.is_empty() {
            return;
        }
        let appends: Vec<&Append> = batch.iter().map(|(append, _)| append).collect();
        let start = self.clock.machine.now();
        let mut entries = vec![];
        let committed = self.files.check().and_then(|()| self.known.check()).and_then(|()| {
            let unix_s = self.clock.machine.unix_s();
            let mut batch = OpenBatch {
                shares: &self.shares,
                known: &self.known,
                trusted_s: self.clock.now_s(),
                taken: vec![],
                heads: vec![],
            };
            let appended = batch.commit(&mut self.connection, &appends)?;
            let OpenBatch { taken, heads, .. } = batch;
            for taken in taken {
                self.shares.take(taken);
            }
            for (append, head) in heads {
                entries.push(Entry::of(unix_s, head.clone(), &append.mission));
                self.known.add(&append.mission, head, append.is_over());
            }
            Ok(appended)
        });
        let counts = committed.as_ref().ok().map(|done| stored(&appends, done));
        self.metrics.committed(self.clock.machine.since(start), counts);
        let bytes = appends.iter().map(|append| size(append)).sum::<usize>();
        match committed {
            Ok(appended) => {
                let confirmed = self.confirm(entries);
                let results = appended.into_iter();
                reply_to_each(batch, results.map(|appended| confirmed.clone().map(|()| appended)));
                self.unmerged += bytes + COMMIT_BYTES;
                self.merge_much();
            }
            // Each would wait as long on its own.
            Err(StoreError::Locked) => {
                let n = batch.len();
                reply_to_each(batch, (0..n).map(|_| Err(StoreError::Locked)));
            }
            // One bad append must not fail the others.
            Err(_) if 1 < batch.len() => {
                for alone in batch {
                    self.store(vec![alone]);
                }
            }
            Err(error) => {
                if let StoreError::SetBack(what) = &error {
                    self.known.note(what);
                }
                self.refused = self.refused.max(Some(bytes));
                reply_to_each([batch.remove(0)], [Err(error)]);
            }
        }
    }

    fn delete(&mut self, id: &str, order: &AuditEntry) -> Result<bool, StoreError> {
        self.files.check()?;
        self.known.check()?;
        let transaction = writing(&mut self.connection)?;
        let rows: &dyn Rows = &*transaction;
        let Some((number, room)) = rows.first(HIDE, &[&id], Taken::hidden)? else {
            drop(transaction);
            // An earlier attempt may have deleted it.
            return self.confirm(vec![]).map(|()| false);
        };
        rows.keep_order(id, order)?;
        transaction.commit()?;
        self.shares.give_back(&room);
        self.unmerged += COMMIT_BYTES;
        self.confirm(vec![Entry::deletion(self.clock.machine.unix_s(), number, id)])?;
        // First the list, then the removal: a mission without a trace counts as lost.
        self.sync_list()?;
        self.purge.push(number);
        Ok(true)
    }

    fn keep_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        time.write(&self.connection, TrustedTime::WRITE)
    }

    fn protect(&mut self) -> Result<(), StoreError> {
        self.rows().change(PROTECT, &[]).map(drop)
    }

    /// Writes the size of the largest failed append: a disk may be full for that one only.
    fn probe(&mut self) -> Result<(), StoreError> {
        self.known.check()?;
        self.confirm(vec![])?;
        let try_out = "UPDATE probes SET count = count + 1, room = zeroblob(?1)";
        let mut try_out = self.connection.prepare_cached(try_out)?;
        if let Some(bytes) = self.refused {
            let with_indexes = bytes.saturating_mul(2) + PROBE_BYTES;
            try_out.execute([limit(with_indexes)])?;
            self.refused = None;
        }
        try_out.execute([0])?;
        let count = "SELECT count FROM probes";
        let counted = self.connection.query_row(count, [], |row| row.get(0))?;
        let counted = self.known.count(counted);
        if let Err(StoreError::SetBack(what)) = &counted {
            self.known.note(what);
        }
        counted
    }

    fn limit_growth(&mut self, pages: Option<u32>) -> Result<(), StoreError> {
        let connection = &self.connection;
        let now: u32 = connection.pragma_query_value(None, "page_count", |row| row.get(0))?;
        let most = pages.map_or(u32::MAX - 1, |more| now + more);
        Ok(connection.pragma_update_and_check(None, "max_page_count", most, |_| Ok(()))?)
    }

    fn vacuum(&mut self) -> Result<(), StoreError> {
        while let Some(&number) = self.purge.last() {
            if self.rows().purge(number)? {
                self.purge.pop();
            }
        }
        self.connection.execute_batch("VACUUM")?;
        self.merge();
        Ok(())
    }

    /// Merges the write-ahead file into the store's file.
    fn close(&mut self) -> Result<(), StoreError> {
        // While a reader is active, a part stays in the write-ahead file.
        merge(&self.connection, "TRUNCATE")?.then_some(()).ok_or(StoreError::Busy)
    }
}

/// A transaction with the lock for writing: one that reads first cannot wait for the lock later.
pub(super) fn writing(connection: &mut Connection) -> rusqlite::Result<Transaction<'_>> {
    connection.transaction_with_behavior(TransactionBehavior::Immediate)
}

/// Merges the write-ahead file. `true` if everything is merged and on the disk.
fn merge(connection: &Connection, mode: &str) -> rusqlite::Result<bool> {
    let checkpoint = format!("PRAGMA wal_checkpoint({mode})");
    connection.query_row(&checkpoint, [], |row| {
        let (busy, frames, merged): (bool, i64, i64) = row.try_into()?;
        Ok(!busy && frames == merged)
    })
}

/// Removes some free pages. `true` if more are left.
fn give_back(connection: &Connection) -> rusqlite::Result<bool> {
    let free = || connection.query_row("PRAGMA freelist_count", [], |row| row.get::<_, i64>(0));
    let before = free()?;
    // The statement steps once per page.
    let mut vacuum = connection.prepare_cached(&format!("PRAGMA incremental_vacuum({PURGE})"))?;
    let mut pages = vacuum.query([])?;
    while pages.next()?.is_some() {}
    let after = free()?;
    Ok(0 < after && after < before)
}

/// Approximate size of an append on the disk, bytes.
fn size(append: &Append) -> usize {
    let events = append.events.iter().map(|event| event.body.len());
    let snapshot = append.snapshot.as_ref().map_or(0, Vec::len);
    events.sum::<usize>() + append.summary.len() + snapshot
}

struct OpenBatch<'a, 'b> {
    shares: &'b Shares,
    known: &'b Known,
    /// Trusted time of the commit, Unix time, s.
    trusted_s: f64,
    /// Bytes of the stored appends.
    taken: Vec<Taken>,
    /// The last event of the mission after each stored append.
    heads: Vec<(&'a Append, Head)>,
}

impl<'a> OpenBatch<'a, '_> {
    fn commit(
        &mut self,
        connection: &mut Connection,
        appends: &[&'a Append],
    ) -> Result<Vec<Appended>, StoreError> {
        let transaction = writing(connection)?;
        let appended = appends.iter().map(|append| self.store(&transaction, append));
        let appended = appended.collect::<Result<_, _>>()?;
        transaction.commit()?;
        Ok(appended)
    }

    fn store(&mut self, transaction: &Transaction<'_>, append: &'a Append) -> Result<Appended, StoreError> {
        #[cfg(test)]
        assert_ne!(append.mission, super::tests::PANICS, "a test wants this panic");
        let rows: &dyn Rows = &**transaction;
        if let Some(keyed) = &append.answered {
            let previous = rows.first(FIND_ANSWER, &[&append.mission, &keyed.key], |row| {
                Ok((row.get::<Vec<u8>>(0)?, row.get(1)?))
            })?;
            if let Some((request, answer)) = previous {
                return Ok(keyed.repeated(&request, answer));
            }
        }
        let mission = match append.number {
            Some(number) => rows.first(&locked(), &[&signed(number)], Locked::read)?,
            None => None,
        };
        let taken = match decide(append, mission.as_ref(), self.shares, self.known)? {
            Ok(taken) => taken,
            Err(refused) => return Ok(refused),
        };
        let head = if let Some(mission) = mission {
            mission.head
        } else {
            let made = rows.first(CREATE, &[&append.mission, &taken.owner], |row| row.get(0))?;
            Head::of_new(made.expect("a row is inserted"))
        };
        let links = head.extend(append);
        self.write(rows, append, &links, taken.bytes)?;
        self.taken.push(taken);
        self.heads.push((append, links.head));
        Ok(Appended::Stored)
    }

    fn write(&self, to: &dyn Rows, append: &Append, links: &Links, bytes: u64) -> Result<(), StoreError> {
        let head = &links.head;
        let (mission, sequence, digest) = (&head.mission, &head.sequence, &head.digest);
        let Append { status, summary, .. } = append;
        let (bytes, whole, now_s) = (signed(bytes), &links.summary, self.trusted_s);
        let params: [&dyn Param; 8] = [mission, status, summary, &bytes, sequence, digest, whole, &now_s];
        to.change(CHANGE, &params)?;
        for (StoredEvent { sequence, kind, body }, digest) in append.events.iter().zip(&links.events) {
            to.change(EVENT, &[mission, &signed(*sequence), kind, &&**body, digest])?;
        }
        if let Some((snapshot, digest)) = append.snapshot.as_ref().zip(links.checkpoint.as_ref()) {
            to.change(SNAPSHOT, &[mission, sequence, snapshot, digest])?;
        }
        if let Some(KeyedAnswer { key, request, answer }) = &append.answered {
            to.change(KEY, &[mission, key, &&request[..], answer])?;
        }
        match &append.order {
            Some(order) => to.keep_order(&append.mission, order),
            None => Ok(()),
        }
    }
}

fn locked() -> String {
    let columns = Locked::COLUMNS;
    format!("SELECT {columns} FROM missions WHERE number = ?1 AND status <> 'deleted'")
}
