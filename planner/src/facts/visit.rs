//! Goals that visit AUVs one after the other.

use std::{collections::BTreeMap, ops::RangeInclusive};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::{
    auv::VehicleId,
    ranges::{GOAL_VISIT, MapNumber, Range, TIME, VISIT_COST, VISIT_DATA, VISIT_UNCERTAINTY, WEIGHT},
    tagged::{read_tagged, tagged},
};

/// Default horizontal distance within which an AUV is served, m. Assumption: a modem's is more.
const WITHIN: f64 = 20.0;

/// The same where ranges fix it, m: a range from afar tells more, and a circle of this size is the
/// best about an AUV at the depth of a survey (docs/ranging.md).
const WITHIN_FOR_RANGES: f64 = 40.0;

/// Default time with an AUV for fixes or data, s: three slots of a network with a period of 10 s.
const DWELL_MIN: f64 = 30.0;

/// The same for ranges, s: half a circle at the usual speed. Less fixes one axis only.
const DWELL_MIN_FOR_RANGES: f64 = 90.0;

/// Share of the largest distance at which ranges are taken, so that the craft stays within it.
const ARC_SHARE: f64 = 0.8;

/// Default standard deviation of an acoustic fix at no distance, m.
const SIGMA: f64 = 1.5;

/// Default growth of the standard deviation with the slant range, rad: an array's bearing of 1°.
const SIGMA_BEARING: f64 = 0.02;

/// Default time between two fixes, s.
const INTERVAL: f64 = 10.0;

/// Vehicles that the surface craft visits; the planner chooses the order and the times.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields, bound(deserialize = "N: Deserialize<'de> + From<f64>"))]
#[schemars(bound = "N: JsonSchema + From<f64>")]
pub struct Visits<N = f64> {
    /// The vehicles to serve, in any order.
    #[schema(value_type = Vec<String>)]
    pub auvs: Vec<VehicleId>,
    /// Cost of an unserved vehicle; its age if left out.
    #[serde(default = "age::<N>")]
    #[schema(value_type = Option<VisitCost>)]
    pub cost: VisitCost<N>,
    /// Relative weight of each vehicle's cost; 1 if left out. 0 excludes a vehicle.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-1": 2.0 }))]
    pub weights: BTreeMap<VehicleId, N>,
    /// Largest horizontal distance of service, m; 20 if left out, 40 for ranges.
    #[schema(value_type = Option<f64>)]
    pub within_m: Option<N>,
    /// Least time with a vehicle, s; 0 for `age`, else 30 if left out, 90 for ranges.
    #[schema(value_type = Option<f64>)]
    pub dwell_min_s: Option<N>,
    /// Deadlines of service by name, s on the craft's clock; none if left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 1800.0 }))]
    pub serve_by_s: BTreeMap<VehicleId, N>,
    /// The mean of the costs counts, or the largest; `mean` if left out.
    #[serde(default)]
    #[schema(value_type = Option<Reduce>)]
    pub reduce: Reduce,
    /// Known present costs, by name, in the unit of the cost, for example from a modem that counts
    /// uploaded data; those in `previous_plan`, advanced to now, else of vehicles just served if
    /// left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 340.0 }))]
    pub costs_now: BTreeMap<VehicleId, N>,
    /// The vehicle to visit next, until `previous_plan` says that its visit is over; that of least
    /// cost if left out.
    #[schema(value_type = Option<String>)]
    pub next: Option<VehicleId>,
}

impl<N> Visits<N> {
    pub(crate) fn map<M>(&self, number: MapNumber<'_, N, M>) -> Option<Visits<M>> {
        let [within, dwell_min] = &GOAL_VISIT;
        Some(Visits {
            auvs: self.auvs.clone(),
            weights: map_each("visit.weights", &WEIGHT, &self.weights, number)?,
            serve_by_s: map_each("visit.serve_by_s", &TIME, &self.serve_by_s, number)?,
            costs_now: map_each("visit.costs_now", &VISIT_COST, &self.costs_now, number)?,
            cost: self.cost.map(number)?,
            within_m: number("visit.within_m", &within.1, self.within_m.as_ref()),
            dwell_min_s: number("visit.dwell_min_s", &dwell_min.1, self.dwell_min_s.as_ref()),
            reduce: self.reduce,
            next: self.next.clone(),
        })
    }
}

/// Maps the numbers of vehicles.
pub(crate) fn map_each<N, M>(
    place: &str,
    range: &RangeInclusive<f64>,
    numbers: &BTreeMap<VehicleId, N>,
    number: MapNumber<'_, N, M>,
) -> Option<BTreeMap<VehicleId, M>> {
    let each = numbers
        .iter()
        .map(|(id, given)| Some((id.clone(), number(&format!("{place}.{id}"), range, Some(given))?)));
    each.collect()
}

impl Visits {
    /// These AUVs by the time since they were served, with all defaults.
    pub fn new(auvs: Vec<VehicleId>) -> Self {
        Self {
            auvs,
            cost: VisitCost::Age,
            weights: BTreeMap::new(),
            within_m: Some(WITHIN),
            dwell_min_s: Some(VisitCost::Age.dwell_min()),
            serve_by_s: BTreeMap::new(),
            reduce: Reduce::Mean,
            costs_now: BTreeMap::new(),
            next: None,
        }
    }

