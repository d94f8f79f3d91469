//! The surface craft of a fleet, and who serves whom.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::auv::VehicleId;

/// Which craft serves which AUVs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Assignment {
    /// Each craft with the AUVs that it serves, in the request's order. The next request needs it
    /// in `previous_plan`.
    pub craft: Vec<CraftAssignment>,
    /// Its cost: for the goal `visit` that of the schedules, in their unit, with the price of
    /// missed deadlines; for `range` the mean over the next quarter of an hour of the largest distance
    /// from an AUV, m; else that of the squared distances from the AUVs, m².
    pub cost: f64,
    /// For `visit` a lower bound on the cost of any schedules, 0 if a craft does not reach all
    /// AUVs; else an estimate of one, with the best craft for each AUV alone.
    pub bound: f64,
    /// `true` if all assignments were compared, instead of the most promising ones.
    pub exact: bool,
    /// `true` if a better one was known, by too little to change.
    pub kept: bool,
    /// Time of the last change, s on the request's clock: the next one soon after it has to be
    /// better by more.
    pub changed_s: f64,
    /// AUVs that a craft still serves beside the one to which they were given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_overs: Vec<HandOver>,
    /// AUVs of the goal that nobody serves, since no craft that is present may.
    #[schema(value_type = Vec<String>)]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unserved: Vec<VehicleId>,
}

/// An AUV that a craft still serves beside the one to which it was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HandOver {
    /// The AUV.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// The craft from which it was taken.
    #[schema(value_type = String)]
    pub craft: VehicleId,
    /// The end of that, s on the request's clock.
    pub until_s: f64,
}

impl Assignment {
    /// The AUVs that the craft at an index serves now: its own, and those that it hands over.
    pub fn serves(&self, craft: usize) -> impl Iterator<Item = &VehicleId> {
        let CraftAssignment { id, auvs, .. } = &self.craft[craft];
        let is_own = |auv: &VehicleId| auvs.contains(auv);
        let handed_over = self.hand_overs.iter();
        let handed_over =
            handed_over.filter(move |hand_over| hand_over.craft == *id && !is_own(&hand_over.auv));
        auvs.iter().chain(handed_over.map(|hand_over| &hand_over.auv))
    }
}

/// A craft with the AUVs that it serves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftAssignment {
    /// The craft.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// The AUVs that it serves, none for a spare craft.
    #[schema(value_type = Vec<String>)]
    pub auvs: Vec<VehicleId>,
    /// `true` for a spare craft that localises them beside the one whose they are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub beside: bool,
}

/// A transmission in a slot of the acoustic network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SlotUse {
    /// The craft.
    #[schema(value_type = String)]
    pub craft: VehicleId,
    /// The AUV that it calls.
    #[schema(value_type = String)]
    pub auv: VehicleId,
}
