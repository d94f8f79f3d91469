//! An underwater vehicle: its name, its state or reports, its path and its dive.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::evidence::{AuvState, Report};
use crate::facts::known_path::DeclaredPath;

/// Name of a vehicle, chosen by the client and unique within a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
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
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Auv {
    /// Name, unique in the request, 1 to 64 bytes.
    #[schema(value_type = String, example = "auv-1")]
    pub id: VehicleId,
    /// Last known state. Exactly one of `state` and `reports` is given.
    pub state: Option<AuvState>,
    /// Recent reports, 1 to 64 in any order; the planner filters them. Excludes `state`.
    pub reports: Option<Vec<Report>>,
    /// Path that the vehicle follows, if known.
    pub path: Option<DeclaredPath>,
    /// Sawtooth in which the vehicle dives, if known. Without it, its depth is assumed constant.
    pub dive: Option<Dive>,
}

impl Auv {
    /// An AUV in `state`, with unknown path and dive.
    pub fn new(id: impl Into<VehicleId>, state: AuvState) -> Self {
        Self { id: id.into(), state: Some(state), reports: None, path: None, dive: None }
    }

    /// An AUV with `reports`, and unknown path and dive.
    pub fn reported(id: impl Into<VehicleId>, reports: Vec<Report>) -> Self {
        Self { id: id.into(), state: None, reports: Some(reports), path: None, dive: None }
    }
}

/// A sawtooth dive: down to the largest depth, up to the least, and again.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Dive {
    /// Depth at which a climb ends, m, positive down, from 0.
    pub depth_min_m: f64,
    /// Depth at which a dive ends, m, at least 0.5 below `depth_min_m`.
    pub depth_max_m: f64,
    /// Pitch of both legs, rad, positive. With the horizontal speed through the water it gives the
    /// speed along the body, which is constant through reversals.
    #[doc(alias = "theta")]
    #[schema(example = 0.873)]
    pub pitch_rad: f64,
    /// Duration of a reversal, s: from passing the depth that ends a leg to passing it again.
    /// Default: 3.6.
    pub reversal_s: Option<f64>,
    /// `true` if the vehicle was descending, nose down, at the time of its `state`. If unknown, its
    /// depth is forecast as the mean of both cases.
    pub descending: Option<bool>,
}

impl Dive {
    /// Duration of a MEDUSA-class vehicle's reversal between 50° down and 50° up, s. Source: the
    /// simulated pitch loop, 3.4 s from 23 m back to it and 3.5 s from 1 m; the legs, 22 m each at
    /// 0.3 m/s along the body, are 191.5 s of a cycle of 198.6 s.
    pub const REVERSAL_MEDUSA: f64 = 3.6;

    /// Duration of a reversal, s.
    pub fn reversal(&self) -> f64 {
        self.reversal_s.unwrap_or(Self::REVERSAL_MEDUSA)
    }
}
