//! Ownership of missions by leases.
//!
//! A service has a row in `services`, and raises its `beat` again and again. Its lease counts from
//! before a beat was sent; after its end the service does not answer as an owner. A service that
//! sees the beat of another unchanged for a whole lease deletes that row, which frees the missions.
//! Each service measures by the running time of its own machine; clocks play no part.

use std::sync::Arc;
use std::time::Duration;

use clock::Clock;
use parking_lot::Mutex;

use super::super::error::StoreError;
use super::super::ownership::{Acquired, BEATS, Member, Owned, Turn};
use super::super::rows::{MISSION, stored_mission};
use super::super::sql::{new_id, without_nul};
use super::keeper::{Keeper, Membership};
use super::link::{Database, PATIENCE};

/// Most free missions taken at once, so that several services get some.
const TAKEN_MAX: i64 = 128;

/// The lease of this service. Clones share it.
#[derive(Clone, Debug)]
pub struct Lease(Arc<Membership>);

impl Lease {
    /// Registers the service, and starts to renew its lease.
    pub(crate) fn join(database: Database, member: Member, clock: &Clock) -> Result<Self, StoreError> {
        let link = database.connect_for(member.lease.max(PATIENCE))?;
        let shared = Arc::new(Membership {
            clock: clock.clone(),
            database,
            member,
            id: new_id(),
            state: Mutex::default(),
            beating: Mutex::default(),
        });
        let mut keeper = Keeper::new(link);
        keeper.beat(&shared)?;
        let weak = Arc::downgrade(&shared);
        clock
            .spawn_thread("lease", keeper.run(weak, clock.clone()))
            .map_err(|error| StoreError::open(shared.database.name().as_ref(), &error))?;
        Ok(Self(shared))
    }

    pub(crate) fn id(&self) -> &str {
        &self.0.id
    }

    /// Count that rises after a loss of the missions. Fails while the lease has lapsed.
    pub fn incarnation(&self) -> Result<u64, StoreError> {
        let state = self.0.state();
        match state.until {
            Some(until) if self.0.clock.up() < until => Ok(state.incarnation),
            Some(_) => Err(StoreError::Lapsed),
            None => Err(StoreError::Closed),
        }
    }

    /// The URL at which other services reach this one.
    pub fn url(&self) -> &str {
        &self.0.member.url
    }

    /// Time between two turns.
    pub fn turn_time(&self) -> Duration {
        self.0.member.lease / BEATS
    }

    /// Takes the mission `id`, unless another service has it.
    pub fn acquire(&self, id: &str) -> Result<Acquired, StoreError> {
        const TAKE: &str = "UPDATE missions SET owner_service = ?1, epoch = epoch + 1 WHERE id = ?2
            AND status <> 'deleted' AND (owner_service IS NULL OR owner_service = ?1)";
        const ASK: &str = "SELECT url FROM missions LEFT JOIN services ON services.id = owner_service
            WHERE missions.id = ?1 AND status <> 'deleted'";
        self.incarnation()?;
        let id = without_nul(id);
        self.0.database.owning()?.with(|link| {
            // The mission may be freed between the two statements.
            for _ in 0..2 {
                let taken = link.query(&owning(TAKE), &[&self.0.id, &id])?;
                if let Some(row) = taken.first() {
                    return Ok(Acquired::Here(owned(row)?));
                }
                let asked = link.query(ASK, &[&id])?;
                let Some(row) = asked.first() else {
                    return Ok(Acquired::NoMission);
                };
                if let Some(url) = row.try_get(0)? {
                    return Ok(Acquired::At(url));
                }
            }
            Err(StoreError::Busy)
        })
    }

    /// Takes running missions without an owner, up to this service's share and to `most`.
    pub fn take_turn(&self, most: usize) -> Result<Turn, StoreError> {
        const COUNT: &str =
            "SELECT count(*), count(*) FILTER (WHERE owner_service IS NULL), (SELECT count(*) FROM services)
            FROM missions WHERE status = 'running'";
        const OWN: &str = "SELECT id FROM missions WHERE status = 'running' AND owner_service = ?1";
        const TAKE: &str = "UPDATE missions SET owner_service = ?1, epoch = epoch + 1 WHERE number IN
            (SELECT number FROM missions WHERE status = 'running' AND owner_service IS NULL
             ORDER BY number LIMIT ?2 FOR UPDATE SKIP LOCKED)";
        self.incarnation()?;
        self.0.database.owning()?.with(|link| {
            let counts = link.query(COUNT, &[])?;
            let count = |column| counts[0].try_get::<_, i64>(column);
            let (n_running, n_free, n_services) = (count(0)?, count(1)?, count(2)?.max(1));
            let own = link.query(OWN, &[&self.0.id])?;
            let running = own.iter().map(|row| row.try_get(0));
            let running: Vec<String> = running.collect::<Result<_, _>>()?;
            let n_own = i64::try_from(running.len()).unwrap_or(i64::MAX);
            let share = (n_running + n_services - 1) / n_services;
            let most = i64::try_from(most).unwrap_or(i64::MAX);
            let most = most.min(share - n_own).min(n_free).min(TAKEN_MAX);
            let mut taken = vec![];
            if 0 < most {
                let rows = link.query(&owning(TAKE), &[&self.0.id, &most])?;
                taken = rows.iter().map(owned).collect::<Result<_, _>>()?;
            }
            Ok(Turn { taken, running })
        })
    }

    /// Frees all missions, and owns none from then on.
    pub fn leave(&self) -> Result<(), StoreError> {
        const LEAVE: &str = "DELETE FROM services WHERE id = ?1";
        self.0.state().until = None;
        let _no_beat = self.0.beating.lock();
        let database = self.0.database.owning()?;
        database.with(|link| link.execute(LEAVE, &[&self.0.id])).map(drop)
    }
}

/// The statement that takes missions, and returns the columns of [`owned`].
fn owning(take: &str) -> String {
    format!("{take} RETURNING {MISSION}, epoch")
}

fn owned(row: &tokio_postgres::Row) -> Result<Owned, StoreError> {
    let epoch: i64 = row.try_get("epoch")?;
    Ok(Owned { mission: stored_mission(row)?, epoch: epoch.unsigned_abs() })
}
