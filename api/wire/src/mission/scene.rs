//! The map of a mission, and the true states of a simulated one.

use std::collections::BTreeMap;

use planner::los::LawGains;
use planner::snapshot::{KeepOut, NoGo, Origin, Task};
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use super::new::Controller;

/// Map objects beside the vehicles, and the controller's information, as of the mission's creation.
/// Later changes are in its `setting`.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Scene {
    /// Duration of a simulated mission, s.
    pub duration_s: Option<f64>,
    /// Start of the settled scores, such as `settled_rms_m`, s since a simulated mission's start.
    pub settled_after_s: Option<f64>,
    /// Time between two plans, s.
    pub period_s: f64,
    /// Seconds of a live mission's clock per second.
    pub clock_rate: f64,
    /// Name of the scenario, if it has one.
    pub scenario: Option<String>,
    /// The seed of a simulated mission.
    pub seed: Option<u64>,
    /// Controller of a simulated mission.
    pub controller: Option<Controller>,
    /// Gains of a simulated mission's law.
    pub gains: Option<LawGains>,
    /// Faults of a simulated mission, in the order of their starts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<SceneFault>,
    /// The controller's information, in words.
    pub information: Option<String>,
    /// The goal of a simulated mission; that of a live one is in its setting.
    pub goal: Option<Task>,
    /// The underwater vehicles.
    pub auvs: Vec<String>,
    /// The surface craft of a fleet.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surface_craft: Vec<String>,
    /// Discs to keep out of.
    pub keep_outs: Vec<KeepOut>,
    /// Polygons to keep out of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub no_go: Vec<NoGo>,
    /// Corners (north, east) of the area to stay in, m.
    pub area: Vec<[f64; 2]>,
    /// Slant range to keep within, m.
    pub range_max_m: Option<f64>,
    /// Points (north, east) of the known paths of underwater vehicles, m.
    pub paths: BTreeMap<String, Vec<[f64; 2]>>,
    /// Place of the datum on Earth, if known.
    pub origin: Option<Origin>,
}

/// A fault of a simulated mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SceneFault {
    /// Start, s since the mission's start.
    pub from_s: f64,
    /// End, s; none if it lasts until the mission's end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
    /// The fault, in words.
    pub what: String,
}

/// True states in a simulated mission at the time of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Truth {
    /// The surface craft.
    pub asc: TrueVehicle,
    /// The underwater vehicles, by name.
    pub auvs: BTreeMap<String, TrueVehicle>,
    /// The goal's position north, m.
    pub goal_north_m: f64,
    /// The goal's position east, m.
    pub goal_east_m: f64,
    /// Distance of the surface craft to the goal, m.
    pub distance_m: f64,
    /// Propulsion energy since the start, J.
    pub energy_j: f64,
    /// The other vessels, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub vessels: BTreeMap<String, TrueVessel>,
}

/// Another vessel of a simulated mission.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrueVessel {
    /// Position north, m.
    pub north_m: f64,
    /// Position east, m.
    pub east_m: f64,
    /// Course over ground, rad.
    pub course_rad: f64,
    /// Speed over ground, m/s.
    pub speed_mps: f64,
    /// Length over all, m.
    pub length_m: f64,
}

/// A vehicle of a simulated mission.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrueVehicle {
    /// Position north, m.
    pub north_m: f64,
    /// Position east, m.
    pub east_m: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
    /// Surge speed through the water, m/s.
    pub speed_mps: f64,
}
