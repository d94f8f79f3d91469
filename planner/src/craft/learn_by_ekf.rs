//! Learning the craft from its responses: one small filter for each loop, updated by each snapshot.
//!
//! ```text
//! heading   x = (ψ, ln T, δ)    ψ⁺ = ψ + ∫ clamp((ψ_ref′ + δ − ψ)/T, ±r_max)             z = ψ
//! surge     x = (u, ln T_u, b)  u⁺ = u + ∫ clamp((u_ref′ − u)/T_u, −a_dec, a_acc) + b      z = u
//! drift     x = k_β             z = v = −k_β u r
//! current   x = c               z = (p − p⁻)/Δ − v_w          without a ground velocity
//! ```
//! ψ_ref′ and u_ref′ are the references behind a first-order lag that replaces the loop's delay: a
//! true delay would need a memory of all references. δ is the heading's offset from its reference:
//! a loop without integrator, a misaligned compass, the crab angle of a course loop.
//!
//! Extended Kalman filters: the loops are nonlinear in their time constants, and unexcited
//! parameters must keep their prior, which recursive least squares with a forgetting factor does
//! not ensure. Logarithms keep time constants positive. Time constants and their variances return
//! to their prior in the forgetting time, so estimates are bounded and adapt.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::craft::closed_loop::HeadingReference;
use crate::craft::covariance::{propagated, sound};
use crate::craft::effect::Effect;
use crate::craft::estimate::CraftEstimate;
use crate::craft::model::CraftModel;
use crate::craft::monitor::{Monitor, Trial};
use crate::craft::one_step::{heading_change, surge_after};
use crate::craft::prior::{Gaussian, Prior};
use crate::facts::angle::{ned_from_body, wrap};
use crate::facts::asc::{Asc, Limits};
use crate::facts::ranges::CURRENT_MAX;
use crate::tuned::CraftNumbers;

/// Longest interval between two snapshots for a prediction, s; older memories restart.
const INTERVAL_MAX: f64 = 10.0;

/// Shortest interval between two snapshots for learning, s.
const INTERVAL_MIN: f64 = 0.05;

/// Range of learnt time constants, s.
const TIME_CONSTANT: std::ops::RangeInclusive<f64> = 0.2..=20.0;

/// Largest magnitude of a learnt drift in a turn, s, unless a larger one is declared.
const DRIFT_MAX: f64 = 5.0;

/// Largest heading offset, rad.
const OFFSET_MAX: f64 = 0.8;

/// Largest difference of a filtered speed from a measured one, m/s.
const FILTERED_SPEED_ERROR_MAX: f64 = 2.0;

/// Displacement, m, beyond which, and beyond [`SPEED_JUMP`], a craft is another one or was carried.
const POSITION_JUMP: f64 = 20.0;

/// Speed of such a displacement, m/s.
const SPEED_JUMP: f64 = 10.0;

/// Largest turn of unambiguous sense, rad; plans' references are within 2.6 rad of the bow.
const CLEAR_TURN_MAX: f64 = 2.7;

/// `true` for a craft `beyond` its reference but ahead of one that `moved`: a bridge sends
/// references along a plan's trajectory between plans, ahead of its loop.
fn leads(beyond: f64, moved: f64, lead_max: f64) -> bool {
    0.0 < beyond * moved && beyond.abs() <= lead_max * moved.abs()
}

/// Observation of the craft in one snapshot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CraftObservation<'a> {
    pub(crate) asc: &'a Asc,
    pub(crate) limits: &'a Limits,
    pub(crate) declared_current: Option<Vector2<f64>>,
    /// Known current (north, east), m/s, else zero.
    pub(crate) current: Vector2<f64>,
    /// Estimate and references of the previous answer, if usable.
    pub(crate) previous: Option<(CraftEstimate, PastReference)>,
    pub(crate) tuned: &'a CraftNumbers,
}

/// One step of the filters.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    pub(super) observation: &'a CraftObservation<'a>,
    pub(super) asc: &'a Asc,
    pub(super) prior: &'a Prior,
    /// The declared craft within the limits.
    pub(super) craft: &'a CraftModel,
    pub(super) asked: PastReference,
    pub(super) tuned: &'a CraftNumbers,
}

/// References of the loops since an earlier answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PastReference {
    pub(crate) heading: f64,
    pub(crate) speed: f64,
    /// Heading, rad, and speed, m/s, of the command, as the loops hold them.
    pub(crate) command: Vector2<f64>,
    pub(crate) elapsed: f64,
}

