//! Goals that visit AUVs one after the other.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    auv::VehicleId,
    members::{members, needed},
};

/// Default horizontal distance within which an AUV is served, m. Assumption: a craft that
/// accompanies an AUV stays within this; far less than a modem's range.
const WITHIN: f64 = 20.0;

/// Default time with an AUV for fixes or data, s: three slots of a network with a period of 10 s.
const DWELL_MIN: f64 = 30.0;

/// Default standard deviation of an acoustic fix at no distance, m.
const SIGMA: f64 = 1.5;

/// Default growth of the standard deviation with the slant range, rad: an array's bearing of 1°.
const SIGMA_BEARING: f64 = 0.02;

/// Default time between two fixes, s.
const INTERVAL: f64 = 10.0;

/// AUVs that the surface craft visits; the planner chooses the order and the times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Visits {
    /// The AUVs to serve, in any order.
    pub auvs: Vec<VehicleId>,
    /// Cost of an unserved AUV.
    pub cost: VisitCost,
    /// Relative weight of each cost. Default: 1; 0 excludes an AUV.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub weights: BTreeMap<VehicleId, f64>,
    /// Horizontal distance within which an AUV counts as served, m.
    pub within_m: f64,
    /// Least time with an AUV, s.
    pub dwell_min_s: f64,
    /// Deadlines of AUVs, s on the snapshot's clock; unnamed ones have none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub serve_by_s: BTreeMap<VehicleId, f64>,
    /// The statistic of the costs that counts.
    pub reduce: Reduce,
    /// Present costs that are known better than from the previous plan.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub costs_now: BTreeMap<VehicleId, f64>,
    /// The operator's next AUV, until `previous_plan` says that its visit is over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next: Option<VehicleId>,
}

impl Visits {
    /// These AUVs by the time since they were served, with all defaults.
    #[must_use]
    pub fn new(auvs: Vec<VehicleId>) -> Self {
        Self {
            auvs,
            cost: VisitCost::Age,
            weights: BTreeMap::new(),
            within_m: WITHIN,
            dwell_min_s: VisitCost::Age.dwell_min(),
            serve_by_s: BTreeMap::new(),
            reduce: Reduce::Mean,
            costs_now: BTreeMap::new(),
            next: None,
        }
    }

    /// Weight of the cost of `id`.
    #[must_use]
    pub fn weight(&self, id: &VehicleId) -> f64 {
        self.weights.get(id).copied().unwrap_or(1.0)
    }
}

/// Cost of an unserved AUV.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum VisitCost {
    /// Time since it was last served, s.
    Age,
    /// Variance of its own navigation, m²; fixes from the craft reduce it.
    Uncertainty {
        /// Growth of the variance, m²/s.
        growth_m2ps: f64,
        /// Standard deviation of a fix at no distance, m.
        sigma_m: f64,
        /// Growth of the standard deviation with the slant range, rad.
        sigma_rad: f64,
        /// Time between two fixes, s.
        interval_s: f64,
    },
    /// Data gathered and not uploaded, kbit.
    Data {
        /// Rate of gathering, kbit/s.
        growth_kbps: f64,
        /// Rate of upload at no distance, kbit/s; falls linearly with the slant range.
        upload_kbps: f64,
        /// Slant range at which the rate of upload is 0, m.
        range_max_m: f64,
    },
}

impl VisitCost {
    /// Default time with an AUV, s: an age is 0 at once.
    #[must_use]
    pub fn dwell_min(&self) -> f64 {
        match self {
            Self::Age => 0.0,
            Self::Uncertainty { .. } | Self::Data { .. } => DWELL_MIN,
        }
    }
}

/// The statistic of several AUVs' costs that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reduce {
    /// Weighted mean over the planned time.
    #[default]
    Mean,
    /// The largest weighted cost at any time; among equals, the least mean.
    Max,
}

members! {
    /// Cost of an unserved underwater vehicle. `kind` determines the other members.
    CostMembers of VisitCost as "VisitCost",
    /// Kind of cost.
    kind: CostKind,
    /// `uncertainty`: growth of the variance without aid, m²/s, from 10⁻⁶ to 10⁶.
    growth_m2ps: Option<f64>,
    /// `uncertainty`: standard deviation of a fix at range 0, m, from 0.001 to 100,000.
    /// Default: 1.5.
    sigma_m: Option<f64>,
    /// `uncertainty`: growth of `sigma_m` with the slant range, rad, from 0 to 1. Default: 0.02.
    sigma_rad: Option<f64>,
    /// `uncertainty`: time between two fixes, s, from 0.1 to 3600. Default: 10.
    interval_s: Option<f64>,
    /// `data`: rate of gathering, kbit/s, from 0 to 10⁶.
    growth_kbps: Option<f64>,
    /// `data`: upload at range 0, kbit/s, from 0.001 to 10⁶; linear in the slant range.
    upload_kbps: Option<f64>,
    /// `data`: slant range at which the rate of upload is 0, m, from 1 to 20 000.
    range_max_m: Option<f64>,
}

/// Kinds of costs.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum CostKind {
    /// Time since the vehicle was last served, s.
    Age,
    /// Variance of its navigation, m²: `growth_m2ps`, and fixes' `sigma_m`, `sigma_rad`,
    /// `interval_s`.
    Uncertainty,
    /// Data not uploaded, kbit: `growth_kbps`, `upload_kbps`, `range_max_m`.
    Data,
}

impl<'de> Deserialize<'de> for VisitCost {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut given = CostMembers::deserialize(deserializer)?;
        let cost = match given.kind {
            CostKind::Age => Self::Age,
            CostKind::Uncertainty => Self::Uncertainty {
                growth_m2ps: needed(&mut given.growth_m2ps, "growth_m2ps")?,
                sigma_m: given.sigma_m.take().unwrap_or(SIGMA),
                sigma_rad: given.sigma_rad.take().unwrap_or(SIGMA_BEARING),
                interval_s: given.interval_s.take().unwrap_or(INTERVAL),
            },
            CostKind::Data => Self::Data {
                growth_kbps: needed(&mut given.growth_kbps, "growth_kbps")?,
                upload_kbps: needed(&mut given.upload_kbps, "upload_kbps")?,
                range_max_m: needed(&mut given.range_max_m, "range_max_m")?,
            },
        };
        given.none_left()?;
        Ok(cost)
    }
}
