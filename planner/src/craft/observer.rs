//! Learning the craft from how it answered: one small filter for each loop, from one snapshot to the next.
//!
//! ```text
//! heading   x = (ψ, ln T, δ)    ψ⁺ = ψ + ∫ clamp((ψ_ref′ + δ − ψ)/T, ±r_max)                z = ψ
//! surge     x = (u, ln T_u, b)  u⁺ = u + ∫ clamp((u_ref′ − u)/T_u, −a_dec, a_acc) + b         z = u
//! drift     x = k_β             z = v = −k_β u r
//! current   x = c               z = (p − p⁻)/Δ − v_w                                          where no ground velocity is given
//! ```
//! ψ_ref′ and u_ref′ are the references behind a first-order lag as long as the loop's delay, which stands for it: a delay
//! itself would have to remember every reference. δ is what the heading stays off its reference: a loop without integrator,
//! a compass that is not aligned, the crab angle of a loop that holds a course.
//!
//! Extended Kalman filters: the loops are not linear in their time constants, and what a craft does not excite must keep
//! its prior, which a covariance says by itself and recursive least squares with a forgetting factor does not. Logarithms
//! keep time constants positive. Every time constant is pulled back to what was told in [`FORGETTING_TIME`], its variance
//! with it, so that an estimate is bounded and follows a craft that changes.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::{CraftModel, HeadingHeld, Monitor, Prior, Realised, SpeedHeld};
use crate::{
    angle::{ned_from_body, wrap},
    snapshot::{AscState, CURRENT_MAX, Observation},
};

/// Time in which an estimate that nothing feeds returns to what was told, s.
const FORGETTING_TIME: f64 = 1800.0;

/// Longest time between two snapshots over which a response is predicted, s; older memories start anew.
const INTERVAL_MAX: f64 = 10.0;

/// Shortest time between two snapshots from which anything is learnt, s.
const INTERVAL_MIN: f64 = 0.05;

/// Steps in which a response is predicted over one interval.
const SUBSTEPS: u32 = 4;

/// Least and largest time constant that is learnt, s.
const TIME_CONSTANT: std::ops::RangeInclusive<f64> = 0.2..=20.0;

/// Largest magnitude of a learnt drift in a turn, s, unless a larger one was told.
const DRIFT_MAX: f64 = 5.0;

