//! The writer thread of a database: waiting appends share a commit of a few statements.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use super::super::command::{LogWriter, Waiting, reply_to_each, stored};
use super::super::entry::{Append, Appended, AuditEntry, KeyedAnswer, StoredEvent};
use super::super::error::StoreError;
use super::super::known::Known;
use super::super::metrics::StoreMetrics;
use super::super::shares::{Shares, Taken};
use super::super::sql::{DELETED, PROTECT, new_id, signed, without_nul};
use super::super::trusted_time::{TrustedClock, TrustedTime};
use super::batch::{Batch, end, number_in_order};
use super::lease::Lease;
use super::link::{Database, Link};

/// Most appends in one commit: one for each mission that a service may have.
const COMMIT_MAX: usize = 1_024;

/// Pause between removals.
const PURGE_PAUSE: Duration = Duration::from_millis(50);

/// Longest age of the sums of shares, because other services also write.
const SHARES_LIFE: Duration = Duration::from_secs(10);

/// A connection that an error replaces.
struct Connection {
    database: Database,
    link: Option<Link>,
}

impl Connection {
    fn with<T>(&mut self, work: impl FnOnce(&Link) -> Result<T, StoreError>) -> Result<T, StoreError> {
        let link = match self.link.take().filter(|link| !link.client.is_closed()) {
            Some(link) => link,
            None => self.database.connect()?,
        };
        let done = work(&link)?;
        self.link = Some(link);
        Ok(done)
    }
}

/// The only writer of this process.
pub(super) struct PostgresWriter {
    connection: Connection,
    lease: Option<Lease>,
    /// Deleted missions; their events are removed step by step while no command waits.
    purge: Vec<i64>,
    shares: Shares,
    shares_read: Option<Instant>,
    known: Known,
    /// The largest failed append. The store is ready once it can store this size.
    refused: Option<Append>,
    clock: TrustedClock,
    metrics: StoreMetrics,
}

impl PostgresWriter {
    pub(super) fn new(
        (database, lease): (&Database, &Option<Lease>),
        share: u64,
        clock: TrustedClock,
        metrics: StoreMetrics,
    ) -> Result<Self, StoreError> {
        let mut writer = Self {
            connection: Connection { database: database.clone(), link: Some(database.connect()?) },
            lease: lease.clone(),
            purge: vec![],
            shares: Shares::new(share),
            shares_read: None,
            known: Known::default(),
            refused: None,
            clock,
            metrics,
        };
        writer.count()?;
        Ok(writer)
    }

    fn with<T>(&mut self, work: impl FnOnce(&Link) -> Result<T, StoreError>) -> Result<T, StoreError> {
        self.connection.with(work)
    }

    /// Stores appends of different missions in one commit.
    fn commit(&mut self, appends: &[&Append]) -> Result<Vec<Appended>, StoreError> {
        self.known.check()?;
        let numbers = appends.iter().filter_map(|append| append.number.map(signed));
        if numbers.into_iter().any(|number| !self.known.has(number)) {
            // This service knows no event of missions that others had.
            self.count()?;
        }
        self.read_shares()?;
        let now_s = self.clock.now_s();
        let service = self.lease.as_ref().map(Lease::id);
        let stored = self.connection.with(|link| {
            let mut batch = Batch::new(appends, service, (&self.shares, &self.known), now_s);
            batch.prepare(link)?;
            end(link)?;
            Ok((batch.appended, batch.taken, batch.heads))
        });
        let (appended, taken, heads) = stored.inspect_err(|_| self.shares_read = None)?;
        for taken in taken {
            self.shares.take(taken);
        }
        for (append, head) in heads {
            self.known.add(&append.mission, head, append.is_over());
        }
        if appended.contains(&Appended::MissionGone) {
            // The mission was deleted or lost.
            self.count()?;
        }
        Ok(appended)
    }

    /// Counts a probe; fails if the store was set back.
    fn count(&mut self) -> Result<(), StoreError> {
        const COUNT: &str = "UPDATE probes SET count = count + 1 RETURNING count";
        let counted = self.with(|link| link.rows().one(COUNT, |row| row.get(0)))?;
        self.known.count(counted)
    }

