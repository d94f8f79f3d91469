//! What clients receive.

use planner::{
    craft::{HeadingReference, SpeedReference},
    explain::Explanation,
    plan::{GoalPoint, Method, PlannedTarget, Predicted, SolverReport, Violation},
    snapshot::{Current, Origin, Schedule, TrajectoryPoint},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

/// A plan for the surface craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResponse {
    /// Version of this shape: `"1.0"`.
    pub schema_version: String,
    /// SHA-256 of the checked request, hexadecimal. Spelling, order of members, defaults, `metadata` and `deadline_ms` do not
    /// count. With an `origin`, positions count from the craft.
    pub plan_id: String,
    /// Whether this is what was asked for.
    pub outcome: Outcome,
    /// The fallback level that answered; in a comparison, the law.
    pub method: Method,
    /// Why the outcome is `degraded`: `deadline` (it came before any program was solved; in a comparison, before the schedule that the
    /// law follows was whole), `solver_` and the status, `certificate`, or `stale_report`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The request's `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// What to steer now.
    pub reference: Reference,
    /// The planned trajectory, from now on, for replay until the next answer.
    pub trajectory: Vec<TrajectoryPoint>,
    /// Course of what the goal follows, its offset apart, when that last moved, rad, in (−π, π].
    pub goal_course_rad: f64,
    /// Estimate of the craft. The next request needs it in `previous_plan`.
    pub craft_estimate: CraftEstimate,
    /// The current that was used, if it is known. The next request needs it in `previous_plan`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// Where the goal is expected.
    pub goal: GoalTrajectory,
    /// Where each underwater vehicle is expected, in the request's order.
    pub targets: Vec<PlannedTarget>,
    /// Which underwater vehicle is served when, of a goal of the kind `visit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schedule: Option<Schedule>,
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did; absent if no program was involved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<SolverReport>,
    /// Predicted cost of the trajectory.
    pub predicted: Predicted,
    /// Soft limits that the plan does not keep.
    pub violations: Vec<Violation>,
    /// Warnings about the request.
    pub warnings: Vec<Warning>,
    /// The request's metadata.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

/// Whether an answer is what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// A program was solved, and the fallback level of least predicted cost answered, be it the program or not.
    Ok,
    /// No program was solved, or the goal rests on a report that is too old; `reason` says why.
    Degraded,
}

/// Estimate of the craft, from its declared response and its motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftEstimate {
    /// Lag of the heading behind a steadily turning reference, delay included, s.
    pub heading_lag_s: Learnt,
    /// Steady offset of the heading from its reference, rad.
    pub heading_offset_rad: Learnt,
    /// Kind of heading reference that the loop seems to hold.
    pub heading_held: HeadingReference,
    /// Lag of the speed behind a steadily rising reference, delay included, s.
    pub surge_lag_s: Learnt,
    /// Kind of speed reference that the loop seems to hold.
    pub speed_held: SpeedReference,
    /// Disturbance of the speed loop: its acceleration at zero error, m/s².
    pub surge_bias_mps2: Learnt,
    /// Sway per surge and yaw rate, s, positive where the craft drifts outwards in a turn.
    pub sway_per_yaw_rate_s: Learnt,
    /// Whether the craft moves as predicted. If not, a warning says what was expected and what was measured.
    pub follows: bool,
    /// Speed through the water that this answer asks for, m/s.
    pub asked_speed_mps: f64,
    /// Heading that it asks for, rad, in (−π, π].
    pub asked_heading_rad: f64,
    /// Memory of the filters, to be sent back unchanged.
    pub memory: Vec<f64>,
}

/// A number that was learnt.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Learnt {
    /// Its likeliest value, in the unit of the member's name.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Reference for the inner loops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Reference {
    /// Speed for the craft's loop, m/s: through the water, or over ground if `craft.speed_held` says so.
    pub speed_mps: f64,
    /// Heading, or course over ground if `craft.heading_held` says so, rad, in (−π, π].
    pub heading_rad: f64,
    /// The same for people, degrees, in [0, 360).
    pub heading_deg: f64,
    /// Do not follow it after this time, s on the request's clock.
    pub valid_until_s: f64,
}

/// Where the goal is expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GoalTrajectory {
    /// One point for each of the plan's trajectory.
    pub trajectory: Vec<GoalPoint>,
}

/// What the line-of-sight law would do with the same request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Baseline {
    /// The law.
    pub method: Method,
    /// Its speed reference through the water, m/s.
    pub speed_mps: f64,
    /// Its heading reference, rad, in (−π, π].
    pub heading_rad: f64,
    /// Its predicted cost, to be compared with `predicted.cost`.
    #[serde(alias = "predicted_merit")]
    pub predicted_cost: f64,
    /// Its predicted root mean square distance to the goal, m.
    pub predicted_rms_error_m: f64,
    /// Its predicted propulsion energy over the horizon, J.
    pub predicted_energy_j: f64,
}

/// A warning about the request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Warning {
    /// Which, for programs.
    pub code: String,
    /// Where in the request, as a JSON pointer.
    pub pointer: String,
    /// Which, for people.
    pub detail: String,
}

/// The same snapshot through the planner and through the laws that it is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Comparison {
    /// The plans by controller.
    pub plans: Plans,
    /// How the planner came to its plan, where `?explain=true` asks for it and half of the time that was left after the plan was
    /// enough for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
}

/// Plans by controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Plans {
    /// The planner's answer.
    pub mpc: PlanResponse,
    /// The saturated line-of-sight law's, errors in the target's frame.
    pub saturated_los: PlanResponse,
    /// The saturated line-of-sight law's, errors in the tracker's frame.
    pub saturated_los_tracker_frame: PlanResponse,
    /// Integral line of sight's. Its integral starts at zero in every request: see its warning.
    pub integral_los: PlanResponse,
    /// Way-points round a box. The box is drawn about one fix in every request: see its warning.
    pub waypoint_box: PlanResponse,
}
