//! The one that writes: what waits together shares a commit, and each is told what became of it.

use std::{
    sync::mpsc::{Receiver, RecvTimeoutError},
    time::Duration,
};

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};
use tokio::sync::oneshot;

use super::{Answered, Append, Appended, Event, LogError, SNAPSHOT, answered, digest, limit, signed};

/// Appends that share a commit at most, so that the first of them does not wait for long.
const COMMIT_MAX: usize = 256;

/// Events of a deleted mission that are removed in one commit: some milliseconds.
const PURGE: i64 = 500;

/// When to try a removal again that failed.
const PATIENCE: Duration = Duration::from_secs(1);

/// What should be free beyond an append that was refused before the log is well again, bytes.
const PROBE_BYTES: usize = 64 << 10;

/// Where the answer goes.
pub(super) type Told<T> = oneshot::Sender<Result<T, LogError>>;

/// What the writer is asked for.
pub(super) enum Order {
    Append(Append, Told<Appended>),
    /// Forget a mission.
    Delete(String, Told<bool>),
    /// Try whether anything can be stored.
    Probe(Told<()>),
}

/// Missions that were deleted and are not yet gone.
pub(super) fn deleted(connection: &Connection) -> rusqlite::Result<Vec<i64>> {
    let mut statement = connection.prepare("SELECT number FROM missions WHERE status = 'deleted'")?;
    let numbers = statement.query_map([], |row| row.get(0))?;
    numbers.collect()
}

/// The one that writes.
pub(super) struct Writer {
    pub(super) connection: Connection,
    /// Missions whose events are removed a few at a time, when nobody waits.
    pub(super) purge: Vec<i64>,
    /// Whether the last removal failed, as on a full disk.
    pub(super) stuck: bool,
    /// Size of the largest append that was not stored, bytes: until as much can be stored, the log is not well.
    pub(super) refused: Option<usize>,
}