    /// Largest horizontal distance of service, m.
    pub fn within(&self) -> f64 {
        self.within_m.unwrap_or(if self.cost.takes_ranges() { WITHIN_FOR_RANGES } else { WITHIN })
    }

    /// Usual horizontal distance of service, m: 0 for what is best right above.
    pub fn arc(&self) -> f64 {
        if self.cost.takes_ranges() { ARC_SHARE * self.within() } else { 0.0 }
    }

    /// Least time with an AUV, s.
    pub fn dwell_min(&self) -> f64 {
        self.dwell_min_s.unwrap_or(self.cost.dwell_min())
    }

    /// Fills in what depends on the cost.
    pub fn fill_defaults(&mut self) {
        (self.within_m, self.dwell_min_s) = (Some(self.within()), Some(self.dwell_min()));
    }

    /// Weight of the cost of `id`.
    pub fn weight(&self, id: &VehicleId) -> f64 {
        self.weights.get(id).copied().unwrap_or(1.0)
    }
}

tagged! {
    /// Cost of an unserved vehicle. `kind` determines the other members.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum VisitCost<N> = "VisitCost", VisitCostOutside, "kind" {
        /// Time since it was last served, s.
        Age,
        /// Variance of its own navigation, m²; measurements between it and the craft reduce it.
        Uncertainty {
            /// The measurements; `usbl` if left out. With ranges, a visit is an arc.
            #[serde(default = "usbl")]
            #[schema(value_type = Option<Fixes>)]
            fixes: Fixes,
            /// Growth of the variance without aid, m²/s.
            #[schema(value_type = f64)]
            growth_m2ps: N,
            /// Standard deviation of a range, or of a fix at range 0, m; 1.5 if left out.
            #[serde(default = "sigma::<N>")]
            #[schema(value_type = Option<f64>)]
            sigma_m: N,
            /// Growth of a fix's `sigma_m` with the slant range, rad; 0.02 if left out. Not for
            /// ranges.
            #[serde(default = "sigma_bearing::<N>")]
            #[schema(value_type = Option<f64>)]
            sigma_rad: N,
            /// Time between two fixes, s; 10 if left out.
            #[serde(default = "interval::<N>")]
            #[schema(value_type = Option<f64>)]
            interval_s: N,
        },
        /// Data not yet uploaded, kbit.
        Data {
            /// Rate of gathering, kbit/s.
            #[schema(value_type = f64)]
            growth_kbps: N,
            /// Rate of upload at range 0, kbit/s; linear in the slant range.
            #[schema(value_type = f64)]
            upload_kbps: N,
            /// Slant range at which the rate of upload is 0, m.
            #[schema(value_type = f64)]
            range_max_m: N,
        },
    }
}
read_tagged!(VisitCost<N>, VisitCostOutside, "kind");

pub(crate) fn sigma<N: From<f64>>() -> N {
    SIGMA.into()
}

pub(crate) fn sigma_bearing<N: From<f64>>() -> N {
    SIGMA_BEARING.into()
}

pub(crate) fn interval<N: From<f64>>() -> N {
    INTERVAL.into()
}

fn age<N>() -> VisitCost<N> {
    VisitCost::Age
}

fn usbl() -> Fixes {
    Fixes::Usbl
}

/// A measurement between the craft and an underwater vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fixes {
    /// A slant range: nothing across the line of sight, and nothing horizontal from right above.
    #[default]
    Range,
    /// A position, best from right above.
    Usbl,
}

impl<N> VisitCost<N> {
    pub(crate) fn map<M>(&self, number: MapNumber<'_, N, M>) -> Option<VisitCost<M>> {
        let mut of = |kind: &str, (member, range): &Range, given: &N| {
            number(&format!("visit.cost.{kind}.{member}"), range, Some(given))
        };
        Some(match self {
            Self::Age => VisitCost::Age,
            Self::Uncertainty { fixes, growth_m2ps, sigma_m, sigma_rad, interval_s } => {
                VisitCost::Uncertainty {
                    fixes: *fixes,
                    growth_m2ps: of("uncertainty", &VISIT_UNCERTAINTY[0], growth_m2ps)?,
                    sigma_m: of("uncertainty", &VISIT_UNCERTAINTY[1], sigma_m)?,
                    sigma_rad: of("uncertainty", &VISIT_UNCERTAINTY[2], sigma_rad)?,
                    interval_s: of("uncertainty", &VISIT_UNCERTAINTY[3], interval_s)?,
                }
            }
            Self::Data { growth_kbps, upload_kbps, range_max_m } => VisitCost::Data {
                growth_kbps: of("data", &VISIT_DATA[0], growth_kbps)?,
                upload_kbps: of("data", &VISIT_DATA[1], upload_kbps)?,
                range_max_m: of("data", &VISIT_DATA[2], range_max_m)?,
            },
        })
    }
}

impl VisitCost {
    /// Default time with an AUV, s: an age is 0 at once.
    pub fn dwell_min(&self) -> f64 {
        match self {
            Self::Age => 0.0,
            Self::Uncertainty { fixes: Fixes::Range, .. } => DWELL_MIN_FOR_RANGES,
            Self::Uncertainty { .. } | Self::Data { .. } => DWELL_MIN,
        }
    }

    /// `true` if ranges reduce it, which a craft right above does not measure.
    pub fn takes_ranges(&self) -> bool {
        matches!(self, Self::Uncertainty { fixes: Fixes::Range, .. })
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
