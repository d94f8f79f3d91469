//! Appends of different missions in one transaction.

use std::collections::HashMap;

use super::{
    super::{
        digest::{Head, Links},
        entry::{Append, Appended, AuditEntry},
        error::StoreError,
        known::Known,
        shares::{Shares, Taken},
        sql::{signed, without_nul},
    },
    columns::Columns,
    link::Link,
};

/// Locks the missions in order of their numbers, so that two services wait but do not deadlock.
const LOCK: &str = "SELECT number, sequence, head, coalesce((SELECT digest FROM events WHERE mission = number
    AND events.sequence = missions.sequence), ''), owner, epoch, owner_service FROM missions
    WHERE number = ANY(?1) AND status <> 'deleted' ORDER BY number FOR UPDATE";

/// The answers to missions' keys.
const ANSWERED: &str = "SELECT asked.place, request, answer
    FROM unnest(?1::bigint[], ?2::text[], ?3::text[]) AS asked(place, id, key)
    JOIN missions ON missions.id = asked.id AND status <> 'deleted'
    JOIN answered ON answered.mission = missions.number AND answered.key = asked.key";

/// Reserves a mission's number, which its digests need.
const NUMBER: &str = "SELECT nextval(pg_get_serial_sequence('missions', 'number'))";

const CREATE: &str =
    "INSERT INTO missions (number, id, status, summary, owner, bytes, over_s, sequence, head, digest)
    VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)";

/// Lets the numbers of missions and orders rise with their commits, so that a reader that continues
/// after a number skips no row. The lock has a number of this program; a commit releases it.
const IN_ORDER: &str = "SELECT pg_advisory_xact_lock(7083212650464)";

const ORDER: &str = "INSERT INTO orders (at_s, caller, request, mission, action) VALUES (?1, ?2, ?3, ?4, ?5)";

/// A locked mission.
struct Locked {
    head: Head,
    /// `true` if its last event is stored.
    is_whole: bool,
    owner: String,
    epoch: u64,
    service: Option<String>,
}

/// Appends of different missions, and the result of each.
pub(super) struct Batch<'a, 'b> {
    appends: &'a [&'a Append],
    /// This service; none while the store is not shared.
    service: Option<&'b str>,
    shares: &'b Shares,
    known: &'b Known,
    /// Trusted time, Unix time, s.
    now_s: f64,
    /// Results, in the order of the appends.
    pub(super) appended: Vec<Appended>,
    pub(super) taken: Vec<Taken>,
    /// The last event of the mission after each stored append.
    pub(super) heads: Vec<(&'a Append, Head)>,
}