    /// Remembers refused appends, and that the store was set back.
    fn note(&mut self, error: &StoreError, appends: &[&Append]) {
        match error {
            StoreError::SetBack(what) if self.known.check().is_ok() => {
                let lost = self.lost().unwrap_or_else(|error| vec![error.to_string()]);
                self.known.note(&format!("{what} (lost: {})", lost.join(", ")));
            }
            StoreError::Full | StoreError::Refused(_) => {
                let all = appends.iter().copied().chain(&self.refused);
                self.refused = all.max_by_key(|append| Shares::bytes_of(append)).cloned();
            }
            _ => {}
        }
    }

    /// Names lost events of unfinished missions that were acknowledged and not deleted.
    fn lost(&mut self) -> Result<Vec<String>, StoreError> {
        const LOST: &str = "SELECT asked.id, coalesce(missions.sequence, 0), asked.sequence
            FROM unnest(?1::bigint[], ?2::bigint[], ?3::bytea[], ?4::text[]) AS asked(number, sequence, digest, id)
            LEFT JOIN missions ON missions.number = asked.number
            LEFT JOIN events ON events.mission = asked.number AND events.sequence = asked.sequence
            WHERE events.digest IS DISTINCT FROM asked.digest AND coalesce(status, '') <> 'deleted' AND NOT EXISTS
                (SELECT 1 FROM orders WHERE orders.mission = asked.id AND action IN ('delete', 'expire'))
            ORDER BY asked.number LIMIT 32";
        let (mut numbers, mut sequences, mut digests, mut ids) = (vec![], vec![], vec![], vec![]);
        for (id, head) in self.known.heads.values().filter(|(_, head)| 0 < head.sequence) {
            numbers.push(head.mission);
            sequences.push(head.sequence);
            digests.push(head.digest.clone());
            ids.push(id.clone());
        }
        let rows = self.with(|link| link.query(LOST, &[&numbers, &sequences, &digests, &ids]))?;
        let named = rows.iter().map(|row| {
            let (id, stored, known): (String, i64, i64) = (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
            Ok(format!("events of mission {id} after {stored} up to {known}"))
        });
        named.collect()
    }

    fn read_shares(&mut self) -> Result<(), StoreError> {
        let since = self.shares_read.map(|read| self.clock.machine.since(read));
        if since.is_some_and(|since| since < SHARES_LIFE) || self.shares.is_unlimited() {
            return Ok(());
        }
        self.connection.with(|link| self.shares.read(link))?;
        self.shares_read = Some(self.clock.machine.now());
        Ok(())
    }

    /// Reads the deleted missions, because other services and programs also delete.
    fn read_deleted(&mut self) -> Result<(), StoreError> {
        self.purge = self.with(|link| link.rows().all(DELETED, &[], |row| row.get(0)))?;
        Ok(())
    }

    /// Removes some events of a deleted mission, at last the mission.
    fn purge_some(&mut self) -> Result<(), StoreError> {
        let Some(&number) = self.purge.last() else {
            return Ok(());
        };
        if self.with(|link| link.rows().purge(number))? {
            self.purge.pop();
        }
        Ok(())
    }
}

impl LogWriter for PostgresWriter {
    fn commit_max(&self) -> usize {
        COMMIT_MAX
    }

    fn rest(&self) -> Option<Duration> {
        (!self.purge.is_empty()).then_some(PURGE_PAUSE)
    }

    fn upkeep(&mut self) {
        if let Err(error) = self.purge_some() {
            tracing::warn!(%error, "cannot free the disk space of a deleted mission yet");
            // [`LogWriter::keep_time`] reads the deleted missions again.
            self.purge.clear();
        }
    }

    fn recover(&mut self) -> Result<(), StoreError> {
        (self.connection.link, self.shares_read) = (None, None);
        Ok(())
    }