/// Standard deviation of a heading about what the loop makes of its reference, rad: compass and waves.
const HEADING_NOISE: f64 = 0.04;
/// The same that stays from one second to the next, rad/√s.
const HEADING_WALK: f64 = 0.02;
/// Standard deviation of a speed through the water, m/s: speed log and waves.
const SPEED_NOISE: f64 = 0.03;
/// What moves the speed unforeseen, m/s/√s.
const SPEED_WALK: f64 = 0.01;
/// How a bias wanders, m/s²/√s. With 0.004, what a delay leaves is taken for a bias and the speed reference follows it: its
/// total variation is 1.2 times as much; with 0.001, an integrator that winds up is followed late, and some craft are twice
/// as far off a fast vehicle (random craft 1 to 24).
const BIAS_WALK: f64 = 0.002;
/// Standard deviation of a bias of which nothing is known, m/s².
const BIAS_SIGMA: f64 = 0.03;
/// Standard deviation of a sway through the water, m/s.
const SWAY_NOISE: f64 = 0.05;
/// Standard deviation of a position, m: a GNSS receiver's.
const POSITION_NOISE: f64 = 0.7;
/// Standard deviation of a current of which nothing is known, along an axis, m/s.
const CURRENT_SIGMA: f64 = 0.3;
/// How a current wanders, m/s/√s.
const CURRENT_WALK: f64 = 0.002;
/// Standard deviation below which a current found from positions is told, m/s.
const CURRENT_KNOWN: f64 = 0.1;
/// Innovations beyond this many variances are no noise.
const GATE: f64 = 25.0;
/// Standard deviation of what a heading stays off its reference, of which nothing is known, rad.
const OFFSET_SIGMA: f64 = 0.1;
/// How that wanders, rad/√s.
const OFFSET_WALK: f64 = 0.004;
/// Farthest that a heading is taken to stay off its reference, rad.
const OFFSET_MAX: f64 = 0.8;
/// Deviations by which a time constant may turn out other than told.
const PRIOR_DEVIATIONS: f64 = 4.0;
/// The least of the same, as a logarithm: a factor of 2.2.
const LOG_TIME_SPREAD_MIN: f64 = 0.8;
/// What a heading or course is off its reference where a loop holds it, rad.
const MODE_HEADING_SIGMA: f64 = 0.25;
/// What a speed is off its reference where a loop holds it, m/s.
const MODE_SPEED_SIGMA: f64 = 0.08;
/// Part of a log-likelihood that counts: errors of one second last for several.
const MODE_SHARE: f64 = 0.2;
/// Log-likelihood ratio from which a mode is taken for known: odds of 55 to 1.
const EVIDENCE_ENOUGH: f64 = 4.0;
/// Largest log-likelihood ratio that is remembered, so that a craft whose mode is switched is noticed.
pub(super) const EVIDENCE_MAX: f64 = 10.0;
/// Step of a finite difference; the states are of the order of 1.
const STEP: f64 = 1e-5;
/// Farthest that a filtered speed may be from a measured one, m/s.
const SPEED_DOUBT_MAX: f64 = 2.0;
/// Largest variance that is believed.
pub(super) const VARIANCE_MAX: f64 = 100.0;
/// Smallest variance that rounding leaves.
const VARIANCE_MIN: f64 = 1e-9;
/// A craft that is farther from where it was than this, and than this speed leads, is another or was carried.
const POSITION_JUMP: f64 = 20.0;
/// As above, m/s.
const SPEED_JUMP: f64 = 10.0;
/// Relative standard deviation of a loop's lag about that of the delay and the first-order lag that come nearest to it.
/// Measured on random craft that were told their step responses: the median error is 8 %, nine in ten are below 27 %.
const LAG_MODEL_ERROR: f64 = 0.15;
/// Largest crab angle that the heading of a craft that holds its course is allowed, rad.
const CRAB_MAX: f64 = 1.0;
/// Slower than this, m/s, a drift angle says nothing.
const SPEED_WITH_DRIFT: f64 = 0.15;

/// A number that is known to within a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Its mean.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
}

/// What is known of the craft's loops: from what was told, and from how it answered. Hand it back, and the next answer
/// knows more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraftEstimate {
    /// Heading as filtered, rad, the logarithm of its time constant in s, and its offset from the reference, rad.
    pub heading: Vector3<f64>,
    /// Covariance of the same.
    pub heading_covariance: Matrix3<f64>,
    /// Delays of the heading loop and of the speed loop, as told, s.
    pub delays: Vector2<f64>,
    /// Heading reference behind the loop's delay, rad.
    pub followed_heading: f64,
    /// Speed reference behind the loop's delay, m/s.
    pub followed_speed: f64,
    /// Heading and speed that the craft was told, whatever its loops hold, behind the loops' delays, rad and m/s.
    pub told: Vector2<f64>,
    /// Evidence that the heading loop holds the course over ground, and that the speed loop holds the speed over ground:
    /// a log-likelihood ratio each, bounded, 0 where nothing tells.
    pub evidence: Vector2<f64>,
    /// Surge speed as filtered, m/s, the logarithm of its time constant in s, and what the loop gives unasked, m/s².
    pub surge: Vector3<f64>,
    /// Covariance of the same.
    pub surge_covariance: Matrix3<f64>,
    /// Sway per surge and yaw rate k_β, s.
    pub drift: Gaussian,
    /// Current (north, east) found from positions and speed through the water, m/s.
    pub current: Vector2<f64>,
    /// Its variance along an axis, (m/s)².
    pub current_variance: f64,
    /// Position then (north, east), m.
    pub position: Vector2<f64>,
    /// Whether the craft does what is predicted.
    pub monitor: Monitor,
    /// How near the planner and the law kept it to its goal.
    pub realised: Realised,
}

