//! The writer thread: appends that wait together share a commit, and each gets its own reply.

use std::{
    ops::ControlFlow,
    sync::mpsc::{Receiver, RecvTimeoutError},
    time::{Duration, Instant},
};

use rusqlite::{Connection, OptionalExtension as _, Row, Transaction, params};
use tokio::sync::oneshot;

use super::{
    entry::{Append, Appended, Order, StoredEvent},
    error::StoreError,
    idempotency::{self, KeyedAnswer},
    shares::{Shares, Taken},
    sql::{SNAPSHOT, digest, limit, order_digest, signed, summary_digest},
};
use crate::metrics::StoreMetrics;

/// Most appends in one commit, so that the first of them does not wait for long.
const COMMIT_MAX: usize = 256;

/// Events of a deleted mission that are removed in one commit, and pages that are given back in one: some milliseconds.
const PURGE: i64 = 500;

/// When to try a removal again that failed.
const PATIENCE: Duration = Duration::from_secs(1);

/// What should be free beyond an append that was refused before the log is well again, bytes.
const PROBE_BYTES: usize = 64 << 10;

/// Where the reply goes. The caller may be gone: then the reply is dropped.
pub(super) type Reply<T> = oneshot::Sender<Result<T, StoreError>>;

/// What the writer does.
pub(super) enum Command {
    Append(Append, Reply<Appended>),
    /// Hides a mission at once, as it was ordered, and purges it by and by.
    Delete(String, Order, Reply<bool>),
    /// Tries whether anything can be stored.
    Probe(Reply<()>),
    /// Writes the store's file anew, without the room of what was deleted.
    Vacuum(Reply<()>),
    /// Moves everything from the write-ahead file into the store's own file, and ends.
    Close(Reply<()>),
}

/// The one connection that writes.
pub(super) struct Writer {
    connection: Connection,
    /// Missions whose events are removed a few at a time, when no command waits.
    purge: Vec<i64>,
    /// Whether the file has pages that are free since missions were deleted.
    free_pages: bool,
    /// Whether the last removal failed, as on a full disk.
    stuck: bool,
    /// Size of the largest append that was not stored, bytes: until as much can be stored, the store is not well.
    refused: Option<usize>,
    shares: Shares,
    metrics: StoreMetrics,
}

impl Writer {
    pub(super) fn new(connection: Connection, share: u64, metrics: StoreMetrics) -> rusqlite::Result<Self> {
        let deleted = "SELECT number FROM missions WHERE status = 'deleted'";
        let purge = connection
            .prepare(deleted)?
            .query_map([], |row| row.get(0))?
            .collect::<rusqlite::Result<_>>()?;
        Ok(Self {
            shares: Shares::read(&connection, share)?,
            connection,
            purge,
            free_pages: true,
            stuck: false,
            refused: None,
            metrics,
        })
    }

