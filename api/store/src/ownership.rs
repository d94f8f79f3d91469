//! Missions of several services that share a store: who takes part, and who owns which.

use std::time::Duration;

use super::entry::StoredMission;

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

/// Who owns a mission that was asked for.
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
    /// With which this service appends.
    pub epoch: u64,
}

/// What there is to do about running missions.
#[derive(Clone, Debug, Default)]
pub struct Turn {
    /// Missions that had no owner, and are this service's now.
    pub taken: Vec<Owned>,
    /// All other running missions of this service.
    pub running: Vec<String>,
}

/// What happens to the connections of a process, for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// No connection is made, and none answers.
    Cut,
    /// Each statement of so many finds its connection gone.
    Gone(u32),
    /// Each statement of so many is carried out, and its connection is gone before the answer.
    Unanswered(u32),
    /// Nothing can be inserted.
    Full,
    /// The lease cannot be renewed, and everything else can be done.
    NoBeat,
}
