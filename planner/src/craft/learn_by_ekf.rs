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
//! keep time constants positive. Every time constant is pulled back to its prior in [`FORGETTING_TIME`], its variance
//! with it, so that an estimate is bounded and follows a craft that changes.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::{
    craft::{
        closed_loop::HeadingReference,
        covariance::{propagated, sound},
        effect::{self, Effect},
        estimate::CraftEstimate,
        model::CraftModel,
        monitor::{Monitor, Realised},
        one_step::{heading_change, surge_after},
        prior::{Gaussian, Prior},
    },
    facts::{
        angle::{ned_from_body, wrap},
        asc::{Asc, Limits},
        ranges::CURRENT_MAX,
    },
};

/// Time in which an estimate that nothing feeds returns to its prior, s.
const FORGETTING_TIME: f64 = 1800.0;

/// Longest time between two snapshots over which a response is predicted, s; older memories start anew.
const INTERVAL_MAX: f64 = 10.0;

/// Shortest time between two snapshots from which anything is learnt, s.
const INTERVAL_MIN: f64 = 0.05;

/// Least and largest time constant that is learnt, s.
const TIME_CONSTANT: std::ops::RangeInclusive<f64> = 0.2..=20.0;

/// Largest magnitude of a learnt drift in a turn, s, unless a larger one is declared.
const DRIFT_MAX: f64 = 5.0;

/// Standard deviation of a heading about what the loop makes of its reference, rad: compass and waves.
const HEADING_NOISE: f64 = 0.04;

/// The same that stays from one second to the next, rad/√s.
const HEADING_WALK: f64 = 0.02;

/// Standard deviation of a speed through the water, m/s: speed log and waves.
const SPEED_NOISE: f64 = 0.03;

/// What moves the speed unforeseen, m/s/√s.
const SPEED_WALK: f64 = 0.01;

/// How a surge disturbance wanders, m/s²/√s: between following what a delay leaves and following a wound-up integrator
/// late; see `docs/rationale.md#learning-the-craft`.
const DISTURBANCE_WALK: f64 = 0.002;

/// Standard deviation of a disturbance of which nothing is known, m/s².
const DISTURBANCE_SIGMA: f64 = 0.03;

/// Standard deviation of a sway through the water, m/s.
const SWAY_NOISE: f64 = 0.05;

/// Standard deviation of a position, m: a GNSS receiver's.
const POSITION_NOISE: f64 = 0.7;

/// Standard deviation of a current of which nothing is known, along an axis, m/s.
const CURRENT_SIGMA: f64 = 0.3;

/// How a current wanders, m/s/√s.
const CURRENT_WALK: f64 = 0.002;

/// Innovations beyond this many variances are no noise.
const GATE: f64 = 25.0;

/// Standard deviation of what a heading stays off its reference, of which nothing is known, rad.
pub(super) const OFFSET_SIGMA: f64 = 0.1;

/// How that wanders, rad/√s.
const OFFSET_WALK: f64 = 0.004;

/// Farthest that a heading is taken to stay off its reference, rad.
const OFFSET_MAX: f64 = 0.8;

/// Farthest that a speed stays off its reference for a learnt disturbance before that is taken for a fault, m/s.
const SPEED_OFFSET_BELIEVED: f64 = 0.05;

/// Farthest that a filtered speed may be from a measured one, m/s.
const FILTERED_SPEED_ERROR_MAX: f64 = 2.0;

/// A craft that is farther from where it was than this, and than this speed leads, is another or was carried.
const POSITION_JUMP: f64 = 20.0;

/// As above, m/s.
const SPEED_JUMP: f64 = 10.0;

/// Largest crab angle that the heading of a craft that holds its course is allowed, rad.
const CRAB_MAX: f64 = 1.0;

/// Turn of late that took thrust which the speed lacks, rad.
const HARD_TURN: f64 = 0.35;

/// The same of a yaw rate, rad/s, for a craft without way, whose turns of late are not looked at.
const HARD_YAW_RATE: f64 = 0.04;

/// Largest turn of which the sense is clear, rad: a plan's references are no more than 2.6 rad from the bow.
const CLEAR_TURN_MAX: f64 = 2.7;

/// Slower than this, m/s, a drift angle says nothing.
pub(super) const SPEED_WITH_DRIFT: f64 = 0.15;

