//! The speed loop's parameters, sway in turns, and the kind of speed.

use nalgebra::Vector2;
use planner::{angle::direction, craft::SpeedReference};
use sim::metrics::{mean, rms};

use super::fit::{self, Channels, Estimate, Fitted, least_squares, nearest};
use super::heading::{Motion, SHORTEST, Water, approached, begin};
use super::log::{Log, LogRow};
use super::parameter::{
    Parameter, Quantity, RELATIVE_WIDTH_MAX, SLOW_INTEGRAL_TIME, positive, signed, time_constant,
};
use super::reference::HeldReference;

/// Longest step of the simulation, s.
const STEP_MAX: f64 = 0.2;
/// Time constants and delays of the initial guesses, s; the best one is taken.
const STARTS: [f64; 5] = [0.7, 1.5, 3.0, 6.0, 12.0];
const DELAYS: [f64; 2] = [0.1, 1.0];
/// Least residual of a channel's weight, m/s: a channel without noise must not outweigh all others.
const RESIDUAL_MIN: f64 = 1e-4;
/// Above this yaw rate, rad/s, a craft loses speed, which the speed loop's model does not contain,
/// and recovers for this long, s. Assumption; the MEDUSA loses half its speed in a turn of 160°.
const TURNING: f64 = 0.05;
const RECOVERY: f64 = 20.0;
/// With less time on straight courses than this, turns are used too, s.
const STRAIGHT_MIN: f64 = 120.0;
/// Kinds of measurements: logged surge and sway, ground velocity along the bow and to starboard.
const N_CHANNELS: usize = 4;

/// Indices of the parameters: ln T, t_d, ln a_acc, ln a_dec, k_β, 1/T_i, ln T_v, and with ground
/// velocity the current and the compass bias. The sway's lag T_v is a nuisance parameter: sway
/// builds up in a second or two, and without the lag k_β would be that of quick turns.
const TIME_CONSTANT: usize = 0;
const DELAY: usize = 1;
const ACCELERATION: usize = 2;
const DECELERATION: usize = 3;
const SWAY: usize = 4;
const INTEGRAL_RATE: usize = 5;
const SWAY_LAG: usize = 6;
const CURRENT_NORTH: usize = 7;
const CURRENT_EAST: usize = 8;
const COMPASS_BIAS: usize = 9;
/// Shortest and longest lag of sway, s.
const SWAY_LAGS: std::ops::RangeInclusive<f64> = 0.05..=20.0;

/// The speed loop with the best fit.
pub(super) struct SurgeFit {
    estimates: Vec<Estimate>,
    integrator: Parameter,
    /// Speed through the water or over ground, if the log shows it.
    pub(super) speed_held: Option<SpeedReference>,
    /// Motion through the water at each row.
    pub(super) simulated: Vec<Motion>,
    /// The same with the current, if there is ground velocity.
    pub(super) water: Option<Water>,
    pub(super) measured_surge: Vec<Option<f64>>,
    pub(super) measured_sway: Vec<Option<f64>>,
    /// Root mean square of measured less simulated surge, m/s.
    pub(super) rms: f64,
}

/// A log, prepared for the fit.
struct Data<'a> {
    log: &'a Log,
    reference: HeldReference,
    /// True heading and yaw rate at each row.
    heading: &'a [Motion],
    begin: usize,
    has_ground: bool,
    /// Rows in which the craft goes straight: surge is fitted there only.
    straight: Vec<bool>,
}

#[derive(Clone, Copy, Debug)]
struct Loop {
    held: SpeedReference,
    time: f64,
    delay: f64,
    acceleration_max: f64,
    deceleration_max: f64,
    sway_per_yaw_rate: f64,
    sway_lag: f64,
    integral_rate: f64,
    current: Vector2<f64>,
    compass_bias: f64,
}

/// The fitted model: residuals by kind of measurement.
#[derive(Clone, Copy, Debug)]
struct Model {
    held: SpeedReference,
    /// `true` if the loop has an integral part.
    integrates: bool,
    weights: [f64; N_CHANNELS],
}

impl Loop {
    fn of(held: SpeedReference, parameters: &[f64]) -> Self {
        let ground = |i: usize| parameters.get(i).copied().unwrap_or(0.0);
        Self {
            held,
            time: parameters[TIME_CONSTANT].exp(),
            delay: parameters[DELAY],
            acceleration_max: parameters[ACCELERATION].exp(),
            deceleration_max: parameters[DECELERATION].exp(),
            sway_per_yaw_rate: parameters[SWAY],
            sway_lag: parameters[SWAY_LAG].exp().clamp(*SWAY_LAGS.start(), *SWAY_LAGS.end()),
            integral_rate: parameters[INTEGRAL_RATE],
            current: Vector2::new(ground(CURRENT_NORTH), ground(CURRENT_EAST)),
            compass_bias: ground(COMPASS_BIAS),
        }
    }
}

