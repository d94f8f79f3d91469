//! Test of the craft against predictions driven by references alone.
//!
//! ```text
//! ψ_o⁺ = response(ψ_o, ψ_ref)   ε = ψ − ψ_o⁺   ψ_o ← ψ_o⁺ + (1 − exp(−Δ/τ_o)) ε    also for speed
//! σ² = σ_0² + (κ recent turn)²  ε in the direction of change: its excess over (1 + τ/Δ) |change|
//! J ← J + (1 − exp(−Δ/τ)) (max(ε_ψ²/σ_ψ², ε_u²/σ_u²) − J)
//! ```
//! The slow correction accumulates the effect of a lag, a lost thruster or a stuck rudder over
//! seconds; one step ahead it is indistinguishable from waves. The alarm has a threshold and a
//! lower one to withdraw it. False alarms and delays over whole missions:
//! `docs/evidence.md#random-craft`.

use crate::{
    craft::{
        model::CraftModel,
        one_step::{heading_change, surge_after},
    },
    facts::{angle::wrap, asc::Asc},
};

/// Time constant τ_o of the correction towards measurements, s.
const CORRECTION_TIME: f64 = 8.0;

/// Averaging time of the test, s.
const AVERAGING_TIME: f64 = 15.0;

/// Standard deviation of a following craft's heading, rad: compass, waves, model.
const HEADING_SIGMA: f64 = 0.12;

/// Relative error of a course loop's crab angle, from errors of current and speed.
const CRAB_ERROR: f64 = 0.5;

/// Standard deviation of a following craft's speed from its prediction, m/s.
const SPEED_SIGMA: f64 = 0.14;

/// Relative error of a predicted turn, and speed lost in a turn, m/s per rad: weak thrusters serve
/// the turn first. A stuck rudder makes no turn.
const TURN_ERROR: f64 = 0.15;

/// Mean square, in variances, above which the craft does not follow.
const ALARM: f64 = 4.0;

/// Mean square below which it follows again.
const ALL_CLEAR: f64 = 1.5;

/// Memory of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    /// Heading predicted from references alone, rad.
    pub heading: f64,
    /// Speed predicted from references alone, m/s.
    pub speed: f64,
    /// Mean square of the errors, in variances of a following craft.
    pub statistic: f64,
    /// `true` if the craft does not follow.
    pub alarm: bool,
    /// Present heading error, measured minus predicted, rad.
    pub heading_error: f64,
    /// Present speed error, measured minus predicted, m/s.
    pub speed_error: f64,
}

impl Monitor {
    /// Its numbers, in the order of the memory.
    pub(crate) fn memory(&self) -> [f64; 6] {
        [
            self.heading,
            self.speed,
            self.statistic,
            f64::from(u8::from(self.alarm)),
            self.heading_error,
            self.speed_error,
        ]
    }

    /// The monitor of a craft at its start.
    #[must_use]
    pub(crate) fn new(asc: &Asc) -> Self {
        Self {
            heading: asc.heading().radians(),
            speed: asc.speed_mps,
            statistic: 0.0,
            alarm: false,
            heading_error: 0.0,
            speed_error: 0.0,
        }
    }

    /// The monitor `elapsed` later, for references of heading and speed behind the loops' delays, a
    /// recent turn `turned`, rad, and a largest angle `crab` between heading and course, rad, which
    /// is 0 if the craft holds the heading.
    #[must_use]
    pub(crate) fn after(
        &self,
        asc: &Asc,
        craft: &CraftModel,
        crab: f64,
        turned: f64,
        (heading, speed): (f64, f64),
        elapsed: f64,
    ) -> Self {
        let error = wrap(heading - self.heading);
        let change = heading_change(error, craft.heading_time, craft.limits.turn_rate_max, elapsed);
        let expected_heading = self.heading + change;
        let (expected_speed, _) = surge_after(self.speed, craft.surge_disturbance, speed, craft, elapsed);
        let heading_error = wrap(asc.heading().radians() - expected_heading);
        let speed_error = asc.speed_mps - expected_speed;
        let share = |time: f64| 1.0 - (-elapsed / time).exp();
        let turn = TURN_ERROR * turned;
        let wrong_heading = beyond_lead(heading_error, change, craft.heading_time, elapsed);
        let wrong_speed = beyond_lead(
            speed_error,
            expected_speed - self.speed,
            craft.surge_time,
            elapsed,
        );
        let square = (wrong_heading / HEADING_SIGMA.hypot(CRAB_ERROR * crab).hypot(turn))
            .abs()
            .max((wrong_speed / SPEED_SIGMA.hypot(turn)).abs())
            .min(SQUARE_ROOT_MAX)
            .powi(2);
        let statistic = self.statistic + share(AVERAGING_TIME) * (square - self.statistic);
        Self {
            heading: wrap(expected_heading + share(CORRECTION_TIME) * heading_error),
            speed: expected_speed + share(CORRECTION_TIME) * speed_error,
            statistic,
            alarm: if self.alarm {
                ALL_CLEAR < statistic
            } else {
                ALARM < statistic
            },
            heading_error,
            speed_error,
        }
    }
}

