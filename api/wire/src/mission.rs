//! Missions, as clients create, feed and see them.

use std::collections::BTreeMap;

use planner::fleet::{Assignment, SlotUse};
use planner::snapshot::Origin;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use super::{Method, Outcome, PlanResponse};

mod new;
mod order;
mod report;
mod scene;
mod setting;

pub use new::{Controller, Live, LiveAuv, LiveCraft, NewMission, Simulated};
pub use order::{Order, OrderList, Run, Step};
pub use report::{Accepted, AscReport, LastSteering, Note, Reports, Steering, SteeringState};
pub use scene::{Scene, SceneFault, TrueVehicle, TrueVessel, Truth};
pub use setting::{ChangedPath, Setting};

/// Status of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Created, but not started.
    #[default]
    Created,
    /// Running.
    Running,
    /// Paused; can be resumed.
    Paused,
    /// Over.
    Finished,
    /// Over because of a failure, which its events name.
    Failed,
}

impl Status {
    /// `true` if nothing more will happen.
    pub fn is_over(self) -> bool {
        matches!(self, Self::Finished | Self::Failed)
    }

    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Created => "created",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Failed => "failed",
        }
    }
}

/// A mission.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mission {
    /// Its name in paths.
    pub id: String,
    /// Name for people.
    pub title: String,
    /// `simulated` or `live`.
    pub kind: String,
    /// Controller of a simulated mission. None: a live mission, or one that 0.2.0
    /// created.
    pub controller: Option<Controller>,
    /// Its status.
    pub status: Status,
    /// Unix time of its creation, s.
    pub created_s: f64,
    /// Unix time of its start, s.
    pub started_s: Option<f64>,
    /// Unix time of its end, s.
    pub finished_s: Option<f64>,
    /// Time of its last plan: s since the start of a simulated mission, Unix time of a live one.
    pub t_s: f64,
    /// Seconds of a simulated mission per second; none: as fast as possible.
    pub speed_factor: Option<f64>,
    /// Number of its last event.
    pub sequence: u64,
    /// Number of the event that last changed its setting or status: the `ETag`, for `If-Match`.
    #[serde(default)]
    pub revision: u64,
    /// Changeable members of a live mission: PATCH changes them.
    pub setting: Option<Setting>,
    /// Place of a live mission's datum on Earth, if its creation, a fix or a change has set it.
    pub origin: Option<Origin>,
    /// Metadata of the client.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
    /// The last plan; after a start of the service, absent until the mission runs or is requested.
    pub plan: Option<PlanSummary>,
    /// Last reported state of a live mission's steering. None: no report since the start. Of a
    /// fleet, the worst of all craft.
    pub steering: Option<LastSteering>,
    /// The surface craft of a fleet.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surface_craft: Vec<CraftSummary>,
}

/// A surface craft of a fleet.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftSummary {
    /// Its name.
    pub id: String,
    /// The AUVs that it serves.
    pub auvs: Vec<String>,
    /// Why it serves none, if it is unable to.
    pub away: Option<Away>,
    /// Its last plan.
    pub plan: Option<PlanSummary>,
    /// Last reported state of its steering.
    pub steering: Option<LastSteering>,
    /// Share of its energy that was left when it was last reported.
    pub battery: Option<f64>,
}

/// Why a craft of a fleet serves no AUV.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Away {
    /// No state of it was heard for 10 s.
    Silent,
    /// A person steers it.
    Person,
    /// Its bridge reports that it is not steered.
    NotSteering,
    /// Its bridge sends no references, as intended: the craft is not armed, or this is a dry run.
    Waiting,
    /// Less of its energy is left than its `battery_min`.
    BatteryLow,
    /// It does not move as its plans foresee.
    DoesNotFollow,
    /// It is well again, and not yet for long enough to serve.
    Returning,
}

/// Who serves whom in a fleet, since `t_s`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Assigned {
    /// Time of the plans, on the mission's clock, s.
    pub t_s: f64,
    /// Who serves whom.
    pub assignment: Assignment,
    /// Craft that can serve nobody, and why.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub away: BTreeMap<String, Away>,
    /// `true` if the deadline cut the search short: it cannot be repeated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_short: bool,
}

/// Summary of a mission's last plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanSummary {
    /// Outcome of the plan.
    pub outcome: Outcome,
    /// Reason for the outcome `degraded`, as in the answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The fallback level or law that answered.
    pub method: Method,
    /// Age of the plan, s on the mission's clock. An age of several `period_s` in a running mission
    /// means missed plans. Always 0 in a simulated mission: its clock stops between plans.
    pub age_s: f64,
    /// Time between two plans, s on the mission's clock.
    pub period_s: f64,
    /// Delay of the plan after its due time, s.
    pub late_s: f64,
    /// Its warnings, for people.
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in their order.
    #[serde(default)]
    pub warning_codes: Vec<String>,
    /// Times at which vehicles of a live mission were last heard, s on its clock.
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles without recent reports, for which the next plan waits.
    pub waits_for: Vec<String>,
}

/// Missions, in the order of their creation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MissionList {
    /// A page of missions.
    pub missions: Vec<Mission>,
    /// Parameter `after` of the next page; none on the last page.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// The reference to follow now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurrentReference {
    /// The mission.
    pub mission: String,
    /// The craft of a fleet that it is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<String>,
    /// The mission's status. Only a running mission makes new plans.
    pub status: Status,
    /// Number of the event that stored the plan.
    pub sequence: u64,
    /// Time of the plan on the mission's clock, s.
    pub t_s: f64,
    /// Delay of the plan after its due time, s.
    pub late_s: f64,
    /// Its age, s on the mission's clock. Do not follow it after `plan.reference.valid_until_s`.
    pub age_s: f64,
    /// Outcome of the plan.
    pub outcome: Outcome,
    /// The fallback level or law that answered.
    pub method: Method,
    /// Times at which the surface craft (`asc`, or the names of a fleet's) and AUVs were last heard, on the mission's clock, s.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles without recent reports, for which the next plan waits; empty while plans are made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waits_for: Vec<String>,
    /// Slots of the acoustic network of a fleet, one after the other: transmissions in one slot do
    /// not disturb each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub slots: Vec<Vec<SlotUse>>,
    /// Due plans that were not made since the service took over the mission: it was overloaded, the
    /// disk refused to write, or the known facts were invalid.
    pub missed: u64,
    /// The complete plan.
    pub plan: PlanResponse,
}
