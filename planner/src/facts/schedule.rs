//! Schedules of visits, in answers and in the requests that return them.

use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::auv::VehicleId;

/// Visits to underwater vehicles, for a goal of the kind `visit`. The next request needs it in
/// `previous_plan`: without it, costs restart and nothing stabilises the schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Schedule {
    /// Unit of every cost.
    pub unit: CostUnit,
    /// The visits in order, at most the first 32; the first may have begun.
    pub visits: Vec<Visit>,
    /// Every vehicle that the goal depends on.
    pub costs: Vec<ServedVehicle>,
    /// Cost of the schedule: the mean or the largest, as the goal asks; without missed deadlines.
    pub cost: f64,
    /// A lower bound on the cost of any schedule: the craft serves one vehicle at a time.
    pub bound: f64,
    /// Upper bound on the avoidable part of the cost: 1 − `bound` / `cost`.
    pub gap: f64,
    /// `true` if all sequences of visits were compared, instead of the most promising ones.
    pub exact: bool,
    /// The other vehicles that could be visited first, by increasing cost.
    pub alternatives: Vec<Alternative>,
    /// Vehicles whose deadline is missed within the planned time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>)]
    pub deadlines_missed: Vec<VehicleId>,
    /// One sentence that explains the schedule to the operator.
    pub sentence: String,
    /// `true` if the next visit is that of the previous schedule.
    pub kept: bool,
    /// The requested `next` vehicle, once its visit is over: the planner chooses again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<String>)]
    pub next_visited: Option<VehicleId>,
}

impl Schedule {
    /// The vehicle of the present visit, or else of the next one.
    pub fn next(&self) -> Option<&VehicleId> {
        self.visits.first().map(|visit| &visit.auv)
    }
}

/// Unit of a cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub enum CostUnit {
    /// Time since a vehicle was served, s.
    #[serde(rename = "s")]
    Seconds,
    /// Variance of a vehicle's navigation, m².
    #[serde(rename = "m2")]
    SquareMetres,
    /// Data not yet uploaded, kbit.
    #[serde(rename = "kbit")]
    Kilobits,
}

/// A visit to an underwater vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Visit {
    /// The vehicle.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// Time at which the craft is near enough to serve it, s on the request's clock.
    pub arrive_s: f64,
    /// Time at which it leaves, s.
    pub leave_s: f64,
    /// The vehicle's position at the craft's arrival, or its present one: north of the datum, m.
    pub north_m: f64,
    /// East of the datum, m.
    pub east_m: f64,
    /// The vehicle's cost when the craft arrives, in `unit`.
    pub cost_before: f64,
    /// Its cost when the craft leaves.
    pub cost_after: f64,
}

/// A vehicle that the goal depends on.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ServedVehicle {
    /// The vehicle.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// Its cost now, in `unit`.
    pub cost: f64,
    /// The deadline by which it was last served, or late, s on the request's clock; absent without
    /// a deadline or before the service.
    pub served_by_s: Option<f64>,
    /// Largest horizontal distance from the craft while its reports arrived, m. Default: 0.
    #[serde(default)]
    pub heard_within_m: f64,
    /// Time spent within that distance since its newest report, s. Default: 0.
    #[serde(default)]
    pub unheard_s: f64,
    /// Reason why no visit is planned, if it cannot be visited.
    pub left_out: Option<LeftOut>,
}

/// Reason why a vehicle is not visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LeftOut {
    /// The craft no longer hears it at its former range, or its last report is too old.
    Silent,
    /// The craft cannot reach it in the planned time.
    OutOfReach,
    /// Its depth exceeds the range of an upload.
    TooDeep,
}

/// A schedule that begins with another vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Alternative {
    /// The vehicle visited first.
    #[schema(value_type = String)]
    pub next: VehicleId,
    /// Cost of the best such schedule.
    pub cost: f64,
    /// Number of deadlines that it misses.
    pub deadlines_missed: usize,
}
