//! A service that takes part, and how long its lease lasts.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use rustix::time::clock_gettime;

use super::{super::trusted_time::RUNNING, link::Database};

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
    /// When the lease ends, by [`running_time`]; none after the service has left.
    pub(super) until: Option<Duration>,
    /// Rises when the service had lost its missions.
    pub(super) incarnation: u64,
}

impl Shared {
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The kernel's time since boot, which no setting of a clock changes and which counts a machine's sleep.
pub(super) fn running_time() -> Duration {
    let now = clock_gettime(RUNNING);
    Duration::new(now.tv_sec.unsigned_abs(), u32::try_from(now.tv_nsec).unwrap_or(0))
}
