//! Appends of different missions in one transaction.

use std::collections::HashMap;

use super::super::digest::{Head, Links};
use super::super::entry::{Append, Appended};
use super::super::error::StoreError;
use super::super::known::Known;
use super::super::locked::{Locked, decide};
use super::super::rows::{Param, Rows as _};
use super::super::shares::{Shares, Taken};
use super::super::sql::{signed, without_nul};
use super::columns::write;
use super::link::Link;

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

/// A mission, its epoch, and the service that owns it.
type WithOwner = (Locked, u64, Option<String>);

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
        Self { appends, service, shares, known, now_s, appended: vec![], taken: vec![], heads: vec![] }
    }

    /// Stores the accepted appends in a transaction that the caller ends.
    pub(super) fn prepare(&mut self, link: &Link) -> Result<(), StoreError> {
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

    fn lock(&self, link: &Link) -> Result<HashMap<u64, WithOwner>, StoreError> {
        let numbers = self.appends.iter().filter_map(|append| append.number.map(signed));
        let numbers: Vec<i64> = numbers.collect();
        if numbers.is_empty() {
            return Ok(HashMap::new());
        }
        let columns = Locked::COLUMNS;
        // In order of their numbers, so that two services wait but do not deadlock.
        let lock = format!(
            "SELECT {columns}, epoch, owner_service FROM missions
            WHERE number = ANY(?1) AND status <> 'deleted' ORDER BY number FOR UPDATE"
        );
        let rows = link.query(&lock, &[&numbers])?;
        let locked = rows.iter().map(|row| {
            let mission = Locked::read(row)?;
            let (epoch, service): (i64, _) = (row.try_get(5)?, row.try_get(6)?);
            let number = mission.head.mission.unsigned_abs();
            Ok((number, (mission, epoch.unsigned_abs(), service)))
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
            let (request, answer) = (row.try_get(1)?, row.try_get(2)?);
            let asked = self.appends[place].answered.as_ref();
            let repeated = asked.map_or(Appended::KeyTaken, |asked| asked.repeated(request, answer));
            Ok((place, repeated))
        });
        found.collect()
    }

    /// Decides about an append: stored, or the reason against it.
    fn decide(&mut self, append: &Append, locked: &HashMap<u64, WithOwner>) -> Result<Appended, StoreError> {
        let mission = append.number.and_then(|number| locked.get(&number));
        if let Some((_, epoch, service)) = mission
            && (*epoch != append.epoch || service.as_deref() != self.service)
        {
            return Ok(Appended::NotOwner);
        }
        let mission = mission.map(|(mission, ..)| mission);
        Ok(match decide(append, mission, self.shares, self.known)? {
            Ok(taken) => {
                self.taken.push(taken);
                Appended::Stored
            }
            Err(refused) => refused,
        })
    }

    fn write(&mut self, link: &Link, locked: &HashMap<u64, WithOwner>) -> Result<(), StoreError> {
        let accepted = self.appends.iter().copied().zip(&self.appended);
        let accepted = accepted.filter(|(_, appended)| **appended == Appended::Stored);
        let accepted: Vec<&Append> = accepted.map(|(append, _)| append).collect();
        let is_numbered = |append: &&Append| append.number.is_none() || append.order.is_some();
        if accepted.iter().any(is_numbered) {
            number_in_order(link)?;
        }
        let mut stored = vec![];
        for append in accepted {
            let links = match append.number {
                Some(number) => locked[&number].0.head.extend(append),
                None => self.create(link, append)?,
            };
            stored.push((append, links));
            if let Some(order) = &append.order {
                link.rows().keep_order(&append.mission, order)?;
            }
        }
        write(link, &stored, self.now_s, self.service)?;
        let heads = stored.into_iter().map(|(append, links)| (append, links.head));
        self.heads = heads.collect();
        Ok(())
    }

    /// Stores a new mission. Returns the digests.
    fn create(&self, link: &Link, append: &Append) -> Result<Links, StoreError> {
        let given = link.query(NUMBER, &[])?;
        let links = Head::of_new(given[0].try_get(0)?).extend(append);
        let bytes = signed(Shares::bytes_of(append));
        let over_s = append.is_over().then_some(self.now_s);
        let (id, status, summary) = (&append.mission, &append.status, &append.summary);
        let head = &links.head;
        let (owner, whole) = (&append.creator(), &links.summary);
        let (mission, sequence, digest) = (&head.mission, &head.sequence, &head.digest);
        let params: [&dyn Param; 10] =
            [mission, id, status, summary, owner, &bytes, &over_s, sequence, digest, whole];
        link.change(CREATE, &params)?;
        Ok(links)
    }
}

/// Call it before the first new mission or order of a transaction.
pub(super) fn number_in_order(link: &Link) -> Result<(), StoreError> {
    link.query(IN_ORDER, &[]).map(drop)
}

/// Commits. Without an answer, it is unknown whether everything is stored; any other error stores
/// nothing.
pub(crate) fn end(link: &Link) -> Result<(), StoreError> {
    link.batch("COMMIT").map_err(|error| match error {
        StoreError::Unavailable(_) => StoreError::Unanswered,
        refused => refused,
    })
}
