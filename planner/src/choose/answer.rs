//! What a plan says: the reference, what stands behind it, and what stands beside it.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    craft::estimate::CraftEstimate,
    estimate::from_reports::Estimate,
    facts::{
        angle::Course,
        auv::VehicleId,
        options::ForecastModel,
        previous_plan::{PreviousCraft, PreviousPlan, PreviousTarget},
        reference::{Reference, TrajectoryPoint},
        water::Current,
    },
    los::law::LosLaw,
    predict::{forecast::AuvForecast, motion::Motion},
    problem::violation::Violation,
    scp::{
        predicted_cost::Predicted,
        result::{Degraded, SolverReport},
    },
    snapshot::build::{KnownAuv, Snapshot},
};

/// The answer to a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The fallback level that answered.
    pub method: Method,
    /// Why the answer is degraded; `None` when a program was solved, whichever level then answered.
    pub degraded: Option<Degraded>,
    /// Speed and heading for the inner loops, now: what they hold, through water or over ground, heading or course.
    pub reference: Reference,
    /// The same as speed through the water and heading; hand it back in the next request.
    pub reference_through_water: Reference,
    /// What is known of the craft; hand it back in the next request.
    pub craft: CraftEstimate,
    /// Until when the reference and the trajectory may be followed without a newer plan, s.
    pub valid_until: f64,
    /// The planned trajectory, from now on.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The goal at the times of the trajectory.
    pub goal: Vec<Motion>,
    /// The course of what the goal follows, its offset apart, when that last moved; hand it back in the next request.
    pub goal_course: Course,
    /// How each AUV was forecast, in the snapshot's order.
    pub targets: Vec<TargetForecast>,
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did.
    pub solver: SolverReport,
    /// What the current (north, east) was taken for, m/s, where it was known; hand it back in the next request.
    pub current: Option<Vector2<f64>>,
    /// What the answer is predicted to lead to.
    pub predicted: Predicted,
    /// Soft limits that the plan does not keep.
    pub violations: Vec<Violation>,
    /// The AUVs whose acoustic range cannot be kept now, by their place in the snapshot, ascending: of those that the goal
    /// names, the ones out of range where it is met, if no place is in range of all; of the others, taken from the nearest
    /// to the goal on, each that has no place in range of all kept so far. For these others the craft does nothing then;
    /// that their limit is broken is reported.
    pub range_unattainable: Vec<usize>,
}

impl From<&Plan> for PreviousPlan {
    /// What the next request has to say of this answer.
    fn from(plan: &Plan) -> Self {
        let asked = &plan.reference_through_water;
        Self {
            origin: None,
            trajectory: plan.trajectory.clone(),
            goal_course_rad: Some(plan.goal_course.radians()),
            craft_estimate: Some(PreviousCraft {
                asked_speed_mps: asked.speed,
                asked_heading_rad: asked.heading.radians(),
                memory: plan.craft.memory().to_vec(),
            }),
            current: plan.current.map(Current::from),
            reference: Some(plan.reference.into()),
            targets: Some(plan.targets.iter().map(PreviousTarget::from).collect()),
        }
    }
}

/// What gave the answer: a fallback level, or a law that is only compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The convex program, solved.
    Mpc,
    /// The previous plan, followed further.
    PreviousPlan,
    /// The saturated line-of-sight law.
    SaturatedLos,
    /// Slow turn or stop.
    Hold,
    /// Line of sight in the tracker's frame; no fallback level.
    SaturatedLosTrackerFrame,
    /// Integral line of sight; no fallback level.
    IntegralLos,
    /// Way-points round a box; no fallback level.
    WaypointBox,
}

impl From<LosLaw> for Method {
    fn from(law: LosLaw) -> Self {
        match law {
            LosLaw::SaturatedLos => Self::SaturatedLos,
            LosLaw::TrackerFrame => Self::SaturatedLosTrackerFrame,
            LosLaw::Integral => Self::IntegralLos,
            LosLaw::WaypointBox => Self::WaypointBox,
        }
    }
}

/// Where one AUV is expected at the times of the trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetForecast {
    /// The AUV.
    pub id: VehicleId,
    /// Where it was when it was last heard of, from which the forecast starts.
    pub estimate: Estimate,
    /// The model used.
    pub model: ForecastModel,
    /// Velocity over ground (north, east) beyond what the model and the report explain, m/s; hand it back in the next
    /// request.
    pub drift: Vector2<f64>,
    /// Positions (north, east) at the times of the trajectory, m.
    pub positions: Vec<Vector2<f64>>,
    /// Depths at the times of the trajectory, m, positive down.
    pub depths: Vec<f64>,
    /// Standard deviation of the positions, m: root mean square of the distance from where the AUV will be.
    pub position_sigmas: Vec<f64>,
    /// Covariances of the positions (north, east), m².
    pub position_covariances: Vec<Matrix2<f64>>,
}

impl TargetForecast {
    /// All AUVs at `times` after the snapshot, s.
    pub(crate) fn of_all(snapshot: &Snapshot, times: &[f64], forecasts: &[AuvForecast]) -> Vec<Self> {
        let known = snapshot.known_auvs().zip(forecasts);
        let target = |(KnownAuv { auv, estimate, .. }, forecast): (KnownAuv<'_>, &AuvForecast)| {
            let position = |time: &f64| forecast.at(*time).position;
            let depth = |time: &f64| forecast.depth_at(*time);
            let covariance = |time: &f64| forecast.position_covariance(*time);
            let sigma = |time: &f64| forecast.position_variance(*time).sqrt();
            Self {
                id: auv.id.clone(),
                estimate: estimate.clone(),
                model: forecast.model,
                drift: forecast.drift(),
                positions: times.iter().map(position).collect(),
                depths: times.iter().map(depth).collect(),
                position_sigmas: times.iter().map(sigma).collect(),
                position_covariances: times.iter().map(covariance).collect(),
            }
        };
        known.map(target).collect()
    }
}

impl From<&TargetForecast> for PreviousTarget {
    /// What the next request has to say of it.
    fn from(target: &TargetForecast) -> Self {
        let state = &target.estimate.state;
        Self {
            id: target.id.clone(),
            estimate: Some(state.into()),
            forecast: Some(target.model.into()),
            drift: Some(target.drift.into()),
        }
    }
}

/// A line-of-sight law on the same snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Its reference.
    pub reference: Reference,
    /// Where it leads, rolled out over the horizon.
    pub trajectory: Vec<TrajectoryPoint>,
    /// What it is predicted to lead to.
    pub predicted: Predicted,
    /// Limits of position that it breaks on the way.
    pub violations: Vec<Violation>,
}
