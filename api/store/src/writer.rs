//! The writer thread: waiting appends share a commit, and each gets its own reply.

use std::{sync::Arc, time::Duration};

use rusqlite::{Connection, OptionalExtension as _, Row, Transaction, TransactionBehavior, params};

use super::{
    acknowledged::{Acknowledged, Entry},
    command::{LogWriter, Waiting, reply_to_each, stored},
    digest::Head,
    entry::{Append, Appended, AuditEntry, StoredEvent},
    error::StoreError,
    idempotency::{self, KeyedAnswer},
    known::Known,
    place::Place,
    shares::{Shares, Taken},
    sql::{limit, signed},
    trusted_time::{TrustedClock, TrustedTime},
};
use crate::metrics::StoreMetrics;

/// Most appends in one commit.
const COMMIT_MAX: usize = 256;

/// Events of a deleted mission, or free pages, that one commit removes: some milliseconds.
const PURGE: i64 = 500;

/// Pause after a failed removal.
const PURGE_RETRY: Duration = Duration::from_secs(1);

/// Bytes in the write-ahead file that cause a merge: SQLite's own limit of 1,000 pages.
const MERGE_BYTES: usize = 4 << 20;

/// Bytes that a commit writes beside its events: a page for each of five tables and indexes.
const COMMIT_BYTES: usize = 20 << 10;

/// Bytes that a step of freeing disk space writes.
const PURGE_BYTES: usize = 1 << 20;

/// Space beyond a refused append that makes the store ready again, bytes.
const PROBE_BYTES: usize = 64 << 10;

/// The only writing connection.
pub(super) struct Writer {
    connection: Connection,
    /// Deleted missions; their events are removed step by step while no command waits.
    purge: Vec<i64>,
    /// `true` if the file may have free pages.
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
    place: Arc<Place>,
}

impl Writer {
    pub(super) fn new(
        connection: Connection,
        place: Arc<Place>,
        acknowledged: Acknowledged,
        clock: TrustedClock,
        share: u64,
        metrics: StoreMetrics,
    ) -> rusqlite::Result<Self> {
        Ok(Self {
            shares: Shares::read(&connection, share)?,
            known: Known::default(),
            purge: deleted(&connection)?,
            connection,
            free_pages: true,
            stuck: false,
            refused: None,
            metrics,
            clock,
            acknowledged,
            unlisted: vec![],
            unmerged: 0,
            place,
        })
    }

    /// Merges the write-ahead file into the store's file.
    fn checkpoint(&mut self) -> Result<(), StoreError> {
        // While a reader is active, a part stays in the write-ahead file.
        let is_merged = merge(&self.connection, "TRUNCATE")?;
        is_merged.then_some(()).ok_or(StoreError::Busy)
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
        let synced = self.acknowledged.sync();
        synced.map_err(|error| StoreError::Unconfirmed(error.to_string()))
    }

    /// Makes sure that commits stay; after `Ok` they may be acknowledged.
    fn confirm(&mut self, committed: Vec<Entry>) -> Result<(), StoreError> {
        self.unlisted.extend(committed);
        self.place.check()?;
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
        let purged = purge(&self.connection, number);
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
        self.shares.read_again(&self.connection)?;
        // A removal that panics must not panic at every turn.
        (self.stuck, self.free_pages) = (true, false);
        self.merge();
        Ok(())
    }

    fn commit_max(&self) -> usize {
        COMMIT_MAX
    }