impl<'a, 'b> Batch<'a, 'b> {
    pub(super) fn new(
        appends: &'a [&'a Append],
        service: Option<&'b str>,
        (shares, known): (&'b Shares, &'b Known),
        now_s: f64,
    ) -> Self {
        Self {
            appends,
            service,
            shares,
            known,
            now_s,
            appended: vec![],
            taken: vec![],
            heads: vec![],
        }
    }

    /// Stores the accepted appends and commits. An error stores nothing, unless it says otherwise.
    pub(super) fn store(&mut self, link: &Link) -> Result<(), StoreError> {
        self.prepare(link)?;
        end(link)
    }

    /// Stores the accepted appends, and rolls back.
    pub(super) fn try_out(&mut self, link: &Link) -> Result<(), StoreError> {
        self.prepare(link)?;
        link.batch("ROLLBACK")
    }

    fn prepare(&mut self, link: &Link) -> Result<(), StoreError> {
        link.batch("BEGIN")?;
        let locked = self.lock(link)?;
        let answered = self.answered(link)?;
        for (place, append) in self.appends.iter().enumerate() {
            let appended = match answered.get(&place) {
                Some(answered) => answered.clone(),
                None => self.decide(append, &locked)?,
            };
            self.appended.push(appended);
        }
        self.write(link, &locked)
    }

    fn lock(&self, link: &Link) -> Result<HashMap<u64, Locked>, StoreError> {
        let numbers: Vec<i64> = self
            .appends
            .iter()
            .filter_map(|append| append.number.map(signed))
            .collect();
        if numbers.is_empty() {
            return Ok(HashMap::new());
        }
        let rows = link.query(LOCK, &[&numbers])?;
        let locked = rows.iter().map(|row| {
            let epoch: i64 = row.try_get(5)?;
            let head = Head {
                mission: row.try_get(0)?,
                sequence: row.try_get(1)?,
                digest: row.try_get(2)?,
            };
            let locked = Locked {
                is_whole: head.digest == row.try_get::<_, Vec<u8>>(3)?,
                head,
                owner: row.try_get(4)?,
                epoch: epoch.unsigned_abs(),
                service: row.try_get(6)?,
            };
            Ok((row.try_get::<_, i64>(0)?.unsigned_abs(), locked))
        });
        locked.collect()
    }

    /// Results of appends whose keys were answered before, by their places.
    fn answered(&self, link: &Link) -> Result<HashMap<usize, Appended>, StoreError> {
        let (mut places, mut ids, mut keys) = (vec![], vec![], vec![]);
        for (place, append) in (0_i64..).zip(self.appends) {
            if let Some(answered) = &append.answered {
                places.push(place);
                ids.push(append.mission.as_str());
                keys.push(without_nul(&answered.key));
            }
        }
        if places.is_empty() {
            return Ok(HashMap::new());
        }
        let rows = link.query(ANSWERED, &[&places, &ids, &keys])?;
        let found = rows.iter().map(|row| {
            let place = usize::try_from(row.try_get::<_, i64>(0)?).unwrap_or(usize::MAX);
            let request: Vec<u8> = row.try_get(1)?;
            let asked = self.appends[place].answered.as_ref();
            let appended = if asked.is_some_and(|asked| asked.request[..] == request[..]) {
                Appended::AnsweredBefore(row.try_get(2)?)
            } else {
                Appended::KeyTaken
            };
            Ok((place, appended))
        });
        found.collect()
    }

    /// Decides about an append: stored, or the reason against it.
    fn decide(&mut self, append: &Append, locked: &HashMap<u64, Locked>) -> Result<Appended, StoreError> {
        let owner = match append.number {
            None => creator(append).to_owned(),
            Some(number) => {
                let Some(mission) = locked.get(&number) else {
                    return Ok(Appended::MissionGone);
                };
                if mission.epoch != append.epoch || mission.service.as_deref() != self.service {
                    return Ok(Appended::NotOwner);
                }
                self.known.compare(&mission.head)?;
                let first = append.events.first();
                if first.is_some_and(|event| signed(event.sequence) != mission.head.sequence + 1) {
                    return Ok(Appended::OutOfSequence);
                }
                if !mission.is_whole {
                    return Err(mission.head.missing(&append.mission));
                }
                mission.owner.clone()
            }
        };
        let bytes = Shares::bytes_of(append);
        if !self.shares.has_room(&owner, bytes, append.room) {
            return Ok(Appended::ShareUsed);
        }
        self.taken.push(Taken { owner, bytes });
        Ok(Appended::Stored)
    }

    /// Writes the accepted appends.
    fn write(&mut self, link: &Link, locked: &HashMap<u64, Locked>) -> Result<(), StoreError> {
        let stored = self.appends.iter().copied().zip(&self.appended);
        let stored = stored.filter(|(_, appended)| **appended == Appended::Stored);
        if stored
            .clone()
            .any(|(append, _)| append.number.is_none() || append.order.is_some())
        {
            number_in_order(link)?;
        }
        let (mut rows, mut heads) = (Columns::default(), vec![]);
        for (append, _) in stored {
            if let Some(number) = append.number {
                let links = locked[&number].head.extend(append);
                heads.push((append, links.head.clone()));
                rows.change(append, &links);
                rows.add(append, links);
            } else {
                let links = self.create(link, append)?;
                heads.push((append, links.head.clone()));
                rows.add(append, links);
            }
            if let Some(order) = &append.order {
                keep_order(link, &append.mission, order)?;
            }
        }
        rows.write(link, self.now_s, self.service)?;
        self.heads = heads;
        Ok(())
    }

    /// Stores a new mission. Returns the digests.
    fn create(&self, link: &Link, append: &Append) -> Result<Links, StoreError> {
        let given = link.query(NUMBER, &[])?;
        let links = Head::of_new(given[0].try_get(0)?).extend(append);
        let bytes = signed(Shares::bytes_of(append));
        let over_s = append.is_over().then_some(self.now_s);
        let (id, status, summary) = (&append.mission, &append.status, &append.summary);
        let Head {
            mission,
            sequence,
            digest,
        } = &links.head;
        link.execute(
            CREATE,
            &[
                mission,
                id,
                status,
                summary,
                &creator(append),
                &bytes,
                &over_s,
                sequence,
                digest,
                &links.summary,
            ],
        )?;
        Ok(links)
    }
}

fn creator(append: &Append) -> &str {
    append.order.as_ref().map_or("", |order| &order.caller)
}

/// Call it before the first new mission or order of a transaction.
pub(super) fn number_in_order(link: &Link) -> Result<(), StoreError> {
    link.query(IN_ORDER, &[]).map(drop)
}

pub(super) fn keep_order(link: &Link, mission: &str, order: &AuditEntry) -> Result<(), StoreError> {
    let AuditEntry {
        at_s,
        caller,
        request,
        action,
    } = order;
    link.execute(ORDER, &[at_s, caller, request, &mission, action])
        .map(drop)
}

/// Commits. Without an answer, it is unknown whether everything is stored.
pub(crate) fn end(link: &Link) -> Result<(), StoreError> {
    link.batch("COMMIT").map_err(|error| match error {
        StoreError::Unavailable(_) => StoreError::Unanswered,
        refused => refused,
    })
}
