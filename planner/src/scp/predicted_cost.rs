//! Predicted cost of a followed trajectory: one measure for all candidates.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::craft::response::{Rollout, Stage, Waypoint};
use crate::problem::horizon::Horizon;
use crate::problem::limits::{AcousticRange, Disc};
use crate::problem::parameters::Weights;
use crate::problem::stage_constraints::RangePriority;
use crate::problem::violation::{SoftLimit, Subject, Violation};

/// Predicted cost of a trajectory over the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Predicted {
    /// Predicted cost of the trajectory; lower is better.
    #[serde(alias = "merit")]
    pub cost: f64,
    /// Root mean square distance to the goal, m.
    pub rms_error_m: f64,
    /// Propulsion energy, J.
    pub energy_j: f64,
}

/// The terms of a predicted cost, m² s, which sum to the cost up to rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CostTerms {
    /// Acceleration.
    pub acceleration: f64,
    /// Violated limits of position.
    pub broken_limits: f64,
    /// Propulsion energy.
    pub energy: f64,
    /// Distance and relative velocity at the end of the horizon.
    pub terminal: f64,
    /// Distance to the goal on the way.
    pub tracking: f64,
    /// Velocity relative to the goal's.
    pub velocity: f64,
}

/// Largest violation that is rounding, m.
const NOTICEABLE: f64 = 1e-3;

/// Worst noticeable violation of each of several soft limits.
pub(crate) type Violations<const N: usize> = [Option<Violation>; N];

/// Distance from a no-go area that costs as much as to be in it, m, so that no plan cuts corners.
const SHORE_KEPT: f64 = 0.3;

/// Violation of a limit of position, m, and its subject.
type Excess = (f64, Option<Subject>);

/// Prediction of `rollout`, and the limits of position that it violates.
///
/// The cost is the program's in natural units, without its scale and its cap on far goals, plus its
/// price of every violated limit of position at the worst point of each interval.
pub(crate) fn predict(horizon: &Horizon<'_>, rollout: &Rollout) -> (Predicted, CostTerms, Violations<6>) {
    let weights = &horizon.weights;
    let (mut predicted, mut terms) = track(horizon, &rollout.stages, weights);
    let kept = predicted.cost;
    let mut pricing = Pricing { horizon, rollout, cost: &mut predicted.cost };
    let [named] = pricing.add([Limit::NamedRange], weights.range_slack);
    let [other] = pricing.add([Limit::OtherRange], weights.other_range_slack);
    let [area] = pricing.add([Limit::Area], weights.area_slack);
    let around = [Limit::KeepOut, Limit::SurfacingSeparation, Limit::VesselSeparation, Limit::NoGo];
    let [keep_out, separation, vessel, no_go] = pricing.add(around, weights.keep_out_slack);
    let [given_up] = pricing.add([Limit::RangeGivenUp], (0.0, 0.0));
    let range = worse(worse(named, other), given_up);
    terms.broken_limits = predicted.cost - kept;
    (predicted, terms, [range, area, keep_out, separation, vessel, no_go])
}

/// Priced limits of position.
#[derive(Clone, Copy, PartialEq)]
enum Limit {
    /// Ranges of the AUVs that the goal names.
    NamedRange,
    /// Ranges of the others.
    OtherRange,
    /// Ranges of these that cannot be kept.
    RangeGivenUp,
    Area,
    KeepOut,
    SurfacingSeparation,
    VesselSeparation,
    NoGo,
}

impl Limit {
    fn broken(self) -> SoftLimit {
        match self {
            Self::NamedRange | Self::OtherRange | Self::RangeGivenUp => SoftLimit::AcousticRange,
            Self::Area => SoftLimit::Area,
            Self::KeepOut => SoftLimit::KeepOut,
            Self::SurfacingSeparation => SoftLimit::SurfacingSeparation,
            Self::VesselSeparation => SoftLimit::VesselSeparation,
            Self::NoGo => SoftLimit::NoGo,
        }
    }
}

fn worse(a: Option<Violation>, b: Option<Violation>) -> Option<Violation> {
    match (a, b) {
        (Some(first), Some(second)) if first.amount < second.amount => b,
        (Some(_), _) => a,
        (None, _) => b,
    }
}

/// Adds the price of violations to a cost.
struct Pricing<'a> {
    horizon: &'a Horizon<'a>,
    rollout: &'a Rollout,
    cost: &'a mut f64,
}

impl Pricing<'_> {
    /// Adds the price of the largest violation of `limits`, which share a slack; the worst of each.
    fn add<const N: usize>(&mut self, limits: [Limit; N], slack_price: (f64, f64)) -> Violations<N> {
        let (linear, quadratic) = slack_price;
        let mut broken: Violations<N> = [None; N];
        let mut from = self.rollout.stages[0].position;
        for interval in self.rollout.waypoints.chunk_by(|a, b| a.stage == b.stage) {
            let mut slack: f64 = 0.0;
            for (limit, worst) in limits.into_iter().zip(&mut broken) {
                let excesses = interval.iter().map(|place| excess(self.horizon, limit, place));
                let (amount, pointer) = most(excesses);
                let near_shore =
                    if limit == Limit::NoGo { shore_excess(self.horizon, from, interval) } else { 0.0 };
                slack = slack.max(amount).max(near_shore);
                if NOTICEABLE < amount && worst.is_none_or(|worst| worst.amount < amount) {
                    let limit = limit.broken();
                    *worst = Some(Violation {
                        limit,
                        pointer,
                        t_s: self.horizon.time(interval[0].stage),
                        amount,
                        unit: limit.unit(),
                    });
                }
            }
            *self.cost += slack * (linear + quadratic * slack);
            from = interval[interval.len() - 1].position;
        }
        broken
    }
}

