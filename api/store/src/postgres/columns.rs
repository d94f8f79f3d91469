//! The rows that a batch inserts and changes, as arrays: one statement per table for all appends.

use super::super::digest::Links;
use super::super::entry::Append;
use super::super::error::StoreError;
use super::super::shares::Shares;
use super::super::sql::{signed, without_nul};
use super::link::Link;

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

/// Writes the rows of the stored appends. New missions have their own row already.
pub(super) fn write(
    link: &Link,
    stored: &[(&Append, Links)],
    now_s: f64,
    service: Option<&str>,
) -> Result<(), StoreError> {
    let changed: Vec<_> = stored.iter().filter(|(append, _)| append.number.is_some()).collect();
    if !changed.is_empty() {
        let n_changed = link.execute(
            CHANGE,
            &[
                &column(&changed, |(_, links)| links.head.mission),
                &column(&changed, |(append, _)| signed(append.epoch)),
                &column(&changed, |(append, _)| &*append.status),
                &column(&changed, |(append, _)| &*append.summary),
                &column(&changed, |(_, links)| links.head.sequence),
                &column(&changed, |(append, _)| signed(Shares::bytes_of(append))),
                &column(&changed, |(_, links)| &*links.head.digest),
                &column(&changed, |(_, links)| &*links.summary),
                &now_s,
                &service,
            ],
        )?;
        if n_changed != changed.len() as u64 {
            let what = "a locked mission has another epoch".to_owned();
            return Err(StoreError::Damaged(what));
        }
    }
    let events = stored.iter().flat_map(|(append, links)| {
        let linked = append.events.iter().zip(&links.events);
        linked.map(|(event, digest)| (links.head.mission, event, digest))
    });
    let events: Vec<_> = events.collect();
    if !events.is_empty() {
        link.execute(
            EVENTS,
            &[
                &column(&events, |(number, ..)| *number),
                &column(&events, |(_, event, _)| signed(event.sequence)),
                &column(&events, |(_, event, _)| &*event.kind),
                &column(&events, |(_, event, _)| &*event.body),
                &column(&events, |(.., digest)| &***digest),
            ],
        )?;
    }
    let snapshots = stored.iter().filter_map(|(append, links)| {
        let snapshot = append.snapshot.as_deref().zip(links.checkpoint.as_deref());
        Some((&links.head, snapshot?))
    });
    let snapshots: Vec<_> = snapshots.collect();
    if !snapshots.is_empty() {
        link.execute(
            SNAPSHOTS,
            &[
                &column(&snapshots, |(head, _)| head.mission),
                &column(&snapshots, |(head, _)| head.sequence),
                &column(&snapshots, |(_, (body, _))| *body),
                &column(&snapshots, |(_, (_, digest))| *digest),
            ],
        )?;
    }
    let keys = stored.iter();
    let keys = keys.filter_map(|(append, links)| Some((links.head.mission, append.answered.as_ref()?)));
    let keys: Vec<_> = keys.collect();
    if !keys.is_empty() {
        link.execute(
            KEYS,
            &[
                &column(&keys, |(number, _)| *number),
                &column(&keys, |(_, answered)| without_nul(&answered.key)),
                &column(&keys, |(_, answered)| &answered.request[..]),
                &column(&keys, |(_, answered)| &*answered.answer),
            ],
        )?;
    }
    Ok(())
}

fn column<'r, R, T>(rows: &'r [R], cell: impl Fn(&'r R) -> T) -> Vec<T> {
    rows.iter().map(cell).collect()
}