/// Whether a craft that is `beyond` its reference is ahead of one that `moved`: who steers it along the trajectory of a plan sends
/// references that go on between two plans, and ahead of its loop.
fn leads(beyond: f64, moved: f64) -> bool {
    0.0 < beyond * moved && beyond.abs() <= LEAD_MAX * moved.abs()
}

/// How many times as far as its reference moved between two plans a craft that follows is beyond it.
const LEAD_MAX: f64 = 2.0;

/// What one snapshot says of the craft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CraftObservation<'a> {
    /// The craft now.
    pub(crate) asc: &'a Asc,
    /// What the operator allows.
    pub(crate) limits: &'a Limits,
    /// Current (north, east) as the client declares it, m/s.
    pub(crate) declared_current: Option<Vector2<f64>>,
    /// Current (north, east) as far as it is known, m/s, else zero.
    pub(crate) current: Vector2<f64>,
    /// What the previous answer knew and asked for, if it is usable, and time since then, s.
    pub(crate) previous: Option<(CraftEstimate, PastReference)>,
}

/// What the loops were asked for since an earlier answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PastReference {
    /// Heading reference through the water, rad.
    pub(crate) heading: f64,
    /// Speed reference through the water, m/s.
    pub(crate) speed: f64,
    /// Heading, rad, and speed, m/s, of the command, whatever the loops hold.
    pub(crate) command: Vector2<f64>,
    /// Time since then, s.
    pub(crate) elapsed: f64,
}

impl CraftEstimate {
    /// What is known now: `observation` taken up into what the previous answer knew, or a start from the prior.
    #[must_use]
    pub(crate) fn new(observation: &CraftObservation<'_>, prior: &Prior) -> Self {
        let start = || Self::start(observation, prior);
        let Some((before, asked)) = observation.previous else {
            return start();
        };
        if !(0.0..=INTERVAL_MAX).contains(&asked.elapsed) {
            return start();
        }
        let jump = (before.position - observation.asc.position()).norm();
        if jump > POSITION_JUMP + SPEED_JUMP * asked.elapsed {
            return start();
        }
        before.after(observation, prior, asked)
    }

    fn start(observation: &CraftObservation<'_>, prior: &Prior) -> Self {
        let asc = observation.asc;
        Self {
            heading: Vector3::new(asc.heading().radians(), prior.heading_lag.mean, 0.0),
            heading_covariance: Matrix3::from_diagonal(&Vector3::new(
                HEADING_NOISE * HEADING_NOISE,
                prior.heading_lag.variance,
                OFFSET_SIGMA * OFFSET_SIGMA,
            )),
            delays: prior.delays(),
            followed_heading: asc.heading().radians(),
            followed_speed: asc.speed_mps,
            followed_command: Vector2::new(asc.heading().radians(), asc.speed_mps),
            evidence: Vector2::zeros(),
            surge: Vector3::new(asc.speed_mps, prior.surge_lag.mean, 0.0),
            surge_covariance: Matrix3::from_diagonal(&Vector3::new(
                SPEED_NOISE * SPEED_NOISE,
                prior.surge_lag.variance,
                DISTURBANCE_SIGMA * DISTURBANCE_SIGMA,
            )),
            drift: prior.drift,
            current: Vector2::zeros(),
            current_variance: CURRENT_SIGMA * CURRENT_SIGMA,
            position: asc.position(),
            monitor: Monitor::new(asc),
            heading_effect: Effect::new(asc.heading().radians()),
            speed_effect: Effect::new(asc.speed_mps),
            realised: Realised::START,
        }
    }

    /// The filters a snapshot later.
    fn after(&self, observation: &CraftObservation<'_>, prior: &Prior, asked: PastReference) -> Self {
        let craft = CraftModel::new(&prior.craft, observation.limits);
        let mut next = *self;
        next.position = observation.asc.position();
        next.delays = prior.delays();
        if asked.elapsed < INTERVAL_MIN {
            return next;
        }
        next.forget(prior, asked.elapsed);
        next.update_mode_evidence(observation, prior, &craft, asked);
        next.learn_heading(observation.asc.heading().radians(), &craft, asked, prior);
        next.learn_surge(observation.asc.speed_mps, &craft, asked, prior);
        let before = (self.followed_heading, self.followed_speed);
        next.look_for_effects(
            observation.asc,
            &prior.slowest(observation.limits),
            before,
            asked.elapsed,
        );
        next.unlearn_faults(observation, prior);
        next.learn_drift(observation, prior, asked);
        next.learn_current(observation, &self.position, asked);
        let expected = next.monitored(prior, &craft);
        let crab = match next.modes(prior).0 {
            HeadingReference::Course => {
                (observation.current.norm() / observation.asc.speed_mps.max(SPEED_WITH_DRIFT)).min(CRAB_MAX)
            }
            HeadingReference::Heading => 0.0,
        };
        let asked_for = (next.followed_heading, next.followed_speed);
        let turned = next.heading_effect.seen_change;
        next.monitor = self
            .monitor
            .after(observation.asc, &expected, crab, turned, asked_for, asked.elapsed);
        next.monitor.alarm |= next.heading_effect.is_missing() || next.speed_effect.is_missing();
        next
    }