/// Violation of a limit of position at a point; 0 if it is kept.
fn excess(horizon: &Horizon<'_>, limit: Limit, place: &Waypoint) -> Excess {
    let constraints = &horizon.constraints;
    let (k, share) = (place.stage, place.share);
    let number = |numbers: &[f64]| numbers[k - 1] + share * (numbers[k] - numbers[k - 1]);
    let distance =
        |centres: &[Vector2<f64>]| (place.position - centres[k - 1].lerp(&centres[k], share)).norm();
    let too_near = |(subject, disc): (Subject, &Disc)| {
        let amount = number(&disc.radii) - distance(&disc.centres);
        (amount, Some(subject))
    };
    let too_far = |(subject, range): (Subject, &AcousticRange)| {
        let amount = distance(&range.centres) - number(&range.radii);
        (amount, Some(subject))
    };
    match limit {
        Limit::NamedRange => most(constraints.ranges(RangePriority::Named).map(too_far)),
        Limit::OtherRange => most(constraints.ranges(RangePriority::Other).map(too_far)),
        Limit::RangeGivenUp => most(constraints.ranges(RangePriority::GivenUp).map(too_far)),
        Limit::Area => most(constraints.edges.iter().map(|edge| {
            let amount = edge.normal.dot(&place.position) - edge.offset;
            (amount, Some(Subject::Area))
        })),
        Limit::KeepOut => most(constraints.keep_outs().map(too_near)),
        Limit::SurfacingSeparation => most(constraints.separations().map(too_near)),
        Limit::VesselSeparation => most(constraints.vessels().map(too_near)),
        Limit::NoGo => {
            let land = horizon
                .land_near()
                .and_then(|land| land.inside(&horizon.frame.ned_position(&place.position)));
            land.map_or((0.0, None), |(area, depth)| (depth, Some(Subject::NoGo(area))))
        }
    }
}

/// How much nearer than [`SHORE_KEPT`] the line through `places` comes to a no-go area, m.
fn shore_excess(horizon: &Horizon<'_>, mut from: Vector2<f64>, places: &[Waypoint]) -> f64 {
    let Some(land) = horizon.land_near() else { return 0.0 };
    let excess = |place: &Waypoint| {
        let ends = [std::mem::replace(&mut from, place.position), place.position];
        let [a, b] = ends.map(|end| horizon.frame.ned_position(&end));
        let depth = land.inside(&b).map_or(0.0, |(_, depth)| SHORE_KEPT + depth);
        depth.max(SHORE_KEPT - land.sides.gap((&a, &b), SHORE_KEPT))
    };
    places.iter().map(excess).fold(0.0, f64::max)
}

/// The first of the largest above 0.
fn most(excesses: impl Iterator<Item = Excess>) -> Excess {
    excesses.fold((0.0, None), |most, next| if most.0 < next.0 { next } else { most })
}

/// Cost of the stages, without limits.
fn track(horizon: &Horizon<'_>, stages: &[Stage], weights: &Weights) -> (Predicted, CostTerms) {
    let (mut sum, mut square_error, mut square_miss, mut energy) = (0.0, 0.0, 0.0, 0.0);
    let miss = |k: usize| {
        let (stage, goal) = (&stages[k], &horizon.goal[k]);
        let error = (stage.position - goal.position).norm_squared();
        let relative = (stage.velocity + horizon.current - goal.velocity).norm_squared();
        let excess = horizon.constraints.minimax_excess(k, &stage.position, &goal.position);
        let power = horizon.craft.power.at(stage.velocity.norm());
        (error, excess.unwrap_or(error), relative, power)
    };
    let mut terms = CostTerms::default();
    let mut last = miss(0);
    for k in 1..stages.len() {
        let dt = horizon.times[k] - horizon.times[k - 1];
        let (from, to) = (last, miss(k));
        last = to;
        square_error += 0.5 * dt * (from.0 + to.0);
        square_miss += 0.5 * dt * (from.1 + to.1);
        let relative = 0.5 * dt * weights.velocity * (from.2 + to.2);
        terms.velocity += relative;
        sum += relative;
        energy += 0.5 * dt * (from.3 + to.3);
        let acceleration = (stages[k].velocity - stages[k - 1].velocity) / dt;
        let acceleration = dt * weights.acceleration * acceleration.norm_squared();
        terms.acceleration += acceleration;
        sum += acceleration;
    }
    let (_, last_miss, last_relative, _) = last;
    sum += weights.position * square_miss
        + weights.terminal_position * last_miss
        + weights.terminal_velocity * last_relative
        + weights.energy * energy;
    terms.tracking = weights.position * square_miss;
    terms.terminal = weights.terminal_position * last_miss + weights.terminal_velocity * last_relative;
    terms.energy = weights.energy * energy;
    let duration = horizon.times[horizon.times.len() - 1];
    let predicted = Predicted { cost: sum, rms_error_m: (square_error / duration).sqrt(), energy_j: energy };
    (predicted, terms)
}
