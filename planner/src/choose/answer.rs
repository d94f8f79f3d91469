//! Members of a plan: the reference, its basis, and the alternatives.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::{
    craft::estimate::CraftEstimate,
    estimate::{NextTurn, RepeatedTrack, from_reports::Estimate},
    facts::{
        angle::Course,
        auv::{Dive, VehicleId},
        localise::Figure,
        options::Forecast,
        previous_plan::{PreviousCraft, PreviousEstimate, PreviousPlan, PreviousTarget, Ranging},
        reference::{Reference, TrajectoryPoint},
        schedule::Schedule,
        traffic::Avoidance,
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
    /// Reason of a degraded answer; `None` if a program was solved, whichever level then answered.
    pub degraded: Option<Degraded>,
    /// Present speed and heading for the inner loops, in the kinds of references that they hold.
    pub reference: Reference,
    /// The same as speed through the water and heading; return it in the next request.
    pub reference_through_water: Reference,
    /// Estimate of the craft; return it in the next request.
    pub craft: CraftEstimate,
    /// End of the time for which reference and trajectory are valid without a newer plan, s.
    pub valid_until: f64,
    /// The planned trajectory, from now.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The goal at the times of the trajectory.
    pub goal: Vec<GoalPoint>,
    /// Last course of the followed point in motion; return it in the next request.
    pub goal_course: Course,
    /// Forecasts of the AUVs, in the snapshot's order.
    pub targets: Vec<PlannedTarget>,
    /// Covariances of the positions (north, east) of `targets` at the times of the trajectory, m².
    pub position_covariances: Vec<Vec<Matrix2<f64>>>,
    /// Answer of the line-of-sight law.
    pub baseline: Baseline,
    /// Work of the solver.
    pub solver: SolverReport,
    /// The current, if known; return it in the next request.
    pub current: Option<Current>,
    /// Prediction of the answer.
    pub predicted: Predicted,
    /// Terms of its predicted cost.
    pub cost_terms: CostTerms,
    /// Soft limits that the plan violates.
    pub violations: Vec<Violation>,
    /// Indices in the snapshot of the AUVs whose acoustic range cannot be kept now, ascending.
    /// Among the named ones, if no point is in range of all: those out of range at the goal. Among
    /// the others, from the nearest to the goal: each without a common point with all kept so far;
    /// the plan ignores their limits and reports the violations.
    pub range_unattainable: Vec<usize>,
    /// Schedule of a visit goal; return it in the next request.
    pub schedule: Option<Schedule>,
    /// Figure of a goal that localises AUVs; return it in the next request.
    pub figure: Option<Figure>,
    /// What is done about other vessels, if any may come near; return it in the next request.
    pub avoidance: Option<Avoidance>,
    /// The no-go area, by index, in which the goal is; the plan goes to the nearest place outside.
    pub goal_in_no_go: Option<usize>,
    /// `false` if no way leads past no-go areas to the goal.
    pub goal_is_reachable: bool,
}

impl AsRef<Self> for Plan {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl From<&Plan> for PreviousPlan {
    /// The members that the next request returns.
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
            figure: plan.figure.clone(),
            avoidance: plan.avoidance.clone(),
        }
    }
}

/// Origin of an answer: a fallback level, or a comparison-only law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The convex program, solved.
    Mpc,
    /// The previous plan, continued.
    PreviousPlan,
    /// The saturated line-of-sight law.
    SaturatedLos,
    /// Slow turn or stop.
    Hold,
    /// Line of sight in the tracker's frame; no fallback level.
    SaturatedLosTrackerFrame,
    /// Integral line of sight; no fallback level.
    IntegralLos,
    /// Way-points around a box; no fallback level.
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
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GoalPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north, if the request has an `origin`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east, if the request has an `origin`.
    pub lon_deg: Option<f64>,
    /// Northward velocity over ground, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground, m/s.
    pub east_mps: f64,
}

impl GoalPoint {
    /// The goal with this `motion` at time `t_s`.
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
    pub fn motion(&self) -> Motion {
        Motion {
            position: Vector2::new(self.north_m, self.east_m),
            velocity: Vector2::new(self.north_mps, self.east_mps),
        }
    }
}

/// Forecast of an underwater vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlannedTarget {
    /// The vehicle.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Estimate at its last report, from which the forecast starts.
    pub estimate: TargetEstimate,
    /// The forecast model used, never `auto`.
    pub forecast: Forecast,
    /// Velocity that reports and model do not explain, such as a current: estimated from successive
    /// `state`s without covariance, otherwise 0. The next request needs it in `previous_plan`.
    pub drift: Drift,
    /// Past track of a vehicle without a `path`: corners as time, s, and position north and east,
    /// m, at most 96. The next request needs it in `previous_plan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub track: Vec<[f64; 3]>,
    /// Past states of a vehicle given as `state`: time, s, position north and east, m, its standard
    /// deviation along either axis, m, and velocity over ground north and east, m/s; at most 48, at
    /// least 10 s apart. The next request needs it in `previous_plan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<[f64; 6]>,
    /// What the reports of a vehicle leave possible, if some are ranges. The next request needs it
    /// in `previous_plan`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ranging: Option<Ranging>,
    /// One point for each of the plan's trajectory.
    pub trajectory: Vec<TargetPoint>,
    /// Depth at the times of the trajectory, m, positive down.
    pub depths_m: Vec<f64>,
    /// Root-mean-square horizontal distance from the trajectory at these times, m.
    pub position_sigma_m: Vec<f64>,
}

