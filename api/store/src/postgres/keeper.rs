//! Renews a service's lease, and ends the leases of services that are gone.

use std::collections::HashMap;
use std::sync::Weak;
use std::time::Duration;

use clock::Clock;
use parking_lot::{Mutex, MutexGuard};

use super::super::error::StoreError;
use super::super::ownership::{BEATS, Member};
use super::link::{Database, Link};

/// The facts that a service's lease and its keeper share.
#[derive(Debug)]
pub(super) struct Membership {
    pub(super) clock: Clock,
    pub(super) database: Database,
    pub(super) member: Member,
    pub(super) id: String,
    pub(super) state: Mutex<State>,
    /// Held by a beat and by leaving, so that no beat follows.
    pub(super) beating: Mutex<()>,
}

#[derive(Debug, Default)]
pub(super) struct State {
    /// End of the lease, by [`Clock::up`]; none after the service has left.
    pub(super) until: Option<Duration>,
    /// Count that rises after a loss of the missions.
    pub(super) incarnation: u64,
}

impl Membership {
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }
}

/// Renews the lease on its own thread and connection.
pub(super) struct Keeper {
    link: Option<Link>,
    beats: i64,
    /// The last beat of each other service, and the time at which it was first seen.
    seen: HashMap<String, (i64, Duration)>,
    /// Time of the database's last answer.
    answered: Duration,
}

impl Keeper {
    /// Takes a connection for the first beat.
    pub(super) fn new(link: Link) -> Self {
        Self { link: Some(link), beats: 0, seen: HashMap::new(), answered: Duration::ZERO }
    }

    /// Runs until the service leaves or its store is dropped.
    pub(super) async fn run(mut self, shared: Weak<Membership>, clock: Clock) {
        let mut fails = false;
        // The first connection waits longer than a lease.
        self.link = None;
        while let Some(shared) = shared.upgrade() {
            let beat = {
                let _beating = shared.beating.lock();
                if shared.state().until.is_none() {
                    return;
                }
                self.beat(&shared)
            };
            match beat {
                Ok(()) if fails => tracing::info!("the lease is renewed again"),
                Ok(()) => {}
                Err(error) => {
                    self.link = None;
                    if !fails {
                        tracing::warn!(%error, "the lease cannot be renewed");
                    }
                    fails = true;
                }
            }
            fails &= self.link.is_none();
            let pause = shared.member.lease / BEATS;
            drop(shared);
            clock.sleep(pause).await;
        }
    }

    /// Raises this service's beat, and ends services whose beats have stopped.
    pub(super) fn beat(&mut self, shared: &Membership) -> Result<(), StoreError> {
        const BEAT: &str = "UPDATE services SET beat = ?2 WHERE id = ?1";
        const JOIN: &str = "INSERT INTO services (id, url, lease_ms, beat) VALUES (?1, ?2, ?3, ?4)";
        let (id, Member { url, lease }) = (&shared.id, &shared.member);
        let link = if let Some(link) = self.link.take() {
            link
        } else {
            // After this time without an answer, a new connection is better.
            let link = shared.database.connect_for(*lease / 2)?;
            // A lost service may hold locks on its missions: these beats must not wait for them.
            link.batch(&format!("SET lock_timeout = {}", (*lease / 4).as_millis()))?;
            link
        };
        let link = self.link.insert(link);
        self.beats += 1;
        let sent = shared.clock.up();
        let is_new = link.execute(BEAT, &[id, &self.beats])? == 0;
        if is_new {
            let lease_ms = i64::try_from(lease.as_millis()).unwrap_or(i64::MAX);
            link.execute(JOIN, &[id, url, &lease_ms, &self.beats])?;
        }
        {
            let mut state = shared.state();
            if is_new {
                state.incarnation += 1;
            }
            // The service may just have left.
            if state.until.is_some() || self.beats == 1 {
                state.until = Some(sent + *lease);
            }
        }
        self.watch(shared)
    }

    fn watch(&mut self, shared: &Membership) -> Result<(), StoreError> {
        const OTHERS: &str = "SELECT id, beat, lease_ms FROM services WHERE id <> ?1";
        const END: &str = "DELETE FROM services WHERE id = ?1 AND beat = ?2";
        let Some(link) = &self.link else { return Ok(()) };
        let lease = shared.member.lease;
        let others = link.query(OTHERS, &[&shared.id])?;
        let now = shared.clock.up();
        // The pause of an eighth plus a slow beat takes less.
        if self.answered + lease * 3 / 4 < now {
            // The others may also have been cut off: they get a whole lease from now.
            self.seen.clear();
        }
        let (mut seen, mut may_wait) = (HashMap::new(), true);
        for row in &others {
            let (id, beat, lease_ms): (String, i64, i64) =
                (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
            // The other service counts by its own lease.
            let lease = lease.max(Duration::from_millis(lease_ms.unsigned_abs()));
            let since = match self.seen.get(&id) {
                Some(&(before, since)) if before == beat => since,
                _ => now,
            };
            if may_wait && since + lease <= now {
                match link.execute(END, &[&id, &beat]) {
                    Ok(0) => {}
                    Ok(_) => {
                        tracing::warn!(service = id, "a service is gone; its missions are free");
                        continue;
                    }
                    // Retried at the next beat. Each beat waits for at most one lock.
                    Err(StoreError::Busy) => may_wait = false,
                    Err(error) => return Err(error),
                }
            }
            seen.insert(id, (beat, since));
        }
        self.seen = seen;
        self.answered = shared.clock.up();
        Ok(())
    }
}
