//! Members of a shared store, and their missions.

use std::time::Duration;

use super::entry::StoredMission;

/// Beats in a lease: a service is replaced at most two eighths of a lease after its lease's end.
pub(super) const BEATS: u32 = 8;

/// A service that shares the store.
#[derive(Clone, Debug)]
pub struct Member {
    /// The URL at which other services reach it.
    pub url: String,
    /// Time for which it owns its missions without an answer of the database.
    pub lease: Duration,
}

/// The owner of a mission.
#[derive(Clone, Debug)]
pub enum Acquired {
    /// This service, from now on.
    Here(Owned),
    /// The service at this URL.
    At(String),
    /// There is no such mission.
    NoMission,
}

/// A mission that this service owns.
#[derive(Clone, Debug)]
pub struct Owned {
    /// The mission after the last event of earlier owners.
    pub mission: StoredMission,
    /// Epoch of this service's appends.
    pub epoch: u64,
}

/// Running missions of a service.
#[derive(Clone, Debug, Default)]
pub struct Turn {
    /// Missions without an owner that this service has just taken.
    pub taken: Vec<Owned>,
    /// All other running missions of this service.
    pub running: Vec<String>,
}

/// A fault of all connections of a process, for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// No connection can be made, and none answers.
    Cut,
    /// Every n-th statement fails: its connection is gone.
    Gone(u32),
    /// Every n-th statement is carried out, but has no answer.
    Unanswered(u32),
    /// Nothing can be inserted.
    Full,
    /// The lease cannot be renewed; everything else works.
    NoBeat,
}