/// What the loops were asked for since an earlier answer.
#[derive(Clone, Copy, Debug)]
struct Asked {
    heading: f64,
    speed: f64,
    /// What the craft was told, whatever its loops hold.
    told: Vector2<f64>,
    elapsed: f64,
}

impl CraftEstimate {
    /// What is known now: `observation` taken up into what the previous answer knew, or a start from what was told.
    #[must_use]
    pub fn new(observation: &Observation, prior: &Prior) -> Self {
        let start = || Self::start(observation, prior);
        let Some((before, asked)) = asked_since(observation) else {
            return start();
        };
        let jump = (before.position - observation.asc.position).norm();
        if jump > POSITION_JUMP + SPEED_JUMP * asked.elapsed {
            return start();
        }
        before.after(observation, prior, asked)
    }

    /// An estimate of nothing.
    pub(crate) fn nothing() -> Self {
        Self {
            heading: Vector3::zeros(),
            heading_covariance: Matrix3::zeros(),
            delays: Vector2::zeros(),
            followed_heading: 0.0,
            followed_speed: 0.0,
            told: Vector2::zeros(),
            evidence: Vector2::zeros(),
            surge: Vector3::zeros(),
            surge_covariance: Matrix3::zeros(),
            drift: Gaussian {
                mean: 0.0,
                variance: 0.0,
            },
            current: Vector2::zeros(),
            current_variance: 0.0,
            position: Vector2::zeros(),
            monitor: Monitor::NOTHING,
            realised: Realised::START,
        }
    }

    fn start(observation: &Observation, prior: &Prior) -> Self {
        let asc = &observation.asc;
        Self {
            heading: Vector3::new(asc.heading.radians(), prior.heading_lag.mean, 0.0),
            heading_covariance: Matrix3::from_diagonal(&Vector3::new(
                HEADING_NOISE * HEADING_NOISE,
                prior.heading_lag.variance,
                OFFSET_SIGMA * OFFSET_SIGMA,
            )),
            delays: prior.delays(),
            followed_heading: asc.heading.radians(),
            followed_speed: asc.surge,
            told: Vector2::new(asc.heading.radians(), asc.surge),
            evidence: Vector2::zeros(),
            surge: Vector3::new(asc.surge, prior.surge_lag.mean, 0.0),
            surge_covariance: Matrix3::from_diagonal(&Vector3::new(
                SPEED_NOISE * SPEED_NOISE,
                prior.surge_lag.variance,
                BIAS_SIGMA * BIAS_SIGMA,
            )),
            drift: prior.drift,
            current: Vector2::zeros(),
            current_variance: CURRENT_SIGMA * CURRENT_SIGMA,
            position: asc.position,
            monitor: Monitor::new(asc),
            realised: Realised::START,
        }
    }

    /// Time constant of the heading loop, s: the median, and its standard deviation.
    #[must_use]
    pub fn heading_time(&self) -> (f64, f64) {
        log_normal(self.heading.y, self.heading_covariance.m22)
    }

    /// Time constant of the speed loop, s: the median, and its standard deviation.
    #[must_use]
    pub fn surge_time(&self) -> (f64, f64) {
        log_normal(self.surge.y, self.surge_covariance.m22)
    }

    /// By how much the heading is behind a reference that turns steadily, s, and the standard deviation of that.
    #[must_use]
    pub fn heading_lag(&self) -> (f64, f64) {
        let (time, sigma) = self.heading_time();
        of_a_model(self.delays.x + time, sigma)
    }

    /// By how much the speed is behind a reference that rises steadily, s, and the standard deviation of that.
    #[must_use]
    pub fn surge_lag(&self) -> (f64, f64) {
        let (time, sigma) = self.surge_time();
        of_a_model(self.delays.y + time, sigma)
    }

    /// What the heading stays off its reference, rad, and its standard deviation.
    #[must_use]
    pub fn heading_offset(&self) -> (f64, f64) {
        (self.heading.z, self.heading_covariance.m33.sqrt())
    }

