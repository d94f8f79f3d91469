//! What clients receive.

use std::collections::BTreeMap;

use planner::{
    certificate::Residuals,
    craft::{HeadingReference, SpeedReference},
    explain::ProgramSize,
    plan::Method,
    snapshot::{Current, Drift, Forecast, Origin, TrajectoryPoint},
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
    /// Why the outcome is `degraded`: `deadline` (it came before any program was solved), `solver_` and the status,
    /// `certificate`, or `stale_report`.
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
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did; absent if no program was involved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<Solver>,
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

/// The goal at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GoalPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Its latitude, degrees, positive north, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Its longitude, degrees, positive east, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Northward velocity over ground, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground, m/s.
    pub east_mps: f64,
}

/// Where an underwater vehicle is expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlannedTarget {
    /// The vehicle.
    pub id: String,
    /// Its estimate at its last report, from which the forecast starts.
    pub estimate: Estimate,
    /// The forecast model used, never `auto`.
    pub forecast: Forecast,
    /// Velocity that its reports and the model do not explain, such as a current that it does not know: estimated from
    /// successive `state`s without covariance, otherwise zero. The next request needs it in `previous_plan`.
    pub drift: Drift,
    /// One point for each of the plan's trajectory.
    pub trajectory: Vec<TargetPoint>,
    /// Its depth at the times of the trajectory, m, positive down.
    pub depths_m: Vec<f64>,
    /// Root mean square of its horizontal distance from the trajectory at these times, m.
    pub position_sigma_m: Vec<f64>,
}

/// Estimate of an underwater vehicle at its last report: the request's `state`, or the filtered `reports`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Estimate {
    /// Age of the newest report that was used, s.
    pub age_s: f64,
    /// Position north of the datum then, m.
    pub north_m: f64,
    /// Position east of the datum then, m.
    pub east_m: f64,
    /// Its latitude, degrees, positive north, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Its longitude, degrees, positive east, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
    /// Depth then, m, positive down.
    pub depth_m: f64,
    /// Northward velocity over ground then, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground then, m/s.
    pub east_mps: f64,
    /// Rate of turn of the course that the forecast starts with, rad/s, positive clockwise.
    pub turn_rate_radps: f64,
    /// Covariance of north, east, north velocity and east velocity then, row by row, in m², m²/s and m²/s². Absent
    /// where the request gives a state without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 4]; 4]>,
    /// Root mean square distance between the estimate, carried to now, and the vehicle, m. Absent as `covariance` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_sigma_m: Option<f64>,
    /// Indices of the `reports` that were not used, ascending: outliers, reports before a jump, and duplicates.
    pub rejected: Vec<usize>,
    /// How its reports fit its `path`. Absent without a path or without reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub route: Option<Route>,
}

/// How an underwater vehicle follows its path, by its reports. It follows the path where its own navigation takes that to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Route {
    /// Probability that it follows its path. Below 0.5 it is forecast as if no path were known.
    pub probability: f64,
    /// How far along the path it is, m.
    pub along_m: f64,
    /// By how much the path lies farther north than declared, m.
    pub north_m: f64,
    /// By how much the path lies farther east than declared, m.
    pub east_m: f64,
    /// By how much it goes faster along the path than declared, m/s.
    pub faster_mps: f64,
    /// Whether it sails the path from the end to the beginning.
    pub backwards: bool,
}

/// An underwater vehicle at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TargetPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Its latitude, degrees, positive north, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat_deg: Option<f64>,
    /// Its longitude, degrees, positive east, where the request names an `origin`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon_deg: Option<f64>,
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

/// What the solver did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Solver {
    /// Status of the last SCP iteration, in snake case.
    pub status: String,
    /// Iterations of the sequential convex programming: convex subproblems solved.
    #[serde(alias = "passes")]
    pub scp_iterations: usize,
    /// Interior-point iterations over all subproblems.
    pub iterations: u32,
    /// Whether the deadline cut the work short. With the outcome `ok`, a program had been solved by then, and further
    /// ones were not tried or not finished: the best of what there was answered, whatever its `method`.
    pub deadline_hit: bool,
    /// Time for the whole plan, ms: the one member that differs between two equal requests.
    pub solve_time_ms: f64,
    /// Residuals of the last subproblem, recomputed outside the solver.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
}

/// Predicted cost of a trajectory over the horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Predicted {
    /// Predicted cost of the trajectory; less is better.
    #[serde(alias = "merit")]
    pub cost: f64,
    /// Root mean square distance to the goal, m.
    pub rms_error_m: f64,
    /// Propulsion energy, J.
    pub energy_j: f64,
}

/// A soft limit that a plan does not keep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Violation {
    /// Which: `forward_speed`, `turn_rate`, `acoustic_range` (less the back-off for the uncertainty of the vehicle's position),
    /// `area`, `keep_out` (a disc) or `surfacing_separation` (an underwater vehicle at the surface).
    pub limit: String,
    /// What breaks it worst, as a JSON pointer into the request: the disc (`/keep_outs/0`), the underwater vehicle
    /// (`/auvs/1`) or the `/area`. Absent for what the craft's own motion breaks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointer: Option<String>,
    /// When it is worst, s on the request's clock.
    pub t_s: f64,
    /// By how much, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
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

/// How the planner came to its plan. Equal requests have equal explanations: one that would be cut short is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Explanation {
    /// Size of the last convex subproblem.
    pub program: ProgramSize,
    /// What each predicted cost is made of, by controller and term, m² s; the terms of one add up to its `predicted.cost`.
    pub cost_terms: BTreeMap<String, BTreeMap<String, f64>>,
    /// Soft limits that the last subproblem could not keep at the price of its slacks.
    pub slack: Vec<UsedSlack>,
    /// Every convex subproblem, in the order in which they were solved.
    pub log: Vec<Subproblem>,
}

/// A soft limit that gave way at a stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UsedSlack {
    /// Which limits share the slack: `motion`, `acoustic_range`, `other_range` (of AUVs that the goal does not name), `area` or `keep_out`.
    pub limit: String,
    /// How long after the request's time that is, s.
    pub after_s: f64,
    /// By how much, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
}

/// A convex subproblem, solved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Subproblem {
    /// How the solver ended, in snake case.
    pub status: String,
    /// Interior-point iterations.
    pub iterations: u32,
    /// How well its optimality conditions hold, recomputed outside the solver; absent without a solution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
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