/// The error beyond the lead of a craft on its way: a bridge sends references along a plan's
/// trajectory between plans, ahead of its loop by the lag. `change` is expected in `elapsed` s;
/// `time` is the loop's time constant, s.
fn beyond_lead(error: f64, change: f64, time: f64, elapsed: f64) -> f64 {
    let rate = if 0.0 < elapsed { change / elapsed } else { 0.0 };
    let lead = change.abs() + rate.abs() * time;
    if 0.0 < error * change {
        error.signum() * (error.abs() - lead).max(0.0)
    } else {
        error
    }
}

/// Largest single error, in deviations of a following craft: one wild reading is no trend.
const SQUARE_ROOT_MAX: f64 = 6.0;

/// Distances to the goal under the planner and under the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Realised {
    /// Mean square distance while the planner steered, m².
    pub planner: f64,
    /// Mean square distance while the law steered, m²; the planner's until then.
    pub law: f64,
    /// `true` if the law steers because the craft does not follow.
    pub law_steers: bool,
    /// Time since the last change between planner and law, s.
    pub since: f64,
}

impl Realised {
    /// The start, before any motion.
    pub(crate) const START: Self = Self {
        planner: 0.0,
        law: 0.0,
        law_steers: false,
        since: 0.0,
    };

    /// Its numbers, in the order of the memory.
    pub(crate) fn memory(&self) -> [f64; 4] {
        [
            self.planner,
            self.law,
            f64::from(u8::from(self.law_steers)),
            self.since,
        ]
    }

    /// Its state after `elapsed` at `distance` from the goal, m. In an `alarm`, each steers for a
    /// minute and then while it is nearer than the other was; else the planner steers.
    #[must_use]
    pub fn after(&self, distance: f64, elapsed: f64, alarm: bool) -> Self {
        let mut next = *self;
        next.since = (next.since + elapsed).min(SINCE_MAX);
        let steering = if self.law_steers {
            &mut next.law
        } else {
            &mut next.planner
        };
        let share = 1.0 - (-elapsed / REALISED_TIME).exp();
        *steering += share * (distance.min(DISTANCE_MAX).powi(2) - *steering);
        // The other's result fades, so that it is tried again.
        let fade = (-elapsed / TRIAL_MEMORY).exp();
        let resting = if self.law_steers {
            &mut next.planner
        } else {
            &mut next.law
        };
        *resting *= fade;
        if !alarm {
            // Until the law is tried, it counts as good as the planner.
            (next.law, next.law_steers) = (next.planner, false);
            next.since = 0.0;
        } else if TRIAL_TIME < next.since {
            let law_is_nearer = next.law < next.planner;
            if law_is_nearer != self.law_steers {
                (next.law_steers, next.since) = (law_is_nearer, 0.0);
            }
        }
        next
    }
}

/// Least time for which planner or law steers during an alarm, s.
const TRIAL_TIME: f64 = 60.0;

/// Longest counted time, s.
pub(super) const SINCE_MAX: f64 = 1.0e12;

/// Averaging time of a realised distance, s.
const REALISED_TIME: f64 = 30.0;

/// Time in which the distance of the inactive one fades, s.
const TRIAL_MEMORY: f64 = 900.0;

/// Largest counted distance, m.
const DISTANCE_MAX: f64 = 1.0e4;