/// Fits the speed loop of a craft with the motion `heading`.
pub(super) fn fit(log: &Log, heading: &[Motion]) -> SurgeFit {
    let data = Data {
        log,
        reference: HeldReference::speeds(log),
        heading,
        begin: begin(log),
        has_ground: log.rows().iter().any(|row| row.ground_velocity.is_some()),
        straight: straight(log, heading),
    };
    // In rounds: the first shows the noise of each kind of measurement.
    let mut model =
        Model { held: SpeedReference::ThroughWater, integrates: true, weights: [1.0; N_CHANNELS] };
    let mut through_water = data.fit(&model, &data.start(&model));
    let mut over_ground = through_water.clone();
    for _ in 0..2 {
        let (best, held) = if through_water.sum_of_squares <= over_ground.sum_of_squares {
            (&through_water, SpeedReference::ThroughWater)
        } else {
            (&over_ground, SpeedReference::OverGround)
        };
        model.weights = data.weights(&Model { held, ..model }, best);
        through_water = data.fit(&model, &through_water.parameters);
        if data.has_ground {
            let held = SpeedReference::OverGround;
            over_ground = data.fit(&Model { held, ..model }, &over_ground.parameters);
        }
    }
    let better = data.has_ground.then(|| fit::better(&through_water, &over_ground));
    let speed_held = better.flatten().map(|through_water| {
        if through_water { SpeedReference::ThroughWater } else { SpeedReference::OverGround }
    });
    model.held = speed_held.unwrap_or(SpeedReference::ThroughWater);
    let mut fitted = match model.held {
        SpeedReference::ThroughWater => through_water,
        SpeedReference::OverGround => over_ground,
    };
    let mut estimates = data.estimates(&model, &fitted);
    let integrator = integrator(estimates[INTEGRAL_RATE]);
    if !(integrator.identified && integrator.estimate.is_finite()) {
        model.integrates = false;
        fitted = data.fit(&model, &fitted.parameters);
        estimates = data.estimates(&model, &fitted);
    }
    let law = Loop::of(model.held, &fitted.parameters);
    data.finish(&law, estimates, integrator, speed_held)
}

/// Rows in which the craft has gone straight for a while; all rows if it hardly ever does.
fn straight(log: &Log, heading: &[Motion]) -> Vec<bool> {
    let rows = log.rows();
    let mut turned_at = f64::NEG_INFINITY;
    let mut straight = Vec::with_capacity(rows.len());
    let mut time_straight = 0.0;
    for (i, row) in rows.iter().enumerate() {
        if TURNING < heading[i].yaw_rate.abs() {
            turned_at = row.time;
        }
        straight.push(turned_at + RECOVERY < row.time);
        if straight[i] && 0 < i {
            time_straight += row.time - rows[i - 1].time;
        }
    }
    if time_straight < STRAIGHT_MIN {
        straight.fill(true);
    }
    straight
}

/// The integral time: infinite if the log shows no integrator, not identified if that is open.
fn integrator(rate: Estimate) -> Parameter {
    let half = fit::QUANTILE * rate.sigma;
    let (low, high) = (rate.value - half, rate.value + half);
    let time = |rate: f64| if 0.0 < rate { 1.0 / rate } else { f64::INFINITY };
    let (estimate, identified) = if high < 1.0 / SLOW_INTEGRAL_TIME {
        (f64::INFINITY, true)
    } else {
        (time(rate.value), half < RELATIVE_WIDTH_MAX * rate.value)
    };
    Parameter { quantity: Quantity::IntegralTime, estimate, low: time(high), high: time(low), identified }
}

