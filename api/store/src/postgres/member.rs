//! A service that takes part, and how long its lease lasts.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use clock::Clock;

use super::link::Database;

/// Beats in a lease: a service is replaced at most two eighths of a lease after its lease has ended.
pub(super) const BEATS: u32 = 8;

/// How a service takes part.
#[derive(Clone, Debug)]
pub struct Member {
    /// Where the other services reach it.
    pub url: String,
    /// How long it owns its missions without an answer of the database.
    pub lease: Duration,
}

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
