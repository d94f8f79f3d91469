//! An underwater vehicle: its name, its state or reports, its path, its dive.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    evidence::{AuvState, Report},
    known_path::DeclaredPath,
};

/// The name a client gave to a vehicle; unique within a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
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

/// An underwater vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Auv {
    /// Its name, unique in the request, 1 to 64 bytes.
    #[schema(value_type = String, example = "auv-1")]
    pub id: VehicleId,
    /// Its state as last heard of. Either this or `reports`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<AuvState>,
    /// What was heard of it lately, 1 to 64 reports in any order: the planner filters them. Either this or `state`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reports: Option<Vec<Report>>,
    /// The path that it follows, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<DeclaredPath>,
    /// The sawtooth in which it dives, where that is known. Without it, its depth is taken to stay what it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dive: Option<Dive>,
}

impl Auv {
    /// An AUV in `state`, of which neither path nor dive is known.
    #[must_use]
    pub fn new(id: impl Into<VehicleId>, state: AuvState) -> Self {
        Self {
            id: id.into(),
            state: Some(state),
            reports: None,
            path: None,
            dive: None,
        }
    }

    /// An AUV by its `reports`, of which neither path nor dive is known.
    #[must_use]
    pub fn reported(id: impl Into<VehicleId>, reports: Vec<Report>) -> Self {
        Self {
            id: id.into(),
            state: None,
            reports: Some(reports),
            path: None,
            dive: None,
        }
    }
}

/// A sawtooth in which an underwater vehicle is known to dive: down until deep enough, up until shallow enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Dive {
    /// Depth at which a climb ends, m, positive down, from 0.
    pub depth_min_m: f64,
    /// Depth at which a dive ends, m, at least 0.5 below `depth_min_m`, to 12000.
    pub depth_max_m: f64,
    /// Pitch of both legs, rad, positive, from 0.05 to 1.4. With the horizontal speed through the water it gives
    /// the speed along the body, which stays the same in the reversals.
    #[doc(alias = "theta")]
    #[schema(example = 0.873)]
    pub pitch_rad: f64,
    /// Time that a reversal takes, s, from passing the depth that ends a leg until passing it again, from 0.1 to
    /// 120. Default: 3.6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reversal_s: Option<f64>,
    /// Whether the vehicle was descending, nose down, at the time of its `state`. If this is not known, its depth is
    /// forecast as the mean of both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub descending: Option<bool>,
}

impl Dive {
    /// Time that a MEDUSA-class vehicle takes to reverse from 50° down to 50° up, or back, s.
    ///
    /// Source: the simulated pitch loop. From 23 m on it takes 3.4 s to be back, from 1 m on 3.5 s, and a cycle
    /// lasts 198.6 s, of which the legs, 22 m each at 0.3 m/s along the body, are 191.5 s.
    pub const REVERSAL_MEDUSA: f64 = 3.6;

    /// Time that a reversal takes, s.
    #[must_use]
    pub fn reversal(&self) -> f64 {
        self.reversal_s.unwrap_or(Self::REVERSAL_MEDUSA)
    }
}
