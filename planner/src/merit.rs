//! What a way is predicted to lead to: one measure for every candidate, whatever led to it.

use nalgebra::Vector2;

use crate::{
    answer::{Predicted, SoftLimit, Subject, Violation},
    horizon::Horizon,
    policy::Weights,
    program::Disc,
    response::{Rollout, Stage, Waypoint},
};

/// Quadratic surge drag by which propulsion energy is predicted, N/(m/s)²: the MEDUSA class's.
///
/// Source: public parameters of the craft of the Institute for Systems and Robotics, Lisbon.
pub(crate) const SURGE_DRAG: f64 = 27.5;

/// A violation below this is rounding, m.
const NOTICEABLE: f64 = 1e-3;

/// The worst of each of several soft limits, where it is noticeably broken.
pub(crate) type Broken<const N: usize> = [Option<Violation>; N];

/// By how much a limit of position is broken, m, and by what.
type Excess = (f64, Option<Subject>);

/// What `rollout` is predicted to lead to, and the limits of position that it breaks.
///
/// The merit is the program's own cost in natural units, without its scale and its cap on far goals, and the
/// program's price of every limit of position that is broken, by the worst of each interval on the way, not at the
/// stages alone. What the craft cannot do, a rollout does not do, so that nothing else can be broken.
pub(crate) fn predict(horizon: &Horizon, rollout: &Rollout, weights: &Weights) -> (Predicted, Broken<4>) {
    let mut predicted = track(horizon, &rollout.stages, weights);
    let mut pricing = Pricing {
        horizon,
        rollout,
        merit: &mut predicted.merit,
    };
    let [range] = pricing.add([SoftLimit::AcousticRange], weights.range_slack);
    let [area] = pricing.add([SoftLimit::Area], weights.area_slack);
    let around_discs = [SoftLimit::KeepOut, SoftLimit::SurfacingSeparation];
    let [keep_out, separation] = pricing.add(around_discs, weights.keep_out_slack);
    (predicted, [range, area, keep_out, separation])
}

/// Adds the price of broken limits to a merit.
struct Pricing<'a> {
    horizon: &'a Horizon,
    rollout: &'a Rollout,
    merit: &'a mut f64,
}

impl Pricing<'_> {
    /// Adds the price of `limits`, and answers the worst of each. They share a slack, so that only the one of them
    /// that is broken most has its price.
    fn add<const N: usize>(&mut self, limits: [SoftLimit; N], slack_price: (f64, f64)) -> Broken<N> {
        let (linear, quadratic) = slack_price;
        let mut broken: Broken<N> = [None; N];
        for interval in self.rollout.way.chunk_by(|a, b| a.stage == b.stage) {
            let mut slack: f64 = 0.0;
            for (limit, worst) in limits.into_iter().zip(&mut broken) {
                let excesses = interval.iter().map(|place| excess(self.horizon, limit, place));
                let (amount, about) = most(excesses);
                slack = slack.max(amount);
                if NOTICEABLE < amount && worst.is_none_or(|worst| worst.amount < amount) {
                    *worst = Some(Violation {
                        limit,
                        about,
                        time: self.horizon.time(interval[0].stage),
                        amount,
                    });
                }
            }
            *self.merit += slack * (linear + quadratic * slack);
        }
        broken
    }
}

/// By how much a limit of position is broken at a place; 0 where it is kept.
fn excess(horizon: &Horizon, limit: SoftLimit, place: &Waypoint) -> Excess {
    let around = &horizon.surroundings;
    let (k, share) = (place.stage, place.share);
    let number = |numbers: &[f64]| numbers[k - 1] + share * (numbers[k] - numbers[k - 1]);
    let distance =
        |centres: &[Vector2<f64>]| (place.position - centres[k - 1].lerp(&centres[k], share)).norm();
    let too_near = |(subject, disc): (Subject, &Disc)| {
        let amount = number(&disc.radii) - distance(&disc.centres);
        (amount, Some(subject))
    };
    match limit {
        SoftLimit::AcousticRange => most(around.ranges().map(|(subject, range)| {
            let amount = distance(&range.centres) - number(&range.radii);
            (amount, Some(subject))
        })),
        SoftLimit::Area => most(around.edges.iter().map(|edge| {
            let amount = edge.normal.dot(&place.position) - edge.offset;
            (amount, None)
        })),
        SoftLimit::KeepOut => most(around.keep_outs().map(too_near)),
        SoftLimit::SurfacingSeparation => most(around.separations().map(too_near)),
        SoftLimit::ForwardSpeed | SoftLimit::TurnRate => (0.0, None),
    }
}

/// The first of the largest above 0.
fn most(excesses: impl Iterator<Item = Excess>) -> Excess {
    excesses.fold(
        (0.0, None),
        |most, next| if most.0 < next.0 { next } else { most },
    )
}

/// Cost of the stages, without limits.
fn track(horizon: &Horizon, stages: &[Stage], weights: &Weights) -> Predicted {
    let (mut merit, mut square_error, mut square_miss, mut energy) = (0.0, 0.0, 0.0, 0.0);
    let miss = |k: usize| {
        let (stage, goal) = (&stages[k], &horizon.goal[k]);
        let error = (stage.position - goal.position).norm_squared();
        let relative = (stage.velocity + horizon.current - goal.velocity).norm_squared();
        let cost = horizon
            .surroundings
            .excess_of_worst_range(k, &stage.position, &goal.position);
        let power = SURGE_DRAG * stage.velocity.norm().powi(3);
        (error, cost.unwrap_or(error), relative, power)
    };
    let mut last = miss(0);
    for k in 1..stages.len() {
        let dt = horizon.times[k] - horizon.times[k - 1];
        let (from, to) = (last, miss(k));
        last = to;
        square_error += 0.5 * dt * (from.0 + to.0);
        square_miss += 0.5 * dt * (from.1 + to.1);
        merit += 0.5 * dt * weights.velocity * (from.2 + to.2);
        energy += 0.5 * dt * (from.3 + to.3);
        let acceleration = (stages[k].velocity - stages[k - 1].velocity) / dt;
        merit += dt * weights.acceleration * acceleration.norm_squared();
    }
    let (_, last_miss, last_relative, _) = last;
    merit += weights.position * square_miss
        + weights.terminal_position * last_miss
        + weights.terminal_velocity * last_relative
        + weights.energy * energy;
    let duration = horizon.times[horizon.times.len() - 1];
    Predicted {
        merit,
        rms_error: (square_error / duration).sqrt(),
        energy,
    }
}
