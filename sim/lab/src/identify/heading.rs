//! The heading loop's parameters.

use nalgebra::Vector2;
use planner::angle::{direction, wrap};

use super::fit::{self, Estimate, Fitted, advantage, least_squares, nearest};
use super::log::{Log, LogRow};
use super::parameter::{Parameter, Quantity, positive, signed, time_constant};
use super::reference::HeldReference;

/// Longest step of the simulation, s.
const STEP_MAX: f64 = 0.1;
/// Times below this are rounding, s.
pub(super) const SHORTEST: f64 = 1e-9;
/// Time to ignore at the start, whose state the log does not contain, s.
pub(super) const SETTLING: f64 = 10.0;
/// Largest simulated natural frequency, rad/s, and damping: stable with half of [`STEP_MAX`].
const FREQUENCY_MAX: f64 = 5.0;
const DAMPING_MAX: f64 = 3.0;
/// Below this speed over ground a craft has no course, m/s.
const COURSE_SPEED_MIN: f64 = 0.1;
/// Lags and delays of the initial guesses, s; the best one is taken.
const STARTS: [f64; 6] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
const DELAYS: [f64; 3] = [0.1, 0.8, 2.0];
/// Least advantage of a second-order loop over a first-order one, natural units of log likelihood.
const SECOND_ORDER_WORTH: f64 = 5.0;

/// Motion through the water at a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    /// True heading, rad.
    pub(super) heading: f64,
    /// Yaw rate, rad/s.
    pub(super) yaw_rate: f64,
    /// Surge, m/s.
    pub(super) surge: f64,
    /// Sway, m/s.
    pub(super) sway: f64,
}

/// Current and motion, which turn a heading into a course.
#[derive(Clone, Debug)]
pub(super) struct Water {
    /// Current (north, east), m/s.
    pub(super) current: Vector2<f64>,
    /// Motion through the water at each row.
    pub(super) motion: Vec<Motion>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LoopOrder {
    First,
    Second,
}

pub(super) struct HeadingFit {
    order: LoopOrder,
    pub(super) fit: Fitted,
    estimates: Vec<Estimate>,
    /// Heading and yaw rate at each row.
    pub(super) simulated: Vec<Motion>,
    /// Predicted compass heading at each row, rad.
    pub(super) predicted: Vec<f64>,
}

/// A heading loop with its compass.
#[derive(Clone, Copy, Debug)]
struct Loop {
    order: LoopOrder,
    /// T or 1/ω, s.
    time: f64,
    damping: f64,
    delay: f64,
    rate_max: f64,
    compass_bias: f64,
}

impl Loop {
    /// Parameters in the order of [`Loop::start`].
    fn of(order: LoopOrder, parameters: &[f64]) -> Self {
        let time = parameters[0].exp();
        let damping = parameters[4..].first().map_or(1.0, |zeta| zeta.exp());
        Self {
            order,
            time: match order {
                LoopOrder::First => time,
                LoopOrder::Second => time.max(1.0 / FREQUENCY_MAX),
            },
            damping: damping.min(DAMPING_MAX),
            delay: parameters[1],
            rate_max: parameters[2].exp(),
            compass_bias: parameters[3],
        }
    }