/// An underwater vehicle at one time.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TargetPoint {
    /// Time, s on the request's clock.
    pub t_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north, if the request has an `origin`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east, if the request has an `origin`.
    pub lon_deg: Option<f64>,
}

/// Estimate of an underwater vehicle at its last report, from the request's `state` or `reports`.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Estimate)]
pub struct TargetEstimate {
    /// Age of the newest used report, s.
    pub age_s: f64,
    /// Position north of the datum at that time, m.
    pub north_m: f64,
    /// Position east of the datum at that time, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north, if the request has an `origin`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east, if the request has an `origin`.
    pub lon_deg: Option<f64>,
    /// Depth at that time, m, positive down.
    pub depth_m: f64,
    /// Northward velocity over ground at that time, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground at that time, m/s.
    pub east_mps: f64,
    /// Rate of turn of the course at the start of the forecast, rad/s, positive clockwise.
    pub turn_rate_radps: f64,
    /// Covariance of north, east, north velocity and east velocity at that time, row by row, in m²,
    /// m²/s and m²/s². Absent for a `state` without one.
    pub covariance: Option<[[f64; 4]; 4]>,
    /// Root-mean-square error of the position now, m. Absent without `covariance`.
    pub position_sigma_m: Option<f64>,
    /// Two possible places, the likelier first, if the ranges do not tell which is right. The
    /// position above is then their mean.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<TargetPlace>,
    /// Indices of the unused `reports`, ascending: outliers, reports before a jump, and duplicates
    /// among those of the last hour, for lack of time among the newest.
    pub rejected: Vec<usize>,
    /// Fit of its reports to its `path`, or of these or its past states to its track's pattern.
    /// Absent without either.
    pub route: Option<RouteFit>,
    /// Sawtooth in its reported depths. Absent unless it reversed three times at the same depths,
    /// and if it declares its `dive`.
    pub dive: Option<Dive>,
}

/// A place at which an underwater vehicle may be.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Place)]
pub struct TargetPlace {
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north, if the request has an `origin`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east, if the request has an `origin`.
    pub lon_deg: Option<f64>,
    /// Its probability.
    pub probability: f64,
}

/// Fit of an underwater vehicle's reports to its path, which its own navigation may displace.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Route)]
pub struct RouteFit {
    /// Probability that it follows its path. Below 0.5 it is forecast without a path.
    pub probability: f64,
    /// Its place along the path, m.
    pub along_m: f64,
    /// Displacement of the path north of the declared one, m.
    pub north_m: f64,
    /// Displacement of the path east of the declared one, m.
    pub east_m: f64,
    /// Speed along the path above the declared one, m/s.
    pub faster_mps: f64,
    /// `true` if it follows the path backwards.
    pub backwards: bool,
    /// Its next turn on the path.
    pub next_turn: Option<NextTurn>,
    /// Pattern of its track, which serves as its path. Absent if it declares one.
    pub repeats: Option<RepeatedTrack>,
}

impl TargetPoint {
    /// Position (north, east), m.
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
                estimate: TargetEstimate::new(estimate, snapshot),
                forecast: forecast.model.into(),
                drift: forecast.drift().into(),
                track: estimate.track.clone(),
                states: estimate.states.clone(),
                ranging: estimate.ranging.clone(),
                trajectory: times.iter().map(point).collect(),
                depths_m: times.iter().map(|time| forecast.depth_at(*time)).collect(),
                position_sigma_m: times.iter().map(sigma).collect(),
            }
        };
        known.map(target).collect()
    }
}

impl TargetEstimate {
    fn new(estimate: &Estimate, snapshot: &Snapshot) -> Self {
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
            position_sigma_m: estimate.position_sigma(&snapshot.tuned().estimate),
            places: estimate.places.map_or_else(Vec::new, |places| {
                let place = |at: Vector2<f64>, probability| {
                    let (north_m, east_m) = (at.x, at.y);
                    TargetPlace { north_m, east_m, lat_deg: None, lon_deg: None, probability }
                };
                let likelier = place(places.likelier, places.probability);
                vec![likelier, place(places.other, 1.0 - places.probability)]
            }),
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
                repeats: estimate.repeats.as_ref().map(|repeats| repeats.track),
            }),
        }
    }
}

impl From<&PlannedTarget> for PreviousTarget {
    /// The members that the next request returns.
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
            states: target.states.clone(),
            ranging: target.ranging.clone(),
        }
    }
}

/// Answer of a line-of-sight law for the same snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Reason why more time would change it.
    pub degraded: Option<Degraded>,
    /// Its reference.
    pub reference: Reference,
    /// Its rollout over the horizon.
    pub trajectory: Vec<TrajectoryPoint>,
    /// Prediction of the rollout.
    pub predicted: Predicted,
    /// Terms of its predicted cost.
    pub cost_terms: CostTerms,
    /// Limits of position that it violates.
    pub violations: Vec<Violation>,
}