    /// Acceleration that the speed loop gives unasked, m/s², and its standard deviation.
    #[must_use]
    pub fn surge_bias(&self) -> (f64, f64) {
        (self.surge.z, self.surge_covariance.m33.sqrt())
    }

    /// Current found from positions (north, east), m/s, where it is known better than not at all.
    #[must_use]
    pub fn current_from_positions(&self) -> Option<Vector2<f64>> {
        (self.current_variance < CURRENT_KNOWN * CURRENT_KNOWN).then_some(self.current)
    }

    /// The filters a snapshot later.
    fn after(&self, observation: &Observation, prior: &Prior, asked: Asked) -> Self {
        let craft = CraftModel::new(&prior.craft, &observation.limits);
        let mut next = *self;
        next.position = observation.asc.position;
        next.delays = prior.delays();
        if asked.elapsed < INTERVAL_MIN {
            return next;
        }
        next.forget(prior, asked.elapsed);
        next.weigh_modes(observation, prior, &craft, asked);
        next.learn_heading(observation.asc.heading.radians(), &craft, asked, prior);
        next.learn_surge(observation.asc.surge, &craft, asked, prior);
        next.learn_drift(observation, prior, asked);
        next.learn_current(observation, &self.position, asked);
        let expected = next.monitored(prior, &craft);
        let crab = match next.modes(prior).0 {
            HeadingHeld::Course => {
                (observation.current().norm() / observation.asc.surge.max(SPEED_WITH_DRIFT)).min(CRAB_MAX)
            }
            HeadingHeld::Heading => 0.0,
        };
        let asked_for = (asked.heading, asked.speed);
        next.monitor = self
            .monitor
            .after(observation, &expected, crab, asked_for, asked.elapsed);
        next
    }

    /// The craft that the monitor compares with: as it was told, else as it is learnt.
    fn monitored(&self, prior: &Prior, craft: &CraftModel) -> CraftModel {
        let lag = |told: bool, prior: f64, learnt: f64| if told { prior } else { learnt }.exp();
        CraftModel {
            heading_time: lag(prior.heading_told, prior.heading_lag.mean, self.heading.y),
            surge_time: lag(prior.surge_told, prior.surge_lag.mean, self.surge.y),
            surge_bias: self.surge.z,
            ..*craft
        }
    }

    /// Pulls what is not excited back to what was told.
    fn forget(&mut self, prior: &Prior, elapsed: f64) {
        let share = 1.0 - (-elapsed / FORGETTING_TIME).exp();
        self.heading.y += share * (prior.heading_lag.mean - self.heading.y);
        self.heading_covariance.m22 += share * (prior.heading_lag.variance - self.heading_covariance.m22);
        self.surge.y += share * (prior.surge_lag.mean - self.surge.y);
        self.surge_covariance.m22 += share * (prior.surge_lag.variance - self.surge_covariance.m22);
        self.drift.mean += share * (prior.drift.mean - self.drift.mean);
        self.drift.variance += share * (prior.drift.variance - self.drift.variance);
    }

