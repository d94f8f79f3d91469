//! What a way is predicted to lead to: one measure for every candidate, whatever led to it.

use nalgebra::Vector2;

use crate::{
    answer::{Predicted, SoftLimit, Violation},
    horizon::Horizon,
    policy::Weights,
    response::{Rollout, Stage, Waypoint},
};

/// Quadratic surge drag by which propulsion energy is predicted, N/(m/s)²: the MEDUSA class's.
///
/// Source: public parameters of the craft of the Institute for Systems and Robotics, Lisbon.
pub(crate) const SURGE_DRAG: f64 = 27.5;

/// A violation below this is rounding, m.
const NOTICEABLE: f64 = 1e-3;

/// The worst of each of three soft limits, where it is noticeably broken.
pub(crate) type Broken = [Option<Violation>; 3];

/// What `rollout` is predicted to lead to, and the limits of position that it breaks.
///
/// The merit is the program's own cost in natural units, without its scale and its cap on far goals, and the
/// program's price of every limit of position that is broken, by the worst of each interval on the way, not at the
/// stages alone. What the craft cannot do, a rollout does not do, so that nothing else can be broken.
pub(crate) fn predict(horizon: &Horizon, rollout: &Rollout, weights: &Weights) -> (Predicted, Broken) {
    let mut predicted = track(horizon, &rollout.stages, weights);
    let violations = [
        (SoftLimit::AcousticRange, weights.range_slack),
        (SoftLimit::Area, weights.area_slack),
        (SoftLimit::KeepOut, weights.keep_out_slack),
    ]
    .map(|(limit, (linear, quadratic))| {
        let mut worst: Option<Violation> = None;
        for interval in rollout.way.chunk_by(|a, b| a.stage == b.stage) {
            let (amount, stage) = interval
                .iter()
                .map(|place| (excess(horizon, limit, place), place.stage))
                .fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most });
            predicted.merit += amount * (linear + quadratic * amount);
            if NOTICEABLE < amount && worst.as_ref().is_none_or(|worst| worst.amount < amount) {
                worst = Some(Violation {
                    limit,
                    time: horizon.time(stage),
                    amount,
                });
            }
        }
        worst
    });
    (predicted, violations)
}

/// By how much a limit of position is broken at a place, m; not positive where it is kept.
fn excess(horizon: &Horizon, limit: SoftLimit, place: &Waypoint) -> f64 {
    let around = &horizon.surroundings;
    let (k, share) = (place.stage, place.share);
    let between = |points: &[Vector2<f64>]| points[k - 1].lerp(&points[k], share);
    let number = |numbers: &[f64]| numbers[k - 1] + share * (numbers[k] - numbers[k - 1]);
    let most = |amounts: &mut dyn Iterator<Item = f64>| amounts.fold(0.0, f64::max);
    match limit {
        SoftLimit::AcousticRange => most(
            &mut around
                .ranges
                .iter()
                .map(|range| (place.position - between(&range.centres)).norm() - number(&range.radii)),
        ),
        SoftLimit::Area => most(
            &mut around
                .edges
                .iter()
                .map(|edge| edge.normal.dot(&place.position) - edge.offset),
        ),
        SoftLimit::KeepOut => most(
            &mut around
                .discs
                .iter()
                .map(|disc| number(&disc.radii) - (place.position - between(&disc.centres)).norm()),
        ),
        SoftLimit::ForwardSpeed | SoftLimit::TurnRate | SoftLimit::TrustCone => 0.0,
    }
}

/// Cost of the stages, without limits.
fn track(horizon: &Horizon, stages: &[Stage], weights: &Weights) -> Predicted {
    let (mut merit, mut square_error, mut square_miss, mut energy) = (0.0, 0.0, 0.0, 0.0);
    let mut acceleration_before: Option<Vector2<f64>> = None;
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
        if let Some(before) = acceleration_before.replace(acceleration) {
            merit += weights.acceleration_change * (acceleration - before).norm_squared();
        }
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