impl Data<'_> {
    fn start(&self, model: &Model) -> Vec<f64> {
        let (acceleration, deceleration) = self.strongest();
        let limits = [(0.8 * acceleration).ln(), (0.8 * deceleration).ln()];
        let current = self.has_ground.then(|| self.rough_current());
        let start = |time: f64, delay: f64| {
            let mut start = vec![time.ln(), delay, limits[0], limits[1], 0.5, 0.0, 0.0];
            start.extend(current.iter().flat_map(|current| [current.x, current.y, 0.0]));
            start
        };
        let starts = STARTS.into_iter();
        let starts = starts.flat_map(|time| DELAYS.map(|delay| start(time, delay)));
        nearest(|p| self.residuals(model, p).0, starts)
    }

    fn fit(&self, model: &Model, start: &[f64]) -> Fitted {
        least_squares(|p| self.residuals(model, p).0, start)
    }

    fn estimates(&self, model: &Model, fitted: &Fitted) -> Vec<Estimate> {
        let (_, channels) = self.residuals(model, &fitted.parameters);
        fit::estimates(|p| self.residuals(model, p).0, fitted, &channels)
    }

    /// Weighted residuals by kind of measurement, and the range of each kind.
    fn residuals(&self, model: &Model, parameters: &[f64]) -> (Vec<f64>, Channels) {
        type Seen = fn(&LogRow, &Motion, &Loop) -> Option<f64>;
        let mut law = Loop::of(model.held, parameters);
        if !model.integrates {
            law.integral_rate = 0.0;
        }
        let motion = self.simulate(&law);
        let kinds: [Seen; N_CHANNELS] = [
            |row, motion, _| Some(row.surge? - motion.surge),
            |row, motion, _| Some(row.sway? - motion.sway),
            |row, motion, law| Some(ground_in_body(row, law)?.x - motion.surge),
            |row, motion, law| {
                Some(ground_in_body(row, law)?.y - motion.sway + law.compass_bias * motion.surge)
            },
        ];
        let (mut residuals, mut channels) = (Vec::new(), Vec::new());
        let of_surge = [true, false, true, false];
        for ((kind, weight), of_surge) in kinds.iter().zip(model.weights).zip(of_surge) {
            let from = residuals.len();
            let rows = self.log.rows().iter().zip(&motion).zip(&self.straight);
            let rows = rows.skip(self.begin).filter(|(_, straight)| !of_surge || **straight);
            residuals.extend(rows.filter_map(|((row, motion), _)| Some(weight * kind(row, motion, &law)?)));
            channels.push(from..residuals.len());
        }
        (residuals, channels)
    }

    /// Weights that give all kinds of measurements equal noise.
    fn weights(&self, model: &Model, fitted: &Fitted) -> [f64; N_CHANNELS] {
        let (_, channels) = self.residuals(model, &fitted.parameters);
        let mut weights = model.weights;
        for ((weight, channel), before) in weights.iter_mut().zip(&channels).zip(model.weights) {
            if !channel.is_empty() {
                let rms = rms(&fitted.residuals[channel.clone()]) / before;
                *weight = 1.0 / rms.max(RESIDUAL_MIN);
            }
        }
        weights
    }

    /// ```text
    /// u̇ = clamp((u_ref(t − t_d) − u_held)/T, −a_dec, a_acc) + b
    /// ḃ = (u̇ − b)/T_i,   T_v v̇ = −k_β u r − v
    /// ```
    fn simulate(&self, law: &Loop) -> Vec<Motion> {
        let rows = self.log.rows();
        let (mut u, mut bias, mut v) = (self.first_surge(law), 0.0, 0.0);
        let mut reference = self.reference.late(law.delay, rows[0].time);
        let mut simulated = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let heading = self.heading[i];
            simulated.push(Motion { surge: u, sway: v, ..heading });
            let Some(next) = rows.get(i + 1) else { break };
            let between = 0.5 * (heading.heading + self.heading[i + 1].heading);
            let pushed = match law.held {
                SpeedReference::ThroughWater => 0.0,
                SpeedReference::OverGround => law.current.dot(&direction(between)),
            };
            let turned = self.heading[i + 1].heading - heading.heading;
            let interval = next.time - row.time;
            let steady = -law.sway_per_yaw_rate * u * turned / interval;
            v += (steady - v) * (1.0 - (-interval / law.sway_lag).exp());
            let mut left = interval;
            while SHORTEST < left {
                let (wanted, step) = reference.piece(left.min(STEP_MAX));
                left -= step;
                let error = wanted - pushed - u;
                let limit = if error < 0.0 { law.deceleration_max } else { law.acceleration_max };
                // The bias has changed the speed by this in the middle of the step.
                let carried = 0.5 * bias * step;
                let asked = approached(error - carried, law.time, limit, step);
                let gathered = asked * law.integral_rate;
                u += asked + (bias + 0.5 * gathered) * step;
                bias += gathered;
            }
        }
        simulated
    }

    /// Surge over the first two seconds, m/s.
    fn first_surge(&self, law: &Loop) -> f64 {
        const OVER: f64 = 2.0;
        let rows = self.log.rows();
        let first = rows.iter().take_while(|row| row.time < rows[0].time + OVER);
        let surge = first.filter_map(|row| row.surge.or(Some(ground_in_body(row, law)?.x)));
        mean(&surge.collect::<Vec<_>>())
    }

    /// Mean of velocity over ground less the references', (north, east), m/s.
    fn rough_current(&self) -> Vector2<f64> {
        let excess = self.log.rows().iter().filter_map(|row| {
            let speed = row.surge.unwrap_or(row.speed_reference);
            Some(row.ground_velocity? - direction(row.heading) * speed)
        });
        let (sum, count) = excess.fold((Vector2::zeros(), 0.0), |(sum, count), v| (sum + v, count + 1.0));
        sum / f64::max(count, 1.0)
    }

    /// Largest logged acceleration and deceleration between means over two seconds, m/s².
    fn strongest(&self) -> (f64, f64) {
        const OVER: f64 = 2.0;
        let still = Loop::of(SpeedReference::ThroughWater, &[0.0; 7]);
        let rows = self.log.rows();
        let surge = |row: &LogRow| row.surge.or(Some(ground_in_body(row, &still)?.x));
        let window = |from: f64, until: f64| {
            let first = rows.partition_point(|row| row.time < from);
            let end = rows.partition_point(|row| row.time < until);
            mean(&rows[first..end].iter().filter_map(surge).collect::<Vec<_>>())
        };
        let (begin, end) = (rows[0].time, rows[rows.len() - 1].time);
        let (mut up, mut down) = (0.01_f64, 0.01_f64);
        let mut time = begin + OVER;
        while time + OVER < end {
            let change = (window(time, time + OVER) - window(time - OVER, time)) / OVER;
            up = up.max(change);
            down = down.max(-change);
            time += 0.5 * OVER;
        }
        (up, down)
    }

    fn finish(
        &self,
        law: &Loop,
        estimates: Vec<Estimate>,
        integrator: Parameter,
        speed_held: Option<SpeedReference>,
    ) -> SurgeFit {
        let mut law = *law;
        if !integrator.identified {
            law.integral_rate = 0.0;
        }
        let law = &law;
        let simulated = self.simulate(law);
        let rows = self.log.rows();
        let surge = |row: &LogRow| row.surge.or(Some(ground_in_body(row, law)?.x));
        let measured_surge: Vec<_> = rows.iter().map(surge).collect();
        let measured_sway = rows.iter().zip(&simulated).map(|(row, motion)| {
            let ground = || Some(ground_in_body(row, law)?.y + law.compass_bias * motion.surge);
            row.sway.or_else(ground)
        });
        let errors = measured_surge.iter().zip(&simulated).zip(&self.straight);
        let errors = errors.skip(self.begin).filter(|(_, straight)| **straight);
        let errors = errors.filter_map(|((measured, motion), _)| Some((*measured)? - motion.surge));
        SurgeFit {
            rms: rms(&errors.collect::<Vec<_>>()),
            measured_sway: measured_sway.collect(),
            measured_surge,
            water: self.has_ground.then(|| Water { current: law.current, motion: simulated.clone() }),
            simulated,
            speed_held,
            integrator,
            estimates,
        }
    }
}

