//! An underwater vehicle: its name, its evidence, its path, its dive.

use std::fmt;

use crate::facts::{
    evidence::{AuvState, Evidence},
    known_path::KnownPath,
};

/// The name a client gave to a vehicle; unique within a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VehicleId(pub String);

impl From<&str> for VehicleId {
    fn from(name: &str) -> Self {
        Self(name.to_owned())
    }
}

impl fmt::Display for VehicleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// An underwater vehicle as last heard of.
#[derive(Clone, Debug, PartialEq)]
pub struct Auv {
    /// Its name.
    pub id: VehicleId,
    /// What is known of where it is.
    pub evidence: Evidence,
    /// The path that it follows, where that is known.
    pub path: Option<KnownPath>,
    /// The sawtooth in which it dives, where that is known.
    pub dive: Option<Dive>,
}

impl Auv {
    /// An AUV in `state`, of which neither path nor dive is known.
    #[must_use]
    pub fn new(id: impl Into<VehicleId>, state: AuvState) -> Self {
        Self {
            id: id.into(),
            evidence: Evidence::State(state),
            path: None,
            dive: None,
        }
    }
}

/// A sawtooth in which an AUV is known to dive: down until deep enough, up until shallow enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dive {
    /// Depth at which a climb ends, m, positive down, never negative.
    pub depth_min: f64,
    /// Depth at which a dive ends, m, at least half a metre below `depth_min`.
    pub depth_max: f64,
    /// Pitch of both legs θ, rad, positive, from 0.05 to 1.4.
    #[doc(alias = "theta")]
    pub pitch: f64,
    /// Time that a reversal takes, s: from passing the depth that ends a leg until passing it again.
    pub reversal: f64,
    /// Whether its nose was down and it got deeper at the time of the report, where that is known.
    pub descending: Option<bool>,
}

impl Dive {
    /// Time that a MEDUSA-class vehicle takes to reverse from 50° down to 50° up, or back, s.
    ///
    /// Source: the simulated pitch loop. From 23 m on it takes 3.4 s to be back, from 1 m on 3.5 s, and a cycle
    /// lasts 198.6 s, of which the legs, 22 m each at 0.3 m/s along the body, are 191.5 s.
    pub const REVERSAL_MEDUSA: f64 = 3.6;
}