    fn rest(&self) -> Option<Duration> {
        let due = [self.purge_in(), self.acknowledged.sync_in()];
        due.into_iter().flatten().min()
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
        let committed = self
            .place
            .check()
            .and_then(|()| self.known.check())
            .and_then(|()| {
                let times = Times {
                    trusted_s: self.clock.now_s(),
                    unix_s: self.clock.machine.unix_s(),
                };
                let mut batch = Batch {
                    shares: &self.shares,
                    known: &self.known,
                    times,
                    taken: vec![],
                    heads: vec![],
                };
                let appended = batch.commit(&mut self.connection, &appends)?;
                let Batch { taken, heads, .. } = batch;
                for taken in taken {
                    self.shares.take(taken);
                }
                for (append, head) in heads {
                    entries.push(Entry::of(times.unix_s, head.clone(), &append.mission));
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
                let results = appended
                    .into_iter()
                    .map(|appended| confirmed.clone().map(|()| appended));
                reply_to_each(batch, results);
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
        self.place.check()?;
        self.known.check()?;
        let transaction = writing(&mut self.connection)?;
        let hidden: Option<(i64, Taken)> = transaction
            .prepare_cached(
                "UPDATE missions SET status = 'deleted', id = 'deleted ' || number WHERE id = ?1
                 RETURNING number, owner, bytes",
            )?
            .query_row([id], |row| Ok((row.get(0)?, taken(row, 1)?)))
            .optional()?;
        let Some((number, room)) = hidden else {
            drop(transaction);
            // An earlier attempt may have deleted it.
            return self.confirm(vec![]).map(|()| false);
        };
        keep_order(&transaction, id, order)?;
        transaction.commit()?;
        self.shares.give_back(&room);
        self.unmerged += COMMIT_BYTES;
        self.confirm(vec![Entry::deletion(self.clock.machine.unix_s(), number, id)])?;
        // First the list, then the removal: a mission without a trace counts as lost.
        self.sync_list()?;
        self.purge.push(number);
        Ok(true)
    }

    fn set_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        self.keep_time(time)
    }

    fn keep_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        self.connection.execute(TrustedTime::WRITE, time.columns())?;
        Ok(())
    }

    fn protect(&mut self) -> Result<(), StoreError> {
        self.connection.execute("UPDATE guards SET protected = 1", [])?;
        Ok(())
    }

    /// Writes the size of the largest failed append: a disk may be full for that one only.
    fn probe(&mut self) -> Result<(), StoreError> {
        self.known.check()?;
        self.confirm(vec![])?;
        let mut try_out = self
            .connection
            .prepare_cached("UPDATE probes SET count = count + 1, room = zeroblob(?1)")?;
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
        let now: u32 = self
            .connection
            .pragma_query_value(None, "page_count", |row| row.get(0))?;
        let most = pages.map_or(u32::MAX - 1, |more| now + more);
        Ok(self
            .connection
            .pragma_update_and_check(None, "max_page_count", most, |_| Ok(()))?)
    }

    fn vacuum(&mut self) -> Result<(), StoreError> {
        while let Some(&number) = self.purge.last() {
            if purge(&self.connection, number)? {
                self.purge.pop();
            }
        }
        self.connection.execute_batch("VACUUM")?;
        self.merge();
        Ok(())
    }

    fn close(&mut self) -> Result<(), StoreError> {
        self.checkpoint()
    }
}

/// A transaction with the lock for writing: one that reads first cannot wait for the lock later.
pub(super) fn writing(connection: &mut Connection) -> rusqlite::Result<Transaction<'_>> {
    connection.transaction_with_behavior(TransactionBehavior::Immediate)
}

/// Numbers of the deleted missions that still have events.
fn deleted(connection: &Connection) -> rusqlite::Result<Vec<i64>> {
    let mut deleted = connection.prepare("SELECT number FROM missions WHERE status = 'deleted'")?;
    deleted.query_map([], |row| row.get(0))?.collect()
}

/// Merges the write-ahead file. `true` if everything is merged and on the disk.
fn merge(connection: &Connection, mode: &str) -> rusqlite::Result<bool> {
    let checkpoint = format!("PRAGMA wal_checkpoint({mode})");
    connection.query_row(&checkpoint, [], |row| {
        let (busy, frames, merged): (bool, i64, i64) = row.try_into()?;
        Ok(!busy && frames == merged)
    })
}