    /// What the loops hold, where it is not told: of what was told, is the heading or the course nearer, the speed through
    /// the water or the one over ground along the bow? Over still water there is no telling, and no need.
    fn weigh_modes(&mut self, observation: &Observation, prior: &Prior, craft: &CraftModel, asked: Asked) {
        let asc = &observation.asc;
        self.told.x += behind(craft.heading_lag(), asked.elapsed) * wrap(asked.told.x - self.told.x);
        self.told.x = wrap(self.told.x);
        self.told.y += behind(craft.surge_lag(), asked.elapsed) * (asked.told.y - self.told.y);
        let drifting = || {
            let current = observation.current.or_else(|| self.current_from_positions())?;
            Some(asc.water_velocity() + current)
        };
        let ground = asc.ground_velocity.or_else(drifting);
        let Some(ground) = ground.filter(|ground| ground.norm() > SPEED_WITH_DRIFT) else {
            return;
        };
        let heading = wrap(self.told.x - asc.heading.radians());
        let course = wrap(self.told.x - crate::angle::angle_of(&ground));
        let speed = self.told.y - asc.surge;
        let over_ground = self.told.y - ground.dot(&asc.heading.unit());
        let before = self.modes(prior);
        let gain = Vector2::new(
            (heading * heading - course * course) / (2.0 * MODE_HEADING_SIGMA * MODE_HEADING_SIGMA),
            (speed * speed - over_ground * over_ground) / (2.0 * MODE_SPEED_SIGMA * MODE_SPEED_SIGMA),
        );
        // Errors of a second last for several: each counts for a part.
        let gain = gain.map(|gain| gain.clamp(-1.0, 1.0) * MODE_SHARE * asked.elapsed);
        self.evidence = (self.evidence + gain).map(|evidence| evidence.clamp(-EVIDENCE_MAX, EVIDENCE_MAX));
        let after = self.modes(prior);
        if after.0 != before.0 {
            self.heading.z = 0.0;
            self.heading_covariance.m33 = OFFSET_SIGMA * OFFSET_SIGMA;
            self.heading_covariance.m13 = 0.0;
            self.heading_covariance.m31 = 0.0;
            self.heading_covariance.m23 = 0.0;
            self.heading_covariance.m32 = 0.0;
            self.heading.y = prior.heading_lag.mean;
        }
        if after.1 != before.1 {
            self.surge.z = 0.0;
        }
    }

    /// What the loops hold: as told, else as the evidence says.
    #[must_use]
    pub fn modes(&self, prior: &Prior) -> (HeadingHeld, SpeedHeld) {
        let heading = match prior.heading_held {
            Some(held) => held,
            None if EVIDENCE_ENOUGH < self.evidence.x => HeadingHeld::Course,
            None => HeadingHeld::Heading,
        };
        let speed = match prior.speed_held {
            Some(held) => held,
            None if EVIDENCE_ENOUGH < self.evidence.y => SpeedHeld::OverGround,
            None => SpeedHeld::ThroughWater,
        };
        (heading, speed)
    }

    fn learn_heading(&mut self, measured: f64, craft: &CraftModel, asked: Asked, prior: &Prior) {
        let ahead = wrap(asked.heading - self.followed_heading);
        let followed = self.followed_heading + behind(craft.heading_delay, asked.elapsed) * ahead;
        self.followed_heading = wrap(followed);
        let predict = |state: &Vector3<f64>| {
            let error = wrap(followed + state.z - state.x);
            let turned = heading_change(error, state.y.exp(), craft.limits.turn_rate_max, asked.elapsed);
            Vector3::new(state.x + turned, state.y, state.z)
        };
        let (predicted, mut covariance) = propagated(predict, &self.heading, &self.heading_covariance);
        covariance.m11 += HEADING_WALK * HEADING_WALK * asked.elapsed;
        covariance.m33 += OFFSET_WALK * OFFSET_WALK * asked.elapsed;
        let innovation = wrap(measured - predicted.x);
        let variance = covariance.m11 + HEADING_NOISE * HEADING_NOISE;
        if innovation * innovation > GATE * variance {
            // Turned by something else: the heading is believed, the loop learns nothing.
            self.heading.x = measured;
            return;
        }
        let gain = covariance.column(0) / variance;
        let state = predicted + gain * innovation;
        self.heading = Vector3::new(
            wrap(state.x),
            within_reason(state.y, &prior.heading_lag),
            state.z.clamp(-OFFSET_MAX, OFFSET_MAX),
        );
        self.heading_covariance = symmetric(&(covariance - gain * covariance.row(0)));
    }