    /// Compares what the craft did with what the `slowest` does that is believed; `before` are the references that were followed before
    /// these.
    fn look_for_effects(&mut self, asc: &Asc, slowest: &CraftModel, before: (f64, f64), elapsed: f64) {
        let (heading, speed) = (self.followed_heading, self.followed_speed);
        let seen = asc.heading().radians();
        let (turned, faster) = (|a: f64, b: f64| wrap(a - b), |a: f64, b: f64| a - b);
        self.heading_effect = if CLEAR_TURN_MAX < turned(heading, seen).abs() {
            // It may turn either way.
            self.heading_effect.anew(seen)
        } else if asc.speed_mps < slowest.limits.speed_min
            || leads(turned(seen, heading), turned(heading, before.0))
        {
            // Without way a rudder does nothing.
            self.heading_effect.paused(seen, turned)
        } else {
            let response = |from| {
                let rate_max = slowest.limits.turn_rate_max;
                wrap(from + heading_change(wrap(heading - from), slowest.heading_time, rate_max, elapsed))
            };
            let difference = |a, b| wrap(a - b);
            self.heading_effect.after(
                (heading, seen),
                effect::HEADING_SIGMA,
                elapsed,
                difference,
                response,
            )
        };
        // In a hard turn thrusters serve the turn first. One that does nothing does not turn.
        let turns_hard =
            HARD_TURN < self.heading_effect.seen_change.abs() || HARD_YAW_RATE < asc.yaw_rate_radps.abs();
        self.speed_effect = if turns_hard || leads(asc.speed_mps - speed, speed - before.1) {
            self.speed_effect.paused(asc.speed_mps, faster)
        } else {
            let response = |from| surge_after(from, 0.0, speed, slowest, elapsed).0;
            self.speed_effect.after(
                (speed, asc.speed_mps),
                effect::SPEED_SIGMA,
                elapsed,
                faster,
                response,
            )
        };
    }

    /// A loop whose references have no effect teaches nothing: it is as expected once it works again.
    fn unlearn_faults(&mut self, observation: &CraftObservation<'_>, prior: &Prior) {
        let start = Self::start(observation, prior);
        if self.heading_effect.is_missing() {
            (self.heading, self.heading_covariance) = (start.heading, start.heading_covariance);
        }
        if self.speed_effect.is_missing() {
            (self.surge, self.surge_covariance) = (start.surge, start.surge_covariance);
        }
    }

    /// The craft that the monitor compares with: as it is declared, else as it is learnt.
    fn monitored(&self, prior: &Prior, craft: &CraftModel) -> CraftModel {
        let lag = |declared: bool, prior: f64, learnt: f64| if declared { prior } else { learnt }.exp();
        let surge_time = lag(prior.surge_declared, prior.surge_lag.mean, self.surge.y);
        let most = SPEED_OFFSET_BELIEVED / surge_time;
        CraftModel {
            heading_time: lag(prior.heading_declared, prior.heading_lag.mean, self.heading.y),
            surge_time,
            surge_disturbance: self.surge.z.clamp(-most, most),
            ..*craft
        }
    }

    /// Pulls what is not excited back to its prior.
    fn forget(&mut self, prior: &Prior, elapsed: f64) {
        let share = 1.0 - (-elapsed / FORGETTING_TIME).exp();
        self.heading.y += share * (prior.heading_lag.mean - self.heading.y);
        self.heading_covariance.m22 += share * (prior.heading_lag.variance - self.heading_covariance.m22);
        self.surge.y += share * (prior.surge_lag.mean - self.surge.y);
        self.surge_covariance.m22 += share * (prior.surge_lag.variance - self.surge_covariance.m22);
        self.drift.mean += share * (prior.drift.mean - self.drift.mean);
        self.drift.variance += share * (prior.drift.variance - self.drift.variance);
    }