impl Writer {
    /// Writes until every [`Log`] is dropped.
    pub(super) fn run(mut self, orders: &Receiver<Order>) {
        loop {
            let patience = match (self.purge.is_empty(), self.stuck) {
                (true, _) => Duration::MAX,
                (false, true) => PATIENCE,
                (false, false) => Duration::ZERO,
            };
            match orders.recv_timeout(patience) {
                Ok(first) => self.carry_out(first, orders),
                Err(RecvTimeoutError::Timeout) => self.purge_some(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Carries out `first`, and whatever waits behind it in one commit if that is appends.
    fn carry_out(&mut self, first: Order, orders: &Receiver<Order>) {
        let mut appends = vec![];
        let mut next = Some(first);
        while let Some(order) = next {
            match order {
                Order::Append(append, told) => appends.push((append, told)),
                Order::Delete(id, told) => {
                    self.store(std::mem::take(&mut appends));
                    // Whoever asked may have gone.
                    let _ = told.send(self.delete(&id).map_err(LogError::from));
                }
                Order::Probe(told) => {
                    let _ = told.send(self.probe().map_err(LogError::from));
                }
            }
            next = (appends.len() < COMMIT_MAX)
                .then(|| orders.try_recv().ok())
                .flatten();
        }
        self.store(appends);
    }

    fn store(&mut self, mut batch: Vec<(Append, Told<Appended>)>) {
        if batch.is_empty() {
            return;
        }
        let appends: Vec<&Append> = batch.iter().map(|(append, _)| append).collect();
        let committed = commit(&mut self.connection, &appends);
        if committed.is_err() {
            let bytes = appends.iter().map(|append| size(append)).sum();
            self.refused = self.refused.max(Some(bytes));
        }
        match committed {
            Ok(appended) => tell(batch, appended.into_iter().map(Ok)),
            // One that cannot be stored must not take the others with it.
            Err(_) if 1 < batch.len() => {
                for alone in batch {
                    self.store(vec![alone]);
                }
            }
            Err(error) => tell([batch.remove(0)], [Err(error)]),
        }
    }

    /// Tries to store something: as much as was refused last, for a disk may be full for one append and not for another.
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

    /// Takes the mission out of sight at once; what it holds of the disk is given back by and by.
    fn delete(&mut self, id: &str) -> rusqlite::Result<bool> {
        let mut hidden = self.connection.prepare_cached(
            "UPDATE missions SET status = 'deleted', id = 'deleted ' || number WHERE id = ?1 RETURNING number",
        )?;
        let number: Option<i64> = hidden.query_row([id], |row| row.get(0)).optional()?;
        self.purge.extend(number);
        Ok(number.is_some())
    }

    fn purge_some(&mut self) {
        let Some(&number) = self.purge.last() else { return };
        let purged = purge(&self.connection, number);
        self.stuck = purged.is_err();
        match purged {
            Ok(true) => {
                self.purge.pop();
            }
            Ok(false) => {}
            Err(error) => tracing::warn!(%error, "a deleted mission keeps its room on the disk for now"),
        }
    }
}

/// Removes some events of a deleted mission, and at last the mission; whether it is gone.
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

/// About what an append needs of the disk, bytes.
fn size(append: &Append) -> usize {
    let events = append.events.iter().map(|event| event.body.len());
    let snapshot = append.snapshot.as_ref().map_or(0, Vec::len);
    events.sum::<usize>() + append.summary.len() + snapshot
}

fn tell(
    batch: impl IntoIterator<Item = (Append, Told<Appended>)>,
    results: impl IntoIterator<Item = Result<Appended, LogError>>,
) {
    for ((append, told), result) in batch.into_iter().zip(results) {
        if let Err(error) = &result {
            tracing::error!(%error, mission = append.mission, "the mission log did not store");
        }
        // Whoever asked may have gone.
        let _ = told.send(result);
    }
}

fn commit(connection: &mut Connection, appends: &[&Append]) -> Result<Vec<Appended>, LogError> {
    let transaction = connection.transaction()?;
    let appended = appends
        .iter()
        .map(|append| store(&transaction, append))
        .collect::<rusqlite::Result<_>>()?;
    transaction.commit()?;
    Ok(appended)
}

fn store(transaction: &Transaction<'_>, append: &Append) -> rusqlite::Result<Appended> {
    if let Some(Answered { key, request, .. }) = &append.answered
        && let Some((asked, answer)) = answered(transaction, &append.mission, key)?
    {
        return Ok(if asked == *request {
            Appended::Before(answer)
        } else {
            Appended::KeyTaken
        });
    }
    let number = match append.number {
        None => {
            let mut made = transaction.prepare_cached(
                "INSERT INTO missions (id, status, summary) VALUES (?1, ?2, ?3) RETURNING number",
            )?;
            made.query_row(params![append.mission, append.status, append.summary], |row| {
                row.get(0)
            })?
        }
        Some(number) => {
            let number = signed(number);
            let mut last = transaction.prepare_cached(
                "SELECT (SELECT max(sequence) FROM events WHERE mission = number) FROM missions
                 WHERE number = ?1 AND status <> 'deleted'",
            )?;
            let last: Option<Option<i64>> = last.query_row([number], |row| row.get(0)).optional()?;
            let Some(last) = last else {
                return Ok(Appended::Gone);
            };
            if append
                .events
                .first()
                .is_some_and(|event| signed(event.sequence) != last.unwrap_or(0) + 1)
            {
                return Ok(Appended::Overtaken);
            }
            let mut became = transaction
                .prepare_cached("UPDATE missions SET status = ?2, summary = ?3 WHERE number = ?1")?;
            became.execute(params![number, append.status, append.summary])?;
            number
        }
    };
    let mut event = transaction.prepare_cached(
        "INSERT INTO events (mission, sequence, kind, body, digest) VALUES (?1, ?2, ?3, ?4, ?5)",
    )?;
    for Event { sequence, kind, body } in &append.events {
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
    if let Some(Answered { key, request, answer }) = &append.answered {
        let mut answered = transaction
            .prepare_cached("INSERT INTO answered (mission, key, request, answer) VALUES (?1, ?2, ?3, ?4)")?;
        answered.execute(params![number, key, request, answer])?;
    }
    Ok(Appended::Now)
}
