//! Orders to missions, and the list of those given.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An order that changed or deleted a mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Order {
    /// Its number.
    pub number: u64,
    /// Unix time of the order, s.
    pub at_s: f64,
    /// Its author: the name of a token, or an address if the service needs no tokens.
    pub caller: String,
    /// The request's id in the service's log.
    pub request_id: String,
    /// The mission's `id`.
    pub mission: String,
    /// `create`, `run`, `pause`, `step`, `change`, `finish`, `delete`, or the service's `expire`.
    pub action: String,
}

/// Orders, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderList {
    /// A page of orders.
    pub orders: Vec<Order>,
    /// Parameter `after` of the next page; none on the last page.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// Parameters of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Seconds of a simulated mission per second. Default: as fast as possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_factor: Option<f64>,
}

/// Parameters of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Plans to make and follow. Default: 1.
    #[serde(default = "one_tick")]
    pub ticks: u32,
}

fn one_tick() -> u32 {
    1
}

impl Default for Step {
    fn default() -> Self {
        Self { ticks: one_tick() }
    }
}