    /// Writes until every handle of the store is dropped.
    pub(super) fn run(mut self, commands: &Receiver<Command>) {
        loop {
            let patience = match (self.purge.is_empty(), self.stuck) {
                (true, _) if self.free_pages => Duration::ZERO,
                (true, _) => Duration::MAX,
                (false, true) => PATIENCE,
                (false, false) => Duration::ZERO,
            };
            match commands.recv_timeout(patience) {
                Ok(first) => {
                    if self.carry_out(first, commands).is_break() {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) => self.purge_some(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Carries out `first`, and the appends that wait behind it in the same commit; breaks after the last command.
    fn carry_out(&mut self, first: Command, commands: &Receiver<Command>) -> ControlFlow<()> {
        let mut appends = vec![];
        let mut next = Some(first);
        while let Some(command) = next {
            match command {
                Command::Append(append, reply) => appends.push((append, reply)),
                Command::Delete(id, order, reply) => {
                    self.store(std::mem::take(&mut appends));
                    let _ = reply.send(self.delete(&id, &order).map_err(StoreError::from));
                }
                Command::Vacuum(reply) => {
                    self.store(std::mem::take(&mut appends));
                    let _ = reply.send(self.vacuum().map_err(StoreError::from));
                }
                Command::Probe(reply) => {
                    let _ = reply.send(self.probe().map_err(StoreError::from));
                }
                Command::Close(reply) => {
                    self.store(std::mem::take(&mut appends));
                    let _ = reply.send(self.checkpoint());
                    return ControlFlow::Break(());
                }
            }
            next = (appends.len() < COMMIT_MAX)
                .then(|| commands.try_recv().ok())
                .flatten();
        }
        self.store(appends);
        ControlFlow::Continue(())
    }

    /// After this the store's own file is whole without its write-ahead file.
    fn checkpoint(&self) -> Result<(), StoreError> {
        let checkpoint = "PRAGMA wal_checkpoint(TRUNCATE)";
        let busy: bool = self.connection.query_row(checkpoint, [], |row| row.get(0))?;
        // A reader still reads: the write-ahead file keeps the rest.
        if busy { Err(StoreError::Busy) } else { Ok(()) }
    }

    fn store(&mut self, mut batch: Vec<(Append, Reply<Appended>)>) {
        if batch.is_empty() {
            return;
        }
        let appends: Vec<&Append> = batch.iter().map(|(append, _)| append).collect();
        let start = Instant::now();
        let committed = commit(&mut self.connection, &mut self.shares, &appends);
        let n_events = committed.as_ref().ok().map(|done| n_stored(&appends, done));
        self.metrics.committed(start.elapsed(), n_events);
        if committed.is_err() {
            let bytes = appends.iter().map(|append| size(append)).sum();
            self.refused = self.refused.max(Some(bytes));
        }
        match committed {
            Ok(appended) => reply_to_each(batch, appended.into_iter().map(Ok)),
            // One that cannot be stored must not take the others with it.
            Err(_) if 1 < batch.len() => {
                for alone in batch {
                    self.store(vec![alone]);
                }
            }
            Err(error) => reply_to_each([batch.remove(0)], [Err(error)]),
        }
    }

    /// Tries to store as much as was refused last: a disk may be full for one append and not for another.
    fn probe(&mut self) -> rusqlite::Result<()> {
        let mut try_out = self
            .connection
            .prepare_cached("UPDATE probes SET count = count + 1, room = zeroblob(?1)")?;
        if let Some(bytes) = self.refused {
            let with_indexes = bytes.saturating_mul(2) + PROBE_BYTES;
            try_out.execute([limit(with_indexes)])?;
            self.refused = None;
        }
        try_out.execute([0])?;
        Ok(())
    }

    /// Hides the mission at once; purging gives its room on the disk back by and by.
    fn delete(&mut self, id: &str, order: &Order) -> rusqlite::Result<bool> {
        let transaction = self.connection.transaction()?;
        let hidden: Option<(i64, Taken)> = transaction
            .prepare_cached(
                "UPDATE missions SET status = 'deleted', id = 'deleted ' || number WHERE id = ?1
                 RETURNING number, owner, bytes",
            )?
            .query_row([id], |row| Ok((row.get(0)?, taken(row, 1)?)))
            .optional()?;
        let Some((number, room)) = hidden else {
            return Ok(false);
        };
        keep_order(&transaction, id, order)?;
        transaction.commit()?;
        self.shares.give_back(&room);
        self.purge.push(number);
        Ok(true)
    }

    /// Removes what is left of deleted missions, and their room.
    fn vacuum(&mut self) -> rusqlite::Result<()> {
        while let Some(&number) = self.purge.last() {
            if purge(&self.connection, number)? {
                self.purge.pop();
            }
        }
        self.connection.execute_batch("VACUUM")
    }

    /// Removes some events, or gives some pages back to the disk.
    fn purge_some(&mut self) {
        let Some(&number) = self.purge.last() else {
            // Not worth a second try: the next deletion gives the pages back.
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
            Err(error) => tracing::warn!(%error, "a deleted mission keeps its room on the disk for now"),
        }
    }
}

/// Removes some events of a deleted mission, and the mission after the last one; whether the mission is gone.
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

/// Gives some free pages back to the disk; whether any were left to give.
fn give_back(connection: &Connection) -> rusqlite::Result<bool> {
    let free = || connection.query_row("PRAGMA freelist_count", [], |row| row.get::<_, i64>(0));
    let before = free()?;
    // Steps once for each page.
    let mut vacuum = connection.prepare_cached(&format!("PRAGMA incremental_vacuum({PURGE})"))?;
    let mut pages = vacuum.query([])?;
    while pages.next()?.is_some() {}
    let after = free()?;
    Ok(0 < after && after < before)
}

/// Roughly how much of the disk an append takes, bytes.
fn size(append: &Append) -> usize {
    let events = append.events.iter().map(|event| event.body.len());
    let snapshot = append.snapshot.as_ref().map_or(0, Vec::len);
    events.sum::<usize>() + append.summary.len() + snapshot
}

/// Events that a commit stored.
fn n_stored(appends: &[&Append], appended: &[Appended]) -> usize {
    let each = appends.iter().zip(appended);
    let stored = each.filter(|(_, appended)| matches!(appended, Appended::Stored));
    stored.map(|(append, _)| append.events.len()).sum()
}

fn reply_to_each(
    batch: impl IntoIterator<Item = (Append, Reply<Appended>)>,
    results: impl IntoIterator<Item = Result<Appended, StoreError>>,
) {
    for ((append, reply), result) in batch.into_iter().zip(results) {
        if let Err(error) = &result {
            tracing::error!(%error, mission = append.mission, "the mission log did not store");
        }
        let _ = reply.send(result);
    }
}

/// Who made the mission of a row, and what its events take: the columns from `first` on.
fn taken(row: &Row<'_>, first: usize) -> rusqlite::Result<Taken> {
    Ok(Taken {
        owner: row.get(first)?,
        bytes: row.get::<_, i64>(first + 1)?.unsigned_abs(),
    })
}

fn commit(
    connection: &mut Connection,
    shares: &mut Shares,
    appends: &[&Append],
) -> Result<Vec<Appended>, StoreError> {
    let transaction = connection.transaction()?;
    let mut taken = vec![];
    let appended = appends
        .iter()
        .map(|append| store(&transaction, shares, append, &mut taken))
        .collect::<rusqlite::Result<_>>()?;
    transaction.commit()?;
    for taken in taken {
        shares.take(taken);
    }
    Ok(appended)
}

/// Stores an append; what it takes of whose share goes into `taken`.
fn store(
    transaction: &Transaction<'_>,
    shares: &Shares,
    append: &Append,
    taken: &mut Vec<Taken>,
) -> rusqlite::Result<Appended> {
    if let Some(KeyedAnswer { key, request, .. }) = &append.answered
        && let Some((asked, answer)) = idempotency::find(transaction, &append.mission, key)?
    {
        return Ok(if asked == *request {
            Appended::AnsweredBefore(answer)
        } else {
            Appended::KeyTaken
        });
    }
    let summary = summary_digest(&append.mission, &append.status, &append.summary);
    let bytes = Shares::bytes_of(append);
    let room = limit(usize::try_from(bytes).unwrap_or(usize::MAX));
    let has_room = |owner: &str| shares.has_room(owner, bytes, append.room);
    let (number, owner) = match append.number {
        None => {
            let owner = append.order.as_ref().map(|order| order.caller.clone());
            let owner = owner.unwrap_or_default();
            if !has_room(&owner) {
                return Ok(Appended::ShareUsed);
            }
            let mut made = transaction.prepare_cached(
                "INSERT INTO missions (id, status, summary, digest, owner, bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6)
                 RETURNING number",
            )?;
            let number = made.query_row(
                params![
                    append.mission,
                    append.status,
                    append.summary,
                    summary,
                    owner,
                    room
                ],
                |row| row.get(0),
            )?;
            (number, owner)
        }
        Some(number) => {
            let number = signed(number);
            let mut last = transaction.prepare_cached(
                "SELECT (SELECT max(sequence) FROM events WHERE mission = number), owner FROM missions
                 WHERE number = ?1 AND status <> 'deleted'",
            )?;
            let last: Option<(Option<i64>, String)> =
                last.query_row([number], |row| row.try_into()).optional()?;
            let Some((last, owner)) = last else {
                return Ok(Appended::MissionGone);
            };
            if append
                .events
                .first()
                .is_some_and(|event| signed(event.sequence) != last.unwrap_or(0) + 1)
            {
                return Ok(Appended::OutOfSequence);
            }
            if !has_room(&owner) {
                return Ok(Appended::ShareUsed);
            }
            let mut became = transaction.prepare_cached(
                "UPDATE missions SET status = ?2, summary = ?3, digest = ?4, bytes = bytes + ?5 WHERE number = ?1",
            )?;
            became.execute(params![number, append.status, append.summary, summary, room])?;
            (number, owner)
        }
    };
    taken.push(Taken { owner, bytes });
    let mut event = transaction.prepare_cached(
        "INSERT INTO events (mission, sequence, kind, body, digest) VALUES (?1, ?2, ?3, ?4, ?5)",
    )?;
    for StoredEvent { sequence, kind, body } in &append.events {
        let sequence = signed(*sequence);
        event.execute(params![
            number,
            sequence,
            kind,
            body,
            digest(number, sequence, kind, body)
        ])?;
    }
    if let Some(snapshot) = &append.snapshot {
        let last = append.events.last().map_or(0, |event| signed(event.sequence));
        let mut kept = transaction.prepare_cached(
            "INSERT INTO snapshots (mission, sequence, body, digest) VALUES (?1, ?2, ?3, ?4)
             ON CONFLICT (mission) DO UPDATE SET sequence = ?2, body = ?3, digest = ?4",
        )?;
        kept.execute(params![
            number,
            last,
            snapshot,
            digest(number, last, SNAPSHOT, snapshot)
        ])?;
    }
    if let Some(answered) = &append.answered {
        idempotency::keep(transaction, number, answered)?;
    }
    if let Some(order) = &append.order {
        keep_order(transaction, &append.mission, order)?;
    }
    Ok(Appended::Stored)
}

fn keep_order(transaction: &Transaction<'_>, mission: &str, order: &Order) -> rusqlite::Result<()> {
    let Order {
        at_s,
        caller,
        request,
        action,
    } = order;
    let mut kept = transaction.prepare_cached(
        "INSERT INTO orders (at_s, caller, request, mission, action, digest) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
    )?;
    kept.execute(params![
        at_s,
        caller,
        request,
        mission,
        action,
        order_digest(mission, order)
    ])?;
    Ok(())
}