/// Measured velocity over ground less the current, along the measured bow and to starboard, m/s.
fn ground_in_body(row: &LogRow, law: &Loop) -> Option<Vector2<f64>> {
    let through_water = row.ground_velocity? - law.current;
    let bow = direction(row.heading);
    Some(Vector2::new(through_water.dot(&bow), bow.perp(&through_water)))
}

impl SurgeFit {
    pub(super) fn parameters(&self) -> Vec<Parameter> {
        vec![
            time_constant(Quantity::SurgeTimeConstant, self.estimates[TIME_CONSTANT]),
            signed(Quantity::SurgeDelay, self.estimates[DELAY], 0.0),
            positive(Quantity::AccelerationMax, self.estimates[ACCELERATION]),
            positive(Quantity::DecelerationMax, self.estimates[DECELERATION]),
            self.integrator,
            signed(Quantity::SwayPerYawRate, self.estimates[SWAY], f64::NEG_INFINITY),
        ]
    }

    /// Current (north, east) with standard deviations, m/s.
    pub(super) fn current(&self) -> Option<[(f64, f64); 2]> {
        let component = |i: usize| Some((self.estimates.get(i)?.value, self.estimates.get(i)?.sigma));
        Some([component(CURRENT_NORTH)?, component(CURRENT_EAST)?])
    }

    /// Compass bias with its standard deviation, rad.
    pub(super) fn compass_bias(&self) -> Option<(f64, f64)> {
        let bias = self.estimates.get(COMPASS_BIAS)?;
        Some((bias.value, bias.sigma))
    }
}