/// Removes some events of a deleted mission, at last the mission. `true` if the mission is gone.
fn purge(connection: &Connection, number: i64) -> rusqlite::Result<bool> {
    let mut some = connection.prepare_cached(
        "DELETE FROM events WHERE mission = ?1 AND sequence <=
         (SELECT min(sequence) FROM events WHERE mission = ?1) + ?2",
    )?;
    if 0 < some.execute(params![number, PURGE])? {
        return Ok(false);
    }
    connection.execute("DELETE FROM missions WHERE number = ?1", [number])?;
    Ok(true)
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

/// Owner and bytes of a mission, in the columns from `first` on.
fn taken(row: &Row<'_>, first: usize) -> rusqlite::Result<Taken> {
    Ok(Taken {
        owner: row.get(first)?,
        bytes: row.get::<_, i64>(first + 1)?.unsigned_abs(),
    })
}

/// Unix time of a commit, s.
#[derive(Clone, Copy)]
struct Times {
    /// Trusted time.
    trusted_s: f64,
    /// Time of the machine's clock.
    unix_s: f64,
}

/// Appends in one commit.
struct Batch<'a, 'b> {
    shares: &'b Shares,
    known: &'b Known,
    times: Times,
    /// Bytes of the stored appends.
    taken: Vec<Taken>,
    /// The last event of the mission after each stored append.
    heads: Vec<(&'a Append, Head)>,
}

impl<'a> Batch<'a, '_> {
    fn commit(
        &mut self,
        connection: &mut Connection,
        appends: &[&'a Append],
    ) -> Result<Vec<Appended>, StoreError> {
        let transaction = writing(connection)?;
        let appended = appends
            .iter()
            .map(|append| self.store(&transaction, append))
            .collect::<Result<_, _>>()?;
        transaction.commit()?;
        Ok(appended)
    }

    fn store(&mut self, transaction: &Transaction<'_>, append: &'a Append) -> Result<Appended, StoreError> {
        #[cfg(test)]
        assert_ne!(append.mission, super::tests::PANICS, "a test wants this panic");
        if let Some(KeyedAnswer { key, request, .. }) = &append.answered
            && let Some((asked, answer)) = idempotency::find(transaction, &append.mission, key)?
        {
            let is_same = asked == *request;
            return Ok(if is_same {
                Appended::AnsweredBefore(answer)
            } else {
                Appended::KeyTaken
            });
        }
        let bytes = Shares::bytes_of(append);
        let room = limit(usize::try_from(bytes).unwrap_or(usize::MAX));
        let has_room = |owner: &str| self.shares.has_room(owner, bytes, append.room);
        let (head, owner) = match append.number {
            None => {
                let owner = append.order.as_ref().map(|order| order.caller.clone());
                let owner = owner.unwrap_or_default();
                if !has_room(&owner) {
                    return Ok(Appended::ShareUsed);
                }
                let mut made = transaction.prepare_cached(
                "INSERT INTO missions (id, status, summary, owner) VALUES (?1, '', x'', ?2) RETURNING number",
            )?;
                let number = made.query_row(params![append.mission, owner], |row| row.get(0))?;
                (Head::of_new(number), owner)
            }
            Some(number) => {
                let Some((head, owner, is_whole)) = stored_head(transaction, signed(number))? else {
                    return Ok(Appended::MissionGone);
                };
                self.known.compare(&head)?;
                let first = append.events.first();
                if first.is_some_and(|event| signed(event.sequence) != head.sequence + 1) {
                    return Ok(Appended::OutOfSequence);
                }
                if !is_whole {
                    return Err(head.missing(&append.mission));
                }
                if !has_room(&owner) {
                    return Ok(Appended::ShareUsed);
                }
                (head, owner)
            }
        };
        self.taken.push(Taken { owner, bytes });
        let links = head.extend(append);
        let Head {
            mission,
            sequence,
            digest,
        } = &links.head;
        let mut became = transaction.prepare_cached(
        "UPDATE missions SET status = ?2, summary = ?3, bytes = bytes + ?4, sequence = ?5, head = ?6, digest = ?7,
         over_s = CASE WHEN ?2 IN ('finished', 'failed') THEN coalesce(over_s, ?8) END WHERE number = ?1",
    )?;
        became.execute(params![
            mission,
            append.status,
            append.summary,
            room,
            sequence,
            digest,
            links.summary,
            self.times.trusted_s
        ])?;
        let mut event = transaction.prepare_cached(
            "INSERT INTO events (mission, sequence, kind, body, digest) VALUES (?1, ?2, ?3, ?4, ?5)",
        )?;
        for (StoredEvent { sequence, kind, body }, digest) in append.events.iter().zip(&links.events) {
            event.execute(params![mission, signed(*sequence), kind, body, digest])?;
        }
        if let Some((snapshot, digest)) = append.snapshot.as_ref().zip(links.checkpoint.as_ref()) {
            let mut kept = transaction.prepare_cached(
                "INSERT INTO snapshots (mission, sequence, body, digest) VALUES (?1, ?2, ?3, ?4)
             ON CONFLICT (mission) DO UPDATE SET sequence = ?2, body = ?3, digest = ?4",
            )?;
            kept.execute(params![mission, sequence, snapshot, digest])?;
        }
        let number = *mission;
        self.heads.push((append, links.head));
        if let Some(answered) = &append.answered {
            idempotency::keep(transaction, number, answered)?;
        }
        if let Some(order) = &append.order {
            keep_order(transaction, &append.mission, order)?;
        }
        Ok(Appended::Stored)
    }
}

/// The last event and the owner in the mission's row; `true` if that event is stored.
fn stored_head(transaction: &Transaction<'_>, number: i64) -> rusqlite::Result<Option<(Head, String, bool)>> {
    let mut last = transaction.prepare_cached(
        "SELECT sequence, head, owner, coalesce((SELECT digest FROM events WHERE mission = number
         AND events.sequence = missions.sequence), x'') FROM missions WHERE number = ?1 AND status <> 'deleted'",
    )?;
    let read = |row: &Row<'_>| {
        let head = Head {
            mission: number,
            sequence: row.get(0)?,
            digest: row.get(1)?,
        };
        let is_whole = head.digest == row.get::<_, Vec<u8>>(3)?;
        Ok((head, row.get(2)?, is_whole))
    };
    last.query_row([number], read).optional()
}

fn keep_order(transaction: &Transaction<'_>, mission: &str, order: &AuditEntry) -> rusqlite::Result<()> {
    let AuditEntry {
        at_s,
        caller,
        request,
        action,
    } = order;
    let mut kept = transaction.prepare_cached(
        "INSERT INTO orders (at_s, caller, request, mission, action) VALUES (?1, ?2, ?3, ?4, ?5)",
    )?;
    kept.execute(params![at_s, caller, request, mission, action])?;
    Ok(())
}