    fn store(&mut self, mut waiting: Vec<Waiting>) {
        while !waiting.is_empty() {
            // A second append to a mission must know the first.
            let mut missions = HashSet::new();
            let waited = waiting.into_iter();
            let mut batch;
            (batch, waiting) = waited.partition(|(append, _)| missions.insert(append.mission.clone()));
            let appends: Vec<&Append> = batch.iter().map(|(append, _)| append).collect();
            let start = self.clock.machine.now();
            let mut committed = self.commit(&appends);
            if let ([_], Err(StoreError::Refused(_))) = (&appends[..], &committed) {
                // Another service may just have stored the request: then its key has an answer.
                committed = self.commit(&appends);
            }
            let counts = committed.as_ref().ok().map(|done| stored(&appends, done));
            self.metrics.committed(self.clock.machine.since(start), counts);
            match committed {
                Ok(appended) => reply_to_each(batch, appended.into_iter().map(Ok)),
                // One bad append must not fail the others.
                Err(StoreError::Refused(_)) if 1 < batch.len() => {
                    for alone in batch {
                        self.store(vec![alone]);
                    }
                }
                Err(error) => {
                    self.note(&error, &appends);
                    let error = self.known.check().err().unwrap_or(error);
                    let errors = vec![Err(error); batch.len()];
                    reply_to_each(batch.drain(..), errors);
                }
            }
        }
    }

    fn delete(&mut self, id: &str, order: &AuditEntry) -> Result<bool, StoreError> {
        const HIDE: &str =
            "UPDATE missions SET status = 'deleted', id = 'deleted ' || number, owner_service = NULL
            WHERE id = ?1 RETURNING number, owner, bytes";
        self.known.check()?;
        let hidden = self.with(|link| {
            link.batch("BEGIN")?;
            let hidden = link.rows().first(HIDE, &[&without_nul(id)], Taken::hidden)?;
            if hidden.is_none() {
                link.batch("ROLLBACK")?;
                return Ok(None);
            }
            number_in_order(link)?;
            link.rows().keep_order(id, order)?;
            end(link)?;
            Ok(hidden)
        })?;
        let Some((number, room)) = hidden else {
            return Ok(false);
        };
        self.shares.give_back(&room);
        self.purge.push(number);
        Ok(true)
    }

    fn keep_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        // Several services keep the time, which never goes back.
        let write = TrustedTime::WRITE.replace("?1", "greatest(trusted_s, ?1)");
        self.with(|link| time.write(link, &write))?;
        self.read_deleted()
    }

    fn set_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        self.with(|link| time.write(link, TrustedTime::WRITE))
    }

    fn protect(&mut self) -> Result<(), StoreError> {
        self.with(|link| link.execute(PROTECT, &[])).map(drop)
    }

    /// Stores the largest failed append again and rolls back: changing a row needs no disk space.
    fn probe(&mut self) -> Result<(), StoreError> {
        self.known.check()?;
        if let Err(error) = self.count() {
            self.note(&error, &[]);
            return Err(self.known.check().err().unwrap_or(error));
        }
        let Some(refused) = self.refused.take() else {
            return Ok(());
        };
        // Only its bytes, as a new mission: another part of the append may fail for ever.
        let id = new_id();
        let events =
            (1..).zip(&refused.events).map(|(sequence, event)| StoredEvent { sequence, ..event.clone() });
        let again = Append {
            events: events.collect(),
            status: "finished".to_owned(),
            summary: refused.summary.clone(),
            snapshot: refused.snapshot.clone(),
            answered: refused.answered.clone().map(|answered| KeyedAnswer { key: id.clone(), ..answered }),
            mission: id,
            ..Append::default()
        };
        let (shares, known) = (Shares::new(u64::MAX), Known::default());
        let tried = self.with(|link| {
            Batch::new(&[&again], None, (&shares, &known), 0.0).prepare(link)?;
            link.batch("ROLLBACK")
        });
        if tried.is_err() {
            self.refused = Some(refused);
        }
        tried
    }

    fn vacuum(&mut self) -> Result<(), StoreError> {
        while !self.purge.is_empty() {
            self.purge_some()?;
        }
        Ok(())
    }
}