    fn learn_surge(&mut self, measured: f64, craft: &CraftModel, asked: Asked, prior: &Prior) {
        let share = behind(craft.surge_delay, asked.elapsed);
        self.followed_speed += share * (asked.speed - self.followed_speed);
        let followed = self.followed_speed;
        let predict = |state: &Vector3<f64>| {
            let model = CraftModel {
                surge_time: state.y.exp(),
                ..*craft
            };
            let (speed, bias) = surge_after(state.x, state.z, followed, &model, asked.elapsed);
            Vector3::new(speed, state.y, bias)
        };
        let (predicted, mut covariance) = propagated(predict, &self.surge, &self.surge_covariance);
        covariance.m11 += SPEED_WALK * SPEED_WALK * asked.elapsed;
        covariance.m33 += BIAS_WALK * BIAS_WALK * asked.elapsed;
        let innovation = measured - predicted.x;
        let variance = covariance.m11 + SPEED_NOISE * SPEED_NOISE;
        let gain = covariance.column(0) / variance;
        // One wild reading of a speed log moves the filter by no more than a plausible one.
        let most = (GATE * variance).sqrt();
        let state = predicted + gain * innovation.clamp(-most, most);
        let bias_most = craft.surge_bias_max();
        self.surge = Vector3::new(
            state
                .x
                .clamp(measured - SPEED_DOUBT_MAX, measured + SPEED_DOUBT_MAX),
            within_reason(state.y, &prior.surge_lag),
            state.z.clamp(-bias_most, bias_most),
        );
        self.surge_covariance = symmetric(&(covariance - gain * covariance.row(0)));
    }

    /// Sway as measured; where it is not, as the velocity over ground across the bow says, less a known current.
    fn learn_drift(&mut self, observation: &Observation, prior: &Prior, asked: Asked) {
        let asc = &observation.asc;
        let across = || {
            let through_water = asc.ground_velocity? - observation.current?;
            Some((ned_from_body(asc.heading.radians()).transpose() * through_water).y)
        };
        let Some(sway) = measured_sway(asc)
            .or_else(across)
            .filter(|_| asc.surge.abs() > SPEED_WITH_DRIFT)
        else {
            return;
        };
        let slope = -asc.surge * asc.yaw_rate;
        // A reading a second is no independent one: drift errors last as long as a wave.
        let noise = SWAY_NOISE * SWAY_NOISE / asked.elapsed.min(1.0);
        let variance = slope * slope * self.drift.variance + noise;
        let gain = self.drift.variance * slope / variance;
        let most = DRIFT_MAX.max(prior.drift.mean.abs());
        let mean = self.drift.mean + gain * (sway - slope * self.drift.mean);
        self.drift = Gaussian {
            mean: mean.clamp(-most, most),
            variance: (1.0 - gain * slope) * self.drift.variance,
        };
    }

    fn learn_current(&mut self, observation: &Observation, before: &Vector2<f64>, asked: Asked) {
        let asc = &observation.asc;
        let over_ground = (asc.position - before) / asked.elapsed;
        let sway = measured_sway(asc).unwrap_or(-self.drift.mean * asc.surge * asc.yaw_rate);
        // The mean heading and speed of the interval: both ends as measured and as filtered then.
        let psi = asc.heading.radians() - 0.5 * asc.yaw_rate * asked.elapsed;
        let seen = over_ground - ned_from_body(psi) * Vector2::new(asc.surge, sway);
        let variance = self.current_variance + CURRENT_WALK * CURRENT_WALK * asked.elapsed;
        // Errors of two positions after one another cancel over time; taken for independent, they are overrated.
        let noise = 2.0 * (POSITION_NOISE / asked.elapsed).powi(2);
        let gain = variance / (variance + noise);
        let current = self.current + (seen - self.current) * gain;
        self.current = current.map(|axis| axis.clamp(-CURRENT_MAX, CURRENT_MAX));
        self.current_variance = (1.0 - gain) * variance;
    }
}

/// What the previous answer knew, and what it asked for since, where it is young enough to tell anything.
fn asked_since(observation: &Observation) -> Option<(CraftEstimate, Asked)> {
    let previous = observation.previous_plan.as_ref()?;
    let estimate = previous.craft?;
    let asked = Asked {
        heading: previous.reference?.heading.radians(),
        speed: previous.reference?.speed,
        told: previous
            .told
            .map(|told| Vector2::new(told.heading.radians(), told.speed))?,
        elapsed: observation.time - previous.trajectory.first()?.time,
    };
    (0.0..=INTERVAL_MAX)
        .contains(&asked.elapsed)
        .then_some((estimate, asked))
}

