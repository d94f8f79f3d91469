//! The rows that a batch inserts and changes, as arrays: one statement per table for all appends.

use std::borrow::Cow;

use super::{
    super::{
        digest::Links,
        entry::Append,
        error::StoreError,
        shares::Shares,
        sql::{signed, without_nul},
    },
    link::Link,
};

/// The database refuses a stale epoch: then it changes fewer rows than there are appends.
const CHANGE: &str = "UPDATE missions SET status = new.status, summary = new.summary, sequence = new.sequence,
    head = new.head, digest = new.digest,
    bytes = missions.bytes + new.bytes,
    over_s = CASE WHEN new.status IN ('finished', 'failed') THEN coalesce(over_s, ?9) END,
    owner_service = CASE WHEN new.status IN ('finished', 'failed') THEN NULL ELSE owner_service END
    FROM unnest(?1::bigint[], ?2::bigint[], ?3::text[], ?4::bytea[], ?5::bigint[], ?6::bigint[], ?7::bytea[], ?8::bytea[])
        AS new(number, epoch, status, summary, sequence, bytes, head, digest)
    WHERE missions.number = new.number AND missions.epoch = new.epoch AND owner_service IS NOT DISTINCT FROM ?10";

const EVENTS: &str = "INSERT INTO events (mission, sequence, kind, body, digest)
    SELECT * FROM unnest(?1::bigint[], ?2::bigint[], ?3::text[], ?4::bytea[], ?5::bytea[])";

const SNAPSHOTS: &str = "INSERT INTO snapshots (mission, sequence, body, digest)
    SELECT * FROM unnest(?1::bigint[], ?2::bigint[], ?3::bytea[], ?4::bytea[]) ON CONFLICT (mission)
    DO UPDATE SET sequence = excluded.sequence, body = excluded.body, digest = excluded.digest";

const KEYS: &str = "INSERT INTO answered (mission, key, request, answer)
    SELECT * FROM unnest(?1::bigint[], ?2::text[], ?3::bytea[], ?4::bytea[])";

/// Rows to insert and to change.
#[derive(Default)]
pub(super) struct Columns<'a> {
    changed: Changed<'a>,
    events: Events<'a>,
    snapshots: Snapshots<'a>,
    keys: Keys<'a>,
}

#[derive(Default)]
struct Changed<'a> {
    numbers: Vec<i64>,
    epochs: Vec<i64>,
    statuses: Vec<&'a str>,
    summaries: Vec<&'a [u8]>,
    sequences: Vec<i64>,
    bytes: Vec<i64>,
    heads: Vec<Vec<u8>>,
    digests: Vec<Vec<u8>>,
}

#[derive(Default)]
struct Events<'a> {
    numbers: Vec<i64>,
    sequences: Vec<i64>,
    kinds: Vec<&'a str>,
    bodies: Vec<&'a [u8]>,
    digests: Vec<Vec<u8>>,
}

#[derive(Default)]
struct Snapshots<'a> {
    numbers: Vec<i64>,
    sequences: Vec<i64>,
    bodies: Vec<&'a [u8]>,
    digests: Vec<Vec<u8>>,
}

#[derive(Default)]
struct Keys<'a> {
    numbers: Vec<i64>,
    names: Vec<Cow<'a, str>>,
    requests: Vec<&'a [u8]>,
    answers: Vec<&'a [u8]>,
}

impl<'a> Columns<'a> {
    /// Changes the mission of an append.
    pub(super) fn change(&mut self, append: &'a Append, links: &Links) {
        let changed = &mut self.changed;
        changed.numbers.push(links.head.mission);
        changed.epochs.push(signed(append.epoch));
        changed.statuses.push(&append.status);
        changed.summaries.push(&append.summary);
        changed.sequences.push(links.head.sequence);
        changed.bytes.push(signed(Shares::bytes_of(append)));
        changed.heads.push(links.head.digest.clone());
        changed.digests.push(links.summary.clone());
    }

    /// Adds the rows that an append inserts.
    pub(super) fn add(&mut self, append: &'a Append, links: Links) {
        let (number, last) = (links.head.mission, links.head.sequence);
        for (event, digest) in append.events.iter().zip(links.events) {
            self.events.digests.push(digest);
            self.events.numbers.push(number);
            self.events.sequences.push(signed(event.sequence));
            self.events.kinds.push(&event.kind);
            self.events.bodies.push(&event.body);
        }
        if let Some((snapshot, digest)) = append.snapshot.as_ref().zip(links.checkpoint) {
            self.snapshots.digests.push(digest);
            self.snapshots.numbers.push(number);
            self.snapshots.sequences.push(last);
            self.snapshots.bodies.push(snapshot);
        }
        if let Some(answered) = &append.answered {
            self.keys.numbers.push(number);
            self.keys.names.push(without_nul(&answered.key));
            self.keys.requests.push(&answered.request);
            self.keys.answers.push(&answered.answer);
        }
    }

    pub(super) fn write(&self, link: &Link, now_s: f64, service: Option<&str>) -> Result<(), StoreError> {
        let Self {
            changed,
            events,
            snapshots,
            keys,
        } = self;
        if !changed.numbers.is_empty() {
            let n_changed = link.execute(
                CHANGE,
                &[
                    &changed.numbers,
                    &changed.epochs,
                    &changed.statuses,
                    &changed.summaries,
                    &changed.sequences,
                    &changed.bytes,
                    &changed.heads,
                    &changed.digests,
                    &now_s,
                    &service,
                ],
            )?;
            if n_changed != changed.numbers.len() as u64 {
                let what = "a locked mission has another epoch".to_owned();
                return Err(StoreError::Damaged(what));
            }
        }
        if !events.numbers.is_empty() {
            link.execute(
                EVENTS,
                &[
                    &events.numbers,
                    &events.sequences,
                    &events.kinds,
                    &events.bodies,
                    &events.digests,
                ],
            )?;
        }
        if !snapshots.numbers.is_empty() {
            link.execute(
                SNAPSHOTS,
                &[
                    &snapshots.numbers,
                    &snapshots.sequences,
                    &snapshots.bodies,
                    &snapshots.digests,
                ],
            )?;
        }
        if !keys.numbers.is_empty() {
            link.execute(KEYS, &[&keys.numbers, &keys.names, &keys.requests, &keys.answers])?;
        }
        Ok(())
    }
}
