//! When each AUV is visited, as an answer says it and the next request brings it back.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::auv::VehicleId;

/// Visits to underwater vehicles, of a goal of the kind `visit`. The next request needs it in `previous_plan`: without it, costs
/// start anew and nothing keeps the schedule from changing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Schedule {
    /// Unit of every cost.
    pub unit: CostUnit,
    /// The visits, in order; the first may have begun. Of those that are planned, at most the first 32.
    pub visits: Vec<Visit>,
    /// Every vehicle that the goal depends on.
    pub costs: Vec<ServedVehicle>,
    /// Cost of the schedule: the mean or the largest, as the goal asks. Missed deadlines are not in it.
    pub cost: f64,
    /// No schedule costs less: one craft cannot be with all vehicles at once, and needs time from each to the next.
    pub bound: f64,
    /// What the schedule may cost too much: 1 − `bound` / `cost`.
    pub gap: f64,
    /// Whether all sequences of visits were compared; with many vehicles, only the most promising are.
    pub exact: bool,
    /// Every other vehicle that could be visited first, the cheapest first.
    pub alternatives: Vec<Alternative>,
    /// Vehicles that are not served by a deadline in the time that is planned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>)]
    pub deadlines_missed: Vec<VehicleId>,
    /// The schedule in words.
    pub sentence: String,
    /// Whether the next visit is that of the schedule before.
    pub kept: bool,
    /// The vehicle that the goal asks for as `next`, once that visit is over: the planner chooses again, until another one is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<String>)]
    pub next_visited: Option<VehicleId>,
}

impl Schedule {
    /// The vehicle of the visit that is on, or else of the next one.
    #[must_use]
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
    /// Data that are not uploaded, kbit.
    #[serde(rename = "kbit")]
    Kilobits,
}

/// A visit to an underwater vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Visit {
    /// The vehicle.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// When the craft is near enough to serve it, s on the request's clock.
    pub arrive_s: f64,
    /// When it leaves, s.
    pub leave_s: f64,
    /// Where the vehicle is expected when the craft arrives, or is if it is there: north of the datum, m.
    pub north_m: f64,
    /// East of the datum, m.
    pub east_m: f64,
    /// The vehicle's cost when the craft arrives, in `unit`.
    pub cost_before: f64,
    /// Its cost when the craft leaves.
    pub cost_after: f64,
}

/// A vehicle that the schedule serves, or would.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ServedVehicle {
    /// The vehicle.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// Its cost now, in `unit`.
    pub cost: f64,
    /// The deadline by which it was last served, or late, s on the request's clock; none if it has no deadline, or is yet to be served.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub served_by_s: Option<f64>,
    /// The farthest that it was from the craft while its reports came, horizontal, m. Default: 0.
    #[serde(default)]
    pub heard_within_m: f64,
    /// Time that the craft was no farther from it since its newest report, s. Default: 0.
    #[serde(default)]
    pub unheard_s: f64,
    /// Why no visit is planned to it, if it can have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out: Option<LeftOut>,
}

/// Why no visit to a vehicle is planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LeftOut {
    /// It is not heard any more where it was heard, or its last report is too old.
    Silent,
    /// The craft does not reach it in the time that is planned.
    OutOfReach,
    /// It is deeper than data are uploaded from.
    TooDeep,
}

/// A schedule that begins with another vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Alternative {
    /// The vehicle that is visited first.
    #[schema(value_type = String)]
    pub next: VehicleId,
    /// What the best such schedule costs.
    pub cost: f64,
    /// How many deadlines it misses.
    pub deadlines_missed: usize,
}
