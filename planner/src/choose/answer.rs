//! What a plan says: the reference, what stands behind it, and what stands beside it.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    craft::estimate::CraftEstimate,
    estimate::{NextTurn, Pattern, from_reports::Estimate},
    facts::{
        angle::Course,
        auv::{Dive, VehicleId},
        options::Forecast,
        previous_plan::{PreviousCraft, PreviousEstimate, PreviousPlan, PreviousTarget},
        reference::{Reference, TrajectoryPoint},
        schedule::Schedule,
        water::{Current, Drift},
    },
    los::law::LosLaw,
    predict::{forecast::AuvForecast, motion::Motion},
    problem::violation::Violation,
    scp::{
        predicted_cost::{CostTerms, Predicted},
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
    pub goal: Vec<GoalPoint>,
    /// The course of what the goal follows, its offset apart, when that last moved; hand it back in the next request.
    pub goal_course: Course,
    /// Where each AUV is expected, in the snapshot's order.
    pub targets: Vec<PlannedTarget>,
    /// Covariances of the positions (north, east) of each of `targets` at the times of the trajectory, m².
    pub position_covariances: Vec<Vec<Matrix2<f64>>>,
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did.
    pub solver: SolverReport,
    /// What the current was taken for, where it was known; hand it back in the next request.
    pub current: Option<Current>,
    /// What the answer is predicted to lead to.
    pub predicted: Predicted,
    /// What its predicted cost is made of.
    pub cost_terms: CostTerms,
    /// Soft limits that the plan does not keep.
    pub violations: Vec<Violation>,
    /// The AUVs whose acoustic range cannot be kept now, by their place in the snapshot, ascending: of those that the goal
    /// names, the ones out of range where it is met, if no place is in range of all; of the others, taken from the nearest
    /// to the goal on, each that has no place in range of all kept so far. For these others the craft does nothing then;
    /// that their limit is broken is reported.
    pub range_unattainable: Vec<usize>,
    /// When each AUV is visited, of a goal that visits; hand it back in the next request.
    pub schedule: Option<Schedule>,
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
            current: plan.current,
            reference: Some(plan.reference.into()),
            targets: Some(plan.targets.iter().map(PreviousTarget::from).collect()),
            schedule: plan.schedule.clone(),
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

impl GoalPoint {
    /// The goal that moves so at time `t_s`.
    pub(crate) fn new(t_s: f64, motion: Motion) -> Self {
        Self {
            t_s,
            north_m: motion.position.x,
            east_m: motion.position.y,
            lat_deg: None,
            lon_deg: None,
            north_mps: motion.velocity.x,
            east_mps: motion.velocity.y,
        }
    }

    /// Its position and velocity over ground.
    #[must_use]
    pub fn motion(&self) -> Motion {
        Motion {
            position: Vector2::new(self.north_m, self.east_m),
            velocity: Vector2::new(self.north_mps, self.east_mps),
        }
    }
}

/// Where an underwater vehicle is expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlannedTarget {
    /// The vehicle.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Its estimate at its last report, from which the forecast starts.
    pub estimate: TargetEstimate,
    /// The forecast model used, never `auto`.
    pub forecast: Forecast,
    /// Velocity that its reports and the model do not explain, such as a current that it does not know: estimated from
    /// successive `state`s without covariance, otherwise zero. The next request needs it in `previous_plan`.
    pub drift: Drift,
    /// Where it was, of a vehicle without a `path`: corners of its track, each as time, s, position north and east, m, at most 96. The next
    /// request needs it in `previous_plan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub track: Vec<[f64; 3]>,
    /// One point for each of the plan's trajectory.
    pub trajectory: Vec<TargetPoint>,
    /// Its depth at the times of the trajectory, m, positive down.
    pub depths_m: Vec<f64>,
    /// Root mean square of its horizontal distance from the trajectory at these times, m.
    pub position_sigma_m: Vec<f64>,
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

/// Estimate of an underwater vehicle at its last report: the request's `state`, or the filtered `reports`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Estimate)]
pub struct TargetEstimate {
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
    /// How its reports fit its `path`, or what its track repeats. Absent without either, and without reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub route: Option<RouteFit>,
    /// The sawtooth in which it dives, by the depths that it reports. Absent unless it was seen to turn three times at the same depths,
    /// and where it declares its `dive`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dive: Option<Dive>,
}

/// How an underwater vehicle follows its path, by its reports. It follows the path where its own navigation takes that to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Route)]
pub struct RouteFit {
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
    /// The turn of the path that it comes to next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_turn: Option<NextTurn>,
    /// What its track repeats, which is taken for its path. Absent where it declares one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<RepeatedTrack>,
}

/// What an underwater vehicle's track repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RepeatedTrack {
    /// What it looks like.
    pub pattern: Pattern,
    /// How often it was sailed, as far as the track is remembered: about twice or more.
    pub times: f64,
    /// Length of what repeats, m: of a lawn-mower's lane and turn, of a lap.
    pub period_m: f64,
    /// Length of its longest leg from corner to corner, m.
    pub leg_m: f64,
    /// Distance between lanes, m; 0 where there are none.
    pub spacing_m: f64,
    /// Root mean square distance between one time and the next, laid over each other, m.
    pub residual_m: f64,
}