    /// ln T, t_d, ln r_max, compass bias, and ln ζ of a second-order loop.
    fn start(order: LoopOrder, time: f64, delay: f64, rate_max: f64) -> Vec<f64> {
        let mut start = vec![time.ln(), delay, rate_max.ln(), 0.0];
        if order == LoopOrder::Second {
            start[0] = (0.5 * time).ln();
            start.push(0.0);
        }
        start
    }
}

/// Fits the heading loop; with `water`, a loop that controls the course.
pub(super) fn fit(log: &Log, reference: &HeldReference, water: Option<&Water>) -> HeadingFit {
    let begin = begin(log);
    let residuals = |order: LoopOrder, parameters: &[f64]| -> Vec<f64> {
        let (_, predicted) = simulate(log, reference, water, &Loop::of(order, parameters));
        let pairs = log.headings().iter().zip(predicted).zip(log.rows()).skip(begin);
        let pairs = pairs.filter(|(_, row)| steers(row));
        let residuals = pairs.map(|((measured, predicted), _)| wrap(measured - predicted));
        residuals.collect()
    };
    let rate_max = 0.8 * fastest_turn(log);
    let best = |order: LoopOrder| {
        let start = |time: &f64| DELAYS.map(|delay| Loop::start(order, *time, delay, rate_max));
        let starts = STARTS.iter().flat_map(start);
        least_squares(|p| residuals(order, p), &nearest(|p| residuals(order, p), starts))
    };
    let (first, second) = (best(LoopOrder::First), best(LoopOrder::Second));
    let (order, fitted) = if SECOND_ORDER_WORTH < advantage(&second, &first) {
        (LoopOrder::Second, second)
    } else {
        (LoopOrder::First, first)
    };
    let channels = std::iter::once(0..fitted.residuals.len()).collect::<Vec<_>>();
    let estimates = fit::estimates(|p| residuals(order, p), &fitted, &channels);
    let (simulated, predicted) = simulate(log, reference, water, &Loop::of(order, &fitted.parameters));
    HeadingFit { order, fit: fitted, estimates, simulated, predicted }
}

/// The first row after the settling time.
pub(super) fn begin(log: &Log) -> usize {
    let rows = log.rows();
    rows.partition_point(|row| row.time < rows[0].time + SETTLING)
}

/// The fastest turn in the log over two seconds, rad/s.
fn fastest_turn(log: &Log) -> f64 {
    const OVER: f64 = 2.0;
    let (rows, headings) = (log.rows(), log.headings());
    let mut fastest = 0.02_f64;
    let mut from = 0;
    for (to, row) in rows.iter().enumerate() {
        while rows[from].time < row.time - OVER {
            from += 1;
        }
        let elapsed = row.time - rows[from].time;
        if 0.5 * OVER < elapsed {
            fastest = fastest.max((headings[to] - headings[from]).abs() / elapsed);
        }
    }
    fastest
}

/// Heading and yaw rate at every row, and the predicted compass heading.
fn simulate(
    log: &Log,
    reference: &HeldReference,
    water: Option<&Water>,
    law: &Loop,
) -> (Vec<Motion>, Vec<f64>) {
    let rows = log.rows();
    let (mut psi, mut rate) = (log.headings()[0] - law.compass_bias, 0.0);
    // A first-order loop in still water is exact for any step.
    let step_max = match (law.order, water) {
        (LoopOrder::First, None) => f64::INFINITY,
        (LoopOrder::First, Some(_)) | (LoopOrder::Second, _) => STEP_MAX,
    };
    let mut reference = reference.late(law.delay, rows[0].time);
    let mut simulated = Vec::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        if !steers(row) {
            (psi, rate) = (log.headings()[i] - law.compass_bias, 0.0);
        }
        simulated.push(Motion { heading: psi, yaw_rate: rate, ..Motion::default() });
        let Some(next) = rows.get(i + 1) else { break };
        let mut left = next.time - row.time;
        while SHORTEST < left {
            let (wanted, step) = reference.piece(left.min(step_max));
            left -= step;
            let crab = water.map_or(0.0, |water| crab(water, i, psi + 0.5 * rate * step));
            let error = wrap(wanted - crab - psi);
            psi += match law.order {
                LoopOrder::First => {
                    let turned = approached(error, law.time, law.rate_max, step);
                    rate = ((error - turned) / law.time).clamp(-law.rate_max, law.rate_max);
                    turned
                }
                LoopOrder::Second => turned(law, error, &mut rate, step),
            };
        }
    }
    let compass = |motion: &Motion| motion.heading + law.compass_bias;
    let predicted = simulated.iter().map(compass).collect();
    (simulated, predicted)
}

/// Crab angle of the current on heading `psi`, rad, between a row and the next. The sway of a turn
/// is left out: the loop's parameters contain it, and the turn would depend on itself.
fn crab(water: &Water, row: usize, psi: f64) -> f64 {
    let (now, next) = (&water.motion[row], &water.motion[row + 1]);
    let ground = direction(psi) * (0.5 * (now.surge + next.surge)) + water.current;
    if ground.norm() < COURSE_SPEED_MIN {
        return 0.0;
    }
    wrap(ground.y.atan2(ground.x) - psi)
}

/// Turn of a second-order loop in `step`, by two midpoint steps; updates the yaw rate.
fn turned(law: &Loop, error: f64, rate: &mut f64, step: f64) -> f64 {
    let omega = 1.0 / law.time;
    let acceleration =
        |angle: f64, rate: f64| omega * omega * (error - angle) - 2.0 * law.damping * omega * rate;
    let within = |rate: f64| rate.clamp(-law.rate_max, law.rate_max);
    let half = 0.5 * step;
    let mut turned = 0.0;
    for _ in 0..2 {
        let middle = *rate + 0.5 * half * acceleration(turned, *rate);
        let middle_angle = turned + 0.5 * half * within(*rate);
        turned += half * within(middle);
        *rate = within(*rate + half * acceleration(middle_angle, middle));
    }
    turned
}

/// Exact change of a first-order loop with that error in `step`, at most at `rate_max`.
///
/// ```text
/// ẋ = clamp(e/T, ±r),  ė = −ẋ:   r t until |e| = r T, then exponential
/// ```
pub(super) fn approached(error: f64, time_constant: f64, rate_max: f64, step: f64) -> f64 {
    let linear = rate_max * time_constant;
    let saturated = ((error.abs() - linear) / rate_max).clamp(0.0, step);
    let rest = error.abs() - rate_max * saturated;
    let gone = rate_max * saturated + rest * (1.0 - (-(step - saturated) / time_constant).exp());
    // If the whole step was saturated, `rest` has no weight.
    gone.copysign(error)
}

/// `true` if the craft makes way: without it, it does not answer.
fn steers(row: &LogRow) -> bool {
    0.0 < row.speed_reference
}

impl HeadingFit {
    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let [time, delay, rate_max] = [self.estimates[0], self.estimates[1], self.estimates[2]];
        let mut parameters = match self.order {
            LoopOrder::First => vec![time_constant(Quantity::HeadingTimeConstant, time)],
            LoopOrder::Second => {
                let frequency = Estimate { value: -time.value, ..time };
                vec![
                    positive(Quantity::HeadingNaturalFrequency, frequency),
                    positive(Quantity::HeadingDamping, self.estimates[4]),
                ]
            }
        };
        parameters.push(signed(Quantity::HeadingDelay, delay, 0.0));
        parameters.push(positive(Quantity::HeadingRateMax, rate_max));
        parameters
    }
}