    fn learn_heading(&mut self, measured: f64, craft: &CraftModel, asked: PastReference, prior: &Prior) {
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
            // Turned by something else: the heading is accepted, the loop learns nothing.
            self.heading.x = measured;
            return;
        }
        let gain = covariance.column(0) / variance;
        let state = predicted + gain * innovation;
        self.heading = Vector3::new(
            wrap(state.x),
            bounded_log_time(state.y, &prior.heading_lag),
            state.z.clamp(-OFFSET_MAX, OFFSET_MAX),
        );
        self.heading_covariance = sound(&(covariance - gain * covariance.row(0)));
    }

    fn learn_surge(&mut self, measured: f64, craft: &CraftModel, asked: PastReference, prior: &Prior) {
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
        covariance.m33 += DISTURBANCE_WALK * DISTURBANCE_WALK * asked.elapsed;
        let innovation = measured - predicted.x;
        let variance = covariance.m11 + SPEED_NOISE * SPEED_NOISE;
        let gain = covariance.column(0) / variance;
        // One wild reading of a speed log moves the filter by no more than a plausible one.
        let most = (GATE * variance).sqrt();
        let state = predicted + gain * innovation.clamp(-most, most);
        let bias_most = craft.surge_disturbance_max();
        self.surge = Vector3::new(
            state.x.clamp(
                measured - FILTERED_SPEED_ERROR_MAX,
                measured + FILTERED_SPEED_ERROR_MAX,
            ),
            bounded_log_time(state.y, &prior.surge_lag),
            state.z.clamp(-bias_most, bias_most),
        );
        self.surge_covariance = sound(&(covariance - gain * covariance.row(0)));
    }

    /// Sway as measured; where it is not, as the velocity over ground across the bow says, less a known current.
    fn learn_drift(&mut self, observation: &CraftObservation<'_>, prior: &Prior, asked: PastReference) {
        let asc = observation.asc;
        let across = || {
            let through_water = asc.ground_velocity()? - observation.declared_current?;
            Some((ned_from_body(asc.heading().radians()).transpose() * through_water).y)
        };
        let Some(sway) = measured_sway(asc)
            .or_else(across)
            .filter(|_| asc.speed_mps.abs() > SPEED_WITH_DRIFT)
        else {
            return;
        };
        let slope = -asc.speed_mps * asc.yaw_rate_radps;
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

    fn learn_current(
        &mut self,
        observation: &CraftObservation<'_>,
        before: &Vector2<f64>,
        asked: PastReference,
    ) {
        let asc = observation.asc;
        let over_ground = (asc.position() - before) / asked.elapsed;
        let sway = measured_sway(asc).unwrap_or(-self.drift.mean * asc.speed_mps * asc.yaw_rate_radps);
        // The mean heading and speed of the interval: both ends as measured and as filtered then.
        let psi = asc.heading().radians() - 0.5 * asc.yaw_rate_radps * asked.elapsed;
        let seen = over_ground - ned_from_body(psi) * Vector2::new(asc.speed_mps, sway);
        let variance = self.current_variance + CURRENT_WALK * CURRENT_WALK * asked.elapsed;
        // Errors of two positions after one another cancel over time; taken for independent, they are overrated.
        let noise = 2.0 * (POSITION_NOISE / asked.elapsed).powi(2);
        let gain = variance / (variance + noise);
        let current = self.current + (seen - self.current) * gain;
        self.current = current.map(|axis| axis.clamp(-CURRENT_MAX, CURRENT_MAX));
        self.current_variance = (1.0 - gain) * variance;
    }
}

/// Sway through the water, m/s. No sensor reads exactly 0: that stands for one that is left out.
fn measured_sway(asc: &Asc) -> Option<f64> {
    (asc.sway_mps != 0.0).then_some(asc.sway_mps)
}

/// The share of a step of the reference that a lag of `delay` goes in `elapsed`.
pub(super) fn behind(delay: f64, elapsed: f64) -> f64 {
    if delay > 0.0 {
        1.0 - (-elapsed / delay).exp()
    } else {
        1.0
    }
}

/// A time constant's logarithm, no farther from its prior than that may be wrong.
fn bounded_log_time(log_time: f64, prior: &Gaussian) -> f64 {
    let (least, largest) = TIME_CONSTANT.into_inner();
    prior.bounded(log_time).clamp(least.ln(), largest.ln())
}