/// Sway through the water, m/s. No sensor reads exactly 0: that stands for one that is left out.
fn measured_sway(asc: &AscState) -> Option<f64> {
    (asc.sway != 0.0).then_some(asc.sway)
}

/// The part of the way to a reference that a lag of `delay` goes in `elapsed`.
fn behind(delay: f64, elapsed: f64) -> f64 {
    if delay > 0.0 {
        1.0 - (-elapsed / delay).exp()
    } else {
        1.0
    }
}

/// A time constant's logarithm, no farther from what was told than that may be wrong.
fn within_reason(log_time: f64, prior: &Gaussian) -> f64 {
    let most = (PRIOR_DEVIATIONS * prior.variance.sqrt()).max(LOG_TIME_SPREAD_MIN);
    let (least, largest) = TIME_CONSTANT.into_inner();
    log_time
        .clamp(prior.mean - most, prior.mean + most)
        .clamp(least.ln(), largest.ln())
}

/// Mean and covariance after `predict`, by its finite differences.
fn propagated(
    predict: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    state: &Vector3<f64>,
    covariance: &Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let mut jacobian = Matrix3::zeros();
    for column in 0..3 {
        let mut step = Vector3::zeros();
        step[column] = STEP;
        let slope = (predict(&(state + step)) - predict(&(state - step))) / (2.0 * STEP);
        jacobian.set_column(column, &slope);
    }
    (predict(state), jacobian * covariance * jacobian.transpose())
}

/// By how much a heading changes in `elapsed` that is `error` from its reference, rad.
pub(super) fn heading_change(error: f64, lag: f64, rate_max: f64, elapsed: f64) -> f64 {
    let linear = rate_max * lag;
    let sign = error.signum();
    let error = error.abs();
    // At the rate limit until the loop's linear range begins, then exponentially.
    let limited = ((error - linear) / rate_max).clamp(0.0, elapsed);
    let left = error - rate_max * limited;
    sign * (rate_max * limited + left * (1.0 - (-(elapsed - limited) / lag.max(1e-3)).exp()))
}

/// Speed and bias after `elapsed` on a speed reference.
pub(super) fn surge_after(
    speed: f64,
    bias: f64,
    reference: f64,
    craft: &CraftModel,
    elapsed: f64,
) -> (f64, f64) {
    let dt = elapsed / f64::from(SUBSTEPS);
    let limits = &craft.limits;
    (0..SUBSTEPS).fold((speed, bias), |(speed, bias), _| {
        let asked = (reference - speed) / (craft.surge_time.max(0.5 * dt) + 0.5 * dt);
        let loop_gives = asked.clamp(-limits.deceleration_max, limits.acceleration_max);
        let gathered = craft
            .integral_time
            .map_or(0.0, |time| loop_gives * (1.0 - (-dt / time).exp()));
        (speed + dt * (loop_gives + bias), bias + gathered)
    })
}

/// A lag and its standard deviation as an estimate's, which is of a delay and a first-order lag: that of the loop too.
fn of_a_model(lag: f64, sigma: f64) -> (f64, f64) {
    (lag, sigma.hypot(LAG_MODEL_ERROR * lag))
}

fn log_normal(mean: f64, variance: f64) -> (f64, f64) {
    let median = mean.exp();
    (median, median * variance.max(0.0).sqrt())
}

fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let mut matrix = (matrix + matrix.transpose()) * 0.5;
    // A covariance that has grown without bound knows nothing: all of it shrinks, so that it stays one.
    let largest = matrix.m11.max(matrix.m22).max(matrix.m33);
    if VARIANCE_MAX < largest {
        matrix *= VARIANCE_MAX / largest;
    }
    for i in 0..3 {
        matrix[(i, i)] = matrix[(i, i)].max(VARIANCE_MIN);
    }
    matrix
}
