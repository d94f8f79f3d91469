//! The facts that a service's lease and its keeper share.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use clock::Clock;

use super::{super::ownership::Member, link::Database};

#[derive(Debug)]
pub(super) struct Shared {
    pub(super) clock: Clock,
    pub(super) database: Database,
    pub(super) member: Member,
    /// Id of this process.
    pub(super) id: String,
    pub(super) state: Mutex<State>,
    /// Held by a beat and by leaving, so that no beat follows.
    pub(super) beating: Mutex<()>,
}

/// The lease's end and count.
#[derive(Debug, Default)]
pub(super) struct State {
    /// End of the lease, by [`Clock::up`]; none after the service has left.
    pub(super) until: Option<Duration>,
    /// Count that rises after a loss of the missions.
    pub(super) incarnation: u64,
}

impl Shared {
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