impl CraftEstimate {
    /// The present estimate: the previous one updated by `observation`, or a start from the prior.
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
        before.after(&Step {
            observation,
            asc: observation.asc,
            prior,
            craft: &CraftModel::new(&prior.craft, observation.limits),
            asked,
            tuned: observation.tuned,
        })
    }

    fn start(observation: &CraftObservation<'_>, prior: &Prior) -> Self {
        let (asc, tuned) = (observation.asc, observation.tuned);
        Self {
            heading: Vector3::new(asc.heading().radians(), prior.heading_lag.mean, 0.0),
            heading_covariance: Matrix3::from_diagonal(&Vector3::new(
                tuned.heading_noise * tuned.heading_noise,
                prior.heading_lag.variance,
                tuned.offset_sigma * tuned.offset_sigma,
            )),
            delays: prior.delays(),
            followed_heading: asc.heading().radians(),
            followed_speed: asc.speed_mps,
            followed_command: Vector2::new(asc.heading().radians(), asc.speed_mps),
            surge: Vector3::new(asc.speed_mps, prior.surge_lag.mean, 0.0),
            surge_covariance: Matrix3::from_diagonal(&Vector3::new(
                tuned.speed_noise * tuned.speed_noise,
                prior.surge_lag.variance,
                tuned.disturbance_sigma * tuned.disturbance_sigma,
            )),
            drift: prior.drift,
            current_variance: tuned.current_sigma * tuned.current_sigma,
            position: asc.position(),
            monitor: Monitor::new(asc),
            heading_effect: Effect::new(asc.heading().radians()),
            speed_effect: Effect::new(asc.speed_mps),
            trial: Trial::new(asc.heading().radians(), asc.speed_mps),
            ..Self::default()
        }
    }

    fn after(&self, step: &Step<'_>) -> Self {
        let Step { asc, prior, asked, tuned, .. } = *step;
        let mut next = *self;
        next.position = asc.position();
        next.delays = prior.delays();
        if asked.elapsed < INTERVAL_MIN {
            return next;
        }
        next.forget(step);
        next.update_mode_evidence(step);
        next.learn_heading(step);
        next.learn_surge(step);
        next.test_effects(step, (self.followed_heading, self.followed_speed));
        next.reset_faulty_loops(step);
        next.learn_drift(step);
        next.learn_current(step, &self.position);
        let expected = next.monitored(step);
        let crab = match next.modes(prior).0 {
            HeadingReference::Course => {
                let speed = asc.speed_mps.max(tuned.speed_with_drift);
                (step.observation.current.norm() / speed).min(tuned.crab_max)
            }
            HeadingReference::Heading => 0.0,
        };
        let asked_for = (next.followed_heading, next.followed_speed);
        let turned = next.heading_effect.seen_change;
        next.monitor = self.monitor.after((asc, tuned), &expected, (crab, turned), asked_for, asked.elapsed);
        next.monitor.alarm |= next.heading_effect.is_missing() || next.speed_effect.is_missing();
        next
    }

    /// Compares the craft with the slowest plausible one; `before`: the previous references.
    fn test_effects(&mut self, step: &Step<'_>, before: (f64, f64)) {
        let (asc, tuned, elapsed) = (step.asc, step.tuned, step.asked.elapsed);
        let slowest = &step.prior.slowest(step.observation.limits, tuned);
        let (heading, speed) = (self.followed_heading, self.followed_speed);
        let seen = asc.heading().radians();
        let (turned, faster) = (|a: f64, b: f64| wrap(a - b), |a: f64, b: f64| a - b);
        self.heading_effect = if CLEAR_TURN_MAX < turned(heading, seen).abs() {
            // Both senses are possible.
            self.heading_effect.restarted(seen)
        } else if asc.speed_mps < slowest.limits.speed_min
            || leads(turned(seen, heading), turned(heading, before.0), tuned.lead_max)
        {
            // Without way a rudder has no effect.
            self.heading_effect.paused(seen, turned)
        } else {
            let response = |from| {
                let rate_max = slowest.limits.turn_rate_max;
                wrap(from + heading_change(wrap(heading - from), slowest.heading_time, rate_max, elapsed))
            };
            let sigma = tuned.effect_heading_sigma;
            self.heading_effect.after((heading, seen), (sigma, tuned), elapsed, turned, response)
        };
        // In a hard turn thrusters serve the turn first. A stuck craft does not turn.
        let turns_hard = tuned.hard_turn < self.heading_effect.seen_change.abs()
            || tuned.hard_yaw_rate < asc.yaw_rate_radps.abs();
        self.speed_effect = if turns_hard || leads(asc.speed_mps - speed, speed - before.1, tuned.lead_max) {
            self.speed_effect.paused(asc.speed_mps, faster)
        } else {
            let response = |from| surge_after(from, 0.0, speed, slowest, elapsed).0;
            let (both, sigma) = ((speed, asc.speed_mps), tuned.effect_speed_sigma);
            self.speed_effect.after(both, (sigma, tuned), elapsed, faster, response)
        };
    }

    /// Resets a loop whose references have no effect: it is as expected once it works again.
    fn reset_faulty_loops(&mut self, step: &Step<'_>) {
        let start = Self::start(step.observation, step.prior);
        if self.heading_effect.is_missing() {
            (self.heading, self.heading_covariance) = (start.heading, start.heading_covariance);
        }
        if self.speed_effect.is_missing() {
            (self.surge, self.surge_covariance) = (start.surge, start.surge_covariance);
        }
    }

    /// The craft that the monitor compares with: the declared one, else the learnt one.
    fn monitored(&self, step: &Step<'_>) -> CraftModel {
        let prior = step.prior;
        let lag = |declared: bool, prior: f64, learnt: f64| if declared { prior } else { learnt }.exp();
        let surge_time = lag(prior.surge_declared, prior.surge_lag.mean, self.surge.y);
        let most = step.tuned.speed_offset_believed / surge_time;
        CraftModel {
            heading_time: lag(prior.heading_declared, prior.heading_lag.mean, self.heading.y),
            surge_time,
            surge_disturbance: self.surge.z.clamp(-most, most),
            ..*step.craft
        }
    }

    /// Pulls unexcited parameters back to their prior.
    fn forget(&mut self, step: &Step<'_>) {
        let prior = step.prior;
        let share = 1.0 - (-step.asked.elapsed / step.tuned.forgetting_time).exp();
        self.heading.y += share * (prior.heading_lag.mean - self.heading.y);
        self.heading_covariance.m22 += share * (prior.heading_lag.variance - self.heading_covariance.m22);
        self.surge.y += share * (prior.surge_lag.mean - self.surge.y);
        self.surge_covariance.m22 += share * (prior.surge_lag.variance - self.surge_covariance.m22);
        self.drift.mean += share * (prior.drift.mean - self.drift.mean);
        self.drift.variance += share * (prior.drift.variance - self.drift.variance);
    }

    fn learn_heading(&mut self, step: &Step<'_>) {
        let Step { craft, asked, tuned, .. } = *step;
        let measured = step.asc.heading().radians();
        let ahead = wrap(asked.heading - self.followed_heading);
        let followed = self.followed_heading + behind(craft.heading_delay, asked.elapsed) * ahead;
        self.followed_heading = wrap(followed);
        let predict = |state: &Vector3<f64>| {
            let error = wrap(followed + state.z - state.x);
            let turned = heading_change(error, state.y.exp(), craft.limits.turn_rate_max, asked.elapsed);
            Vector3::new(state.x + turned, state.y, state.z)
        };
        let (predicted, mut covariance) = propagated(predict, &self.heading, &self.heading_covariance);
        covariance.m11 += tuned.heading_walk * tuned.heading_walk * asked.elapsed;
        covariance.m33 += tuned.offset_walk * tuned.offset_walk * asked.elapsed;
        let innovation = wrap(measured - predicted.x);
        let variance = covariance.m11 + tuned.heading_noise * tuned.heading_noise;
        if innovation * innovation > tuned.gate * variance {
            // Turned by another cause: accept the heading, learn nothing.
            self.heading.x = measured;
            return;
        }
        let gain = covariance.column(0) / variance;
        let state = predicted + gain * innovation;
        self.heading = Vector3::new(
            wrap(state.x),
            bounded_log_time(state.y, &step.prior.heading_lag, tuned),
            state.z.clamp(-OFFSET_MAX, OFFSET_MAX),
        );
        self.heading_covariance = sound(&(covariance - gain * covariance.row(0)));
    }

    fn learn_surge(&mut self, step: &Step<'_>) {
        let Step { craft, asked, tuned, .. } = *step;
        let measured = step.asc.speed_mps;
        let share = behind(craft.surge_delay, asked.elapsed);
        self.followed_speed += share * (asked.speed - self.followed_speed);
        let followed = self.followed_speed;
        let predict = |state: &Vector3<f64>| {
            let model = CraftModel { surge_time: state.y.exp(), ..*craft };
            let (speed, bias) = surge_after(state.x, state.z, followed, &model, asked.elapsed);
            Vector3::new(speed, state.y, bias)
        };
        let (predicted, mut covariance) = propagated(predict, &self.surge, &self.surge_covariance);
        covariance.m11 += tuned.speed_walk * tuned.speed_walk * asked.elapsed;
        covariance.m33 += tuned.disturbance_walk * tuned.disturbance_walk * asked.elapsed;
        let innovation = measured - predicted.x;
        let variance = covariance.m11 + tuned.speed_noise * tuned.speed_noise;
        let gain = covariance.column(0) / variance;
        // A wild speed reading moves the filter no more than a plausible one.
        let most = (tuned.gate * variance).sqrt();
        let state = predicted + gain * innovation.clamp(-most, most);
        let bias_most = craft.surge_disturbance_max();
        self.surge = Vector3::new(
            state.x.clamp(measured - FILTERED_SPEED_ERROR_MAX, measured + FILTERED_SPEED_ERROR_MAX),
            bounded_log_time(state.y, &step.prior.surge_lag, tuned),
            state.z.clamp(-bias_most, bias_most),
        );
        self.surge_covariance = sound(&(covariance - gain * covariance.row(0)));
    }

    /// Uses the measured sway, else that of the velocity over ground minus a declared current.
    fn learn_drift(&mut self, step: &Step<'_>) {
        let (asc, tuned) = (step.asc, step.tuned);
        let across = || {
            let through_water = asc.ground_velocity()? - step.observation.declared_current?;
            Some((ned_from_body(asc.heading().radians()).transpose() * through_water).y)
        };
        let Some(sway) =
            measured_sway(asc).or_else(across).filter(|_| asc.speed_mps.abs() > tuned.speed_with_drift)
        else {
            return;
        };
        let slope = -asc.speed_mps * asc.yaw_rate_radps;
        // Readings are correlated over a second: drift errors last as long as a wave.
        let noise = tuned.sway_noise * tuned.sway_noise / step.asked.elapsed.min(1.0);
        let variance = slope * slope * self.drift.variance + noise;
        let gain = self.drift.variance * slope / variance;
        let most = DRIFT_MAX.max(step.prior.drift.mean.abs());
        let mean = self.drift.mean + gain * (sway - slope * self.drift.mean);
        self.drift =
            Gaussian { mean: mean.clamp(-most, most), variance: (1.0 - gain * slope) * self.drift.variance };
    }

    fn learn_current(&mut self, step: &Step<'_>, before: &Vector2<f64>) {
        let Step { asc, asked, tuned, .. } = *step;
        let over_ground = (asc.position() - before) / asked.elapsed;
        let sway = measured_sway(asc).unwrap_or(-self.drift.mean * asc.speed_mps * asc.yaw_rate_radps);
        // Mean heading and speed of the interval: both ends, measured and filtered.
        let psi = asc.heading().radians() - 0.5 * asc.yaw_rate_radps * asked.elapsed;
        let seen = over_ground - ned_from_body(psi) * Vector2::new(asc.speed_mps, sway);
        let variance = self.current_variance + tuned.current_walk * tuned.current_walk * asked.elapsed;
        // Errors of successive positions cancel over time; as independent noise they are overrated.
        let noise = 2.0 * (tuned.position_noise / asked.elapsed).powi(2);
        let gain = variance / (variance + noise);
        let current = self.current + (seen - self.current) * gain;
        self.current = current.map(|axis| axis.clamp(-CURRENT_MAX, CURRENT_MAX));
        self.current_variance = (1.0 - gain) * variance;
    }
}

/// Sway through the water, m/s. An exact 0 is an omitted value: no sensor reads it.
fn measured_sway(asc: &Asc) -> Option<f64> {
    (asc.sway_mps != 0.0).then_some(asc.sway_mps)
}

/// Share of a step that passes a lag of `delay` in `elapsed`.
pub(super) fn behind(delay: f64, elapsed: f64) -> f64 {
    if delay > 0.0 { 1.0 - (-elapsed / delay).exp() } else { 1.0 }
}

/// A time constant's logarithm, within the bounds of its prior.
fn bounded_log_time(log_time: f64, prior: &Gaussian, tuned: &CraftNumbers) -> f64 {
    let (least, largest) = TIME_CONSTANT.into_inner();
    prior.bounded(log_time, tuned).clamp(least.ln(), largest.ln())
}
