//! The answers that clients receive.

use planner::craft::{HeadingReference, SpeedReference};
use planner::explain::Explanation;
use planner::plan::{GoalPoint, Method, PlannedTarget, Predicted, SolverReport, Violation};
use planner::snapshot::{Avoidance, Current, Figure, Origin, Schedule, TrajectoryPoint};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

/// A plan for the surface craft.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResponse {
    /// Version of this shape: `"1.0"`.
    pub schema_version: String,
    /// SHA-256 of the checked request, hexadecimal, without `metadata` and `deadline_ms`. Spelling,
    /// order and defaults do not matter. With an `origin`, positions count from the craft.
    pub plan_id: String,
    /// Outcome of the request.
    pub outcome: Outcome,
    /// The fallback level that answered; in a comparison, the law.
    pub method: Method,
    /// Reason for `degraded`: `deadline` (before a program was solved; in a comparison, before the
    /// law's schedule was complete), `solver_` and the status, `certificate`, or `stale_report`.
    pub reason: Option<String>,
    /// The request's `origin`.
    pub origin: Option<Origin>,
    /// Reference to steer now.
    pub reference: Reference,
    /// The planned trajectory, from now on, for replay until the next answer.
    pub trajectory: Vec<TrajectoryPoint>,
    /// Last course of the point that the goal follows, without its offset, rad, in (−π, π].
    pub goal_course_rad: f64,
    /// Estimate of the craft. The next request needs it in `previous_plan`.
    pub craft_estimate: CraftEstimate,
    /// The current that was used, if it is known. The next request needs it in `previous_plan`.
    pub current: Option<Current>,
    /// Expected positions of the goal.
    pub goal: GoalTrajectory,
    /// Expected positions of each underwater vehicle, in the request's order.
    pub targets: Vec<PlannedTarget>,
    /// Visits of underwater vehicles, for a goal of the kind `visit`.
    pub schedule: Option<Schedule>,
    /// The figure that the craft sails, for a goal of the kind `localise`.
    pub figure: Option<Figure>,
    /// Encounters with other vessels, and the manoeuvre, if any may come near.
    pub avoidance: Option<Avoidance>,
    /// Answer of the line-of-sight law.
    pub baseline: Baseline,
    /// Report of the solver; absent if no program was involved.
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

/// Outcome of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// A program was solved, and the fallback level of least predicted cost answered.
    Ok,
    /// No program was solved, or the goal rests on a report that is too old: see `reason`.
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
    /// Sway per surge and yaw rate, s; positive if the craft drifts outwards in a turn.
    pub sway_per_yaw_rate_s: Learnt,
    /// `true` if the craft moves as predicted; otherwise a warning names the difference.
    pub follows: bool,
    /// Speed through the water that this answer asks for, m/s.
    pub asked_speed_mps: f64,
    /// Heading that it asks for, rad, in (−π, π].
    pub asked_heading_rad: f64,
    /// Memory of the filters, to be sent back unchanged.
    pub memory: Vec<f64>,
}

/// A learnt number.
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
    /// Speed for the craft's loop, m/s: through the water, or over ground by `craft.speed_held`.
    pub speed_mps: f64,
    /// Heading, or course over ground if `craft.heading_held` says so, rad, in (−π, π].
    pub heading_rad: f64,
    /// The same in degrees, for people, in [0, 360).
    pub heading_deg: f64,
    /// Do not follow it after this time, s on the request's clock.
    pub valid_until_s: f64,
}

/// Expected positions of the goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GoalTrajectory {
    /// One point for each of the plan's trajectory.
    pub trajectory: Vec<GoalPoint>,
}

/// Answer of the line-of-sight law to the same request.
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
    /// The warning, for programs.
    pub code: String,
    /// Its place in the request, as a JSON pointer.
    pub pointer: String,
    /// The warning, for people.
    pub detail: String,
}

/// Answers of the planner and of comparison laws to the same snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Comparison {
    /// The plans by controller.
    pub plans: Plans,
    /// Explanation of the planner's plan, if `?explain=true` asks for it and half of the time left
    /// after the plan is enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
}

/// Plans by controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Plans {
    /// The planner's answer.
    pub mpc: PlanResponse,
    /// Saturated line-of-sight law, errors in the target's frame.
    pub saturated_los: PlanResponse,
    /// Saturated line-of-sight law, errors in the tracker's frame.
    pub saturated_los_tracker_frame: PlanResponse,
    /// Integral line-of-sight law. Its integral starts at zero in every request: see its warning.
    pub integral_los: PlanResponse,
    /// Way-points around a box, which is drawn about one fix in every request: see its warning.
    pub waypoint_box: PlanResponse,
}
