//! Missions that several services share: this service's part of them, and their hand-over.

use std::{collections::HashSet, future::pending, time::Duration};

use futures_util::stream::{self, StreamExt as _};
use tokio::sync::broadcast;

use super::{actor::Ownership, registry::Missions};
use store::{Lease, Owned, StoreError, StoredEvent, Turn};

use crate::edge::problem::Problem;

/// Longest time between two turns: new owners continue missions within a plan's period.
const TURN_MAX: Duration = Duration::from_millis(250);

/// Missions that are continued at the same time: each reads the store.
const STARTED_AT_ONCE: usize = 8;

/// Longest wait for actors to end: each finishes its plan.
const END_TIME: Duration = Duration::from_secs(1);

impl Missions {
    /// Continues running missions without an owner, up to this service's share, until it stops.
    pub(super) async fn keep_share(self, lease: Lease) {
        let mut incarnation = None;
        // Damaged missions: their clients get the error.
        let mut failed = HashSet::new();
        while self.is_open() {
            if let Ok(now) = lease.incarnation() {
                if incarnation.replace(now) != Some(now) {
                    failed.clear();
                    self.forget_before(now);
                }
                let (asked, most) = (lease.clone(), self.n_startable());
                match self.own(move || asked.take_turn(most)).await {
                    Ok(turn) => self.take(turn, now, &mut failed).await,
                    Err(problem) => tracing::debug!(?problem, "no turn was taken"),
                }
            }
            self.clock().sleep(lease.turn_time().min(TURN_MAX)).await;
        }
    }

    async fn take(&self, turn: Turn, incarnation: u64, failed: &mut HashSet<String>) {
        let Turn { taken, running } = turn;
        let taken = stream::iter(taken).map(|Owned { mission, epoch }| async move {
            let id = mission.id.clone();
            let _start = self.start_of(&id).lock().await;
            let started = self.start_actor(mission, Ownership { epoch, incarnation }).await;
            (id, started.map(drop))
        });
        let mut started: Vec<(String, Result<(), Problem>)> =
            taken.buffer_unordered(STARTED_AT_ONCE).collect().await;
        let n_taken = started.iter().filter(|(_, started)| started.is_ok()).count();
        // Actors end when it is unknown if their last event is stored.
        let ended = running.into_iter();
        let ended = ended.filter(|id| !failed.contains(id) && matches!(self.active(id), Ok(None)));
        let again = stream::iter(ended).map(|id| async move {
            let started = self.handle(&id).await;
            (id, started.map(drop))
        });
        let again: Vec<_> = again.buffer_unordered(STARTED_AT_ONCE).collect().await;
        started.extend(again);
        for (id, started) in started {
            match started {
                Ok(()) => {}
                Err(problem @ Problem::Log(StoreError::Damaged(_))) => {
                    tracing::error!(mission = id, ?problem, "the mission does not continue");
                    failed.insert(id);
                }
                // The next turn tries again.
                Err(problem) => tracing::debug!(mission = id, ?problem, "the mission does not continue yet"),
            }
        }
        if 0 < n_taken {
            tracing::info!(n_taken, "missions without an owner continue here");
        }
    }

    /// Starts the mission `id` if no service has it. Fails if another one has it.
    pub(crate) async fn owner(&self, id: &str) -> Result<(), Problem> {
        self.handle(id).await.map(drop)
    }

    /// Waits until this service may have lost the missions of that incarnation: their streams end.
    pub(super) async fn lost(&self, incarnation: u64) -> Problem {
        let Some(lease) = self.store.lease() else {
            return pending().await;
        };
        loop {
            self.clock().sleep(lease.turn_time()).await;
            match lease.incarnation() {
                Ok(now) if now == incarnation => {}
                Ok(_) => return Problem::Behind,
                Err(error) => return error.into(),
            }
        }
    }

    /// `true` for this service's URL, to which no call is forwarded, even if it is not unique.
    pub(crate) fn is_own(&self, url: &str) -> bool {
        self.store.lease().is_some_and(|lease| lease.url() == url)
    }

    /// Ends every actor and every stream, and frees the missions for the other services. Without
    /// others, the next start continues from the stored events.
    pub async fn stop(&self) {
        let ended = self.end_actors();
        let Some(lease) = self.store.lease().cloned() else {
            return;
        };
        let has_ended = |events: &broadcast::WeakSender<StoredEvent>| events.upgrade().is_none();
        let end = self.clock().now() + END_TIME;
        while self.clock().now() < end && !ended.iter().all(has_ended) {
            self.clock().sleep(Duration::from_millis(5)).await;
        }
        if let Err(problem) = self.own(move || lease.leave()).await {
            tracing::warn!(?problem, "the missions were not handed over: their lease ends by itself");
        }
    }
}
