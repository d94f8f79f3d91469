//! A goal that visits AUVs one after the other: which of them, what it costs not to serve one, and what counts.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    auv::VehicleId,
    members::{members, needed},
};

/// Horizontal distance within which an AUV counts as served, m, where none is given.
///
/// Assumption: a craft that accompanies an AUV stays within this; far less than what a modem reaches.
const WITHIN: f64 = 20.0;

/// Least time with an AUV that fixes or data take, s, where none is given: three slots of an acoustic network that hears of each every 10 s.
const DWELL_MIN: f64 = 30.0;

/// Standard deviation of an acoustic fix at no distance, m, where none is given.
const SIGMA: f64 = 1.5;

/// Its growth with the slant range, rad, where none is given: about one degree of an array's bearing.
const SIGMA_BEARING: f64 = 0.02;

/// Time between two fixes, s, where none is given.
const INTERVAL: f64 = 10.0;

/// AUVs that the surface craft visits in an order and at times that the planner chooses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Visits {
    /// The AUVs to serve, in any order.
    pub auvs: Vec<VehicleId>,
    /// What it costs not to serve one.
    pub cost: VisitCost,
    /// How much the cost of each counts, relative to the others; 1 of those that are not named, 0 is not at all.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub weights: BTreeMap<VehicleId, f64>,
    /// Horizontal distance within which an AUV counts as served, m.
    pub within_m: f64,
    /// Least time with an AUV, s.
    pub dwell_min_s: f64,
    /// Until when each must have been served, s on the snapshot's clock; no deadline of those that are not named.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub serve_by_s: BTreeMap<VehicleId, f64>,
    /// Whether the mean of the costs counts or the largest.
    pub reduce: Reduce,
    /// Costs now, where they are known better than by what the previous plan remembers.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub costs_now: BTreeMap<VehicleId, f64>,
    /// The AUV that an operator wants visited next. It counts until that visit is over, by what `previous_plan` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next: Option<VehicleId>,
}

impl Visits {
    /// These AUVs by the time since they were served, everything else as where it is left out.
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

    /// How much the cost of `id` counts.
    #[must_use]
    pub fn weight(&self, id: &VehicleId) -> f64 {
        self.weights.get(id).copied().unwrap_or(1.0)
    }
}

/// What it costs not to serve an AUV.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum VisitCost {
    /// Time since it was last served, s.
    Age,
    /// Variance of its own navigation, m²: it grows unaided, and fixes from the craft reduce it.
    Uncertainty {
        /// Growth of the variance, m²/s.
        growth_m2ps: f64,
        /// Standard deviation of a fix at no distance, m.
        sigma_m: f64,
        /// Growth of that with the slant range, rad.
        sigma_rad: f64,
        /// Time between two fixes, s.
        interval_s: f64,
    },
    /// Data that it has gathered and not uploaded, kbit.
    Data {
        /// What it gathers, kbit/s.
        growth_kbps: f64,
        /// What it uploads at no distance, kbit/s; it falls linearly with the slant range.
        upload_kbps: f64,
        /// Slant range at which nothing is uploaded any more, m.
        range_max_m: f64,
    },
}

impl VisitCost {
    /// Least time with an AUV, s, where none is given: an age is 0 at once.
    #[must_use]
    pub fn dwell_min(&self) -> f64 {
        match self {
            Self::Age => 0.0,
            Self::Uncertainty { .. } | Self::Data { .. } => DWELL_MIN,
        }
    }
}

/// What counts of the costs of several AUVs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reduce {
    /// Their weighted mean, over the time that is planned.
    #[default]
    Mean,
    /// The largest, weighted, at any time; among equals, the least mean.
    Max,
}

members! {
    /// What it costs not to serve an underwater vehicle. Which members are needed depends on `kind`.
    CostMembers of VisitCost as "VisitCost",
    /// Which cost.
    kind: CostKind,
    /// `uncertainty`: growth of the variance without aid, m²/s, from 10⁻⁶ to 10⁶.
    growth_m2ps: Option<f64>,
    /// `uncertainty`: standard deviation of a fix at no distance, m, from 0.001 to 100,000. Default: 1.5.
    sigma_m: Option<f64>,
    /// `uncertainty`: growth of that with the slant range, rad, from 0 to 1. Default: 0.02.
    sigma_rad: Option<f64>,
    /// `uncertainty`: time between two fixes, s, from 0.1 to 3600. Default: 10.
    interval_s: Option<f64>,
    /// `data`: what the vehicle gathers, kbit/s, from 0 to 10⁶.
    growth_kbps: Option<f64>,
    /// `data`: what it uploads at no distance, kbit/s, from 0.001 to 10⁶. It falls linearly with the slant range.
    upload_kbps: Option<f64>,
    /// `data`: slant range at which nothing is uploaded any more, m, from 1 to 20 000.
    range_max_m: Option<f64>,
}

/// The kinds of costs.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum CostKind {
    /// Time since the vehicle was last served, s.
    Age,
    /// Variance of its own navigation, m²: `growth_m2ps`, and `sigma_m`, `sigma_rad`, `interval_s` of the fixes that reduce it.
    Uncertainty,
    /// Data that it has not uploaded, kbit: `growth_kbps`, `upload_kbps`, `range_max_m`.
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
