//! What a service's lease and its keeper know.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use clock::Clock;

use super::{super::ownership::Member, link::Database};

/// What the lease of a service and its keeper share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) clock: Clock,
    pub(super) database: Database,
    pub(super) member: Member,
    /// This process.
    pub(super) id: String,
    pub(super) state: Mutex<State>,
    /// Held by a beat and by the leave, so that none follows the other.
    pub(super) beating: Mutex<()>,
}

/// How long the service owns its missions.
#[derive(Debug, Default)]
pub(super) struct State {
    /// When the lease ends, by [`Clock::up`]; none after the service has left.
    pub(super) until: Option<Duration>,
    /// Rises when the service had lost its missions.
    pub(super) incarnation: u64,
}

impl Shared {
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