impl TargetPoint {
    /// Position (north, east), m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }
}

impl PlannedTarget {
    /// All AUVs at `times` after the snapshot, s.
    pub(crate) fn all(snapshot: &Snapshot, times: &[f64], forecasts: &[AuvForecast]) -> Vec<Self> {
        let known = snapshot.known_auvs().zip(forecasts);
        let target = |(KnownAuv { auv, estimate, .. }, forecast): (KnownAuv<'_>, &AuvForecast)| {
            let point = |time: &f64| {
                let position = forecast.at(*time).position;
                TargetPoint {
                    t_s: snapshot.t_s + time,
                    north_m: position.x,
                    east_m: position.y,
                    lat_deg: None,
                    lon_deg: None,
                }
            };
            let sigma = |time: &f64| forecast.position_variance(*time).sqrt();
            Self {
                id: auv.id.clone(),
                estimate: estimate.into(),
                forecast: forecast.model.into(),
                drift: forecast.drift().into(),
                track: estimate.track.clone(),
                trajectory: times.iter().map(point).collect(),
                depths_m: times.iter().map(|time| forecast.depth_at(*time)).collect(),
                position_sigma_m: times.iter().map(sigma).collect(),
            }
        };
        known.map(target).collect()
    }
}

impl From<&Estimate> for TargetEstimate {
    fn from(estimate: &Estimate) -> Self {
        let state = &estimate.state;
        let velocity = state.velocity();
        Self {
            age_s: state.age_s,
            north_m: state.north_m,
            east_m: state.east_m,
            lat_deg: None,
            lon_deg: None,
            depth_m: state.depth_m,
            north_mps: velocity.x,
            east_mps: velocity.y,
            turn_rate_radps: state.turn_rate_radps,
            covariance: state.covariance,
            position_sigma_m: estimate.position_sigma(),
            rejected: estimate.rejected.clone(),
            dive: estimate.dive,
            route: estimate.route.map(|route| RouteFit {
                probability: route.probability,
                along_m: route.fit.along(),
                north_m: route.fit.offset().x,
                east_m: route.fit.offset().y,
                faster_mps: route.fit.faster(),
                backwards: route.fit.sense < 0.0,
                next_turn: route.next_turn,
                repeats: estimate.repeats.as_ref().map(|repeats| RepeatedTrack {
                    pattern: repeats.pattern,
                    times: repeats.times,
                    period_m: repeats.period,
                    leg_m: repeats.leg,
                    spacing_m: repeats.spacing,
                    residual_m: repeats.residual,
                }),
            }),
        }
    }
}

impl From<&PlannedTarget> for PreviousTarget {
    /// What the next request has to say of it.
    fn from(target: &PlannedTarget) -> Self {
        let estimate = &target.estimate;
        Self {
            id: target.id.clone(),
            estimate: Some(PreviousEstimate {
                age_s: estimate.age_s,
                north_m: estimate.north_m,
                east_m: estimate.east_m,
                depth_m: estimate.depth_m,
                north_mps: estimate.north_mps,
                east_mps: estimate.east_mps,
                turn_rate_radps: estimate.turn_rate_radps,
            }),
            forecast: Some(target.forecast),
            drift: Some(target.drift),
            track: target.track.clone(),
        }
    }
}

/// A line-of-sight law on the same snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Why this is not what it would do with more time.
    pub degraded: Option<Degraded>,
    /// Its reference.
    pub reference: Reference,
    /// Where it leads, rolled out over the horizon.
    pub trajectory: Vec<TrajectoryPoint>,
    /// What it is predicted to lead to.
    pub predicted: Predicted,
    /// What its predicted cost is made of.
    pub cost_terms: CostTerms,
    /// Limits of position that it breaks on the way.
    pub violations: Vec<Violation>,
}
