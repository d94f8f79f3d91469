//! Test of the craft against predictions driven by references alone.
//!
//! ```text
//! ψ_o⁺ = response(ψ_o, ψ_ref)   ε = ψ − ψ_o⁺   ψ_o ← ψ_o⁺ + (1 − exp(−Δ/τ_o)) ε    also for speed
//! σ² = σ_0² + (κ recent turn)²  ε in the direction of change: its excess over (1 + τ/Δ) |change|
//! J ← J + (1 − exp(−Δ/τ)) (max(ε_ψ²/σ_ψ², ε_u²/σ_u²) − J)
//! ```
//! The slow correction accumulates a lag, a lost thruster or a stuck rudder over seconds; one step
//! ahead they look like waves. False alarms and delays: `docs/evidence.md#random-craft`.

use nalgebra::Vector2;

use crate::{
    craft::{
        model::CraftModel,
        one_step::{heading_change, surge_after},
    },
    facts::{angle::wrap, asc::Asc},
    tuned::CraftNumbers,
};

/// Memory of the monitor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    pub(crate) fn new(asc: &Asc) -> Self {
        Self { heading: asc.heading().radians(), speed: asc.speed_mps, ..Self::default() }
    }

    /// The monitor `elapsed` later, for references behind the loops' delays, a largest angle `crab`
    /// between heading and course, rad, 0 if the craft holds the heading, and a recent turn.
    pub(crate) fn after(
        &self,
        (asc, tuned): (&Asc, &CraftNumbers),
        craft: &CraftModel,
        (crab, turned): (f64, f64),
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
        let turn = tuned.turn_error * turned;
        let wrong_heading = beyond_lead(heading_error, change, craft.heading_time, elapsed);
        let wrong_speed = beyond_lead(speed_error, expected_speed - self.speed, craft.surge_time, elapsed);
        let square = (wrong_heading
            / tuned.following_heading_sigma.hypot(tuned.crab_error * crab).hypot(turn))
        .abs()
        .max((wrong_speed / tuned.following_speed_sigma.hypot(turn)).abs())
        .min(tuned.following_error_max)
        .powi(2);
        let statistic = self.statistic + share(tuned.averaging_time) * (square - self.statistic);
        Self {
            heading: wrap(expected_heading + share(tuned.correction_time) * heading_error),
            speed: expected_speed + share(tuned.correction_time) * speed_error,
            statistic,
            alarm: if self.alarm { tuned.all_clear < statistic } else { tuned.alarm < statistic },
            heading_error,
            speed_error,
        }
    }
}

/// The error beyond the lead of a craft on its way: a bridge sends references ahead of its loop by
/// the lag. `change` is expected in `elapsed` s; `time` is the loop's time constant, s.
fn beyond_lead(error: f64, change: f64, time: f64, elapsed: f64) -> f64 {
    let rate = if 0.0 < elapsed { change / elapsed } else { 0.0 };
    let lead = change.abs() + rate.abs() * time;
    if 0.0 < error * change { error.signum() * (error.abs() - lead).max(0.0) } else { error }
}

/// Distances to the goal under the planner and under the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// Its state after `elapsed` at `distance` from the goal, m. In an `alarm`, each steers for a
    /// minute and then while it is nearer than the other was; else the planner steers.
    #[must_use]
    pub fn after(&self, distance: f64, elapsed: f64, alarm: bool, tuned: &CraftNumbers) -> Self {
        let mut next = *self;
        next.since = (next.since + elapsed).min(SINCE_MAX);
        let steering = if self.law_steers { &mut next.law } else { &mut next.planner };
        let share = 1.0 - (-elapsed / tuned.realised_time).exp();
        *steering += share * (distance.min(DISTANCE_MAX).powi(2) - *steering);
        // The other's result fades, so that it is tried again.
        let fade = (-elapsed / tuned.trial_memory).exp();
        let resting = if self.law_steers { &mut next.planner } else { &mut next.law };
        *resting *= fade;
        if !alarm {
            // Until the law is tried, it counts as good as the planner.
            (next.law, next.law_steers) = (next.planner, false);
            next.since = 0.0;
        } else if tuned.trial_time < next.since {
            let law_is_nearer = next.law < next.planner;
            if law_is_nearer != self.law_steers {
                (next.law_steers, next.since) = (law_is_nearer, 0.0);
            }
        }
        next
    }
}

/// Longest counted time, s.
pub(crate) const SINCE_MAX: f64 = 1.0e12;

/// Largest counted distance, m.
pub(crate) const DISTANCE_MAX: f64 = 1.0e4;

/// Laws that are simulated beside the craft.
pub(crate) const LAWS: usize = 4;

/// The crafts of planner and laws: one of them is the real one, the others are simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trial {
    /// The planner's craft, then that of every law.
    pub crafts: [TrialCraft; LAWS + 1],
    /// Time since the moment that is compared next, s.
    pub waiting: f64,
    /// The real craft's position then (north, east) less its present one, m.
    pub place: Vector2<f64>,
    /// Time since another one began to steer, s.
    pub since: f64,
    /// Least time until the next one does, s.
    pub hold: f64,
}

/// One of the crafts of a [`Trial`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrialCraft {
    /// `true` for the law that steers the real craft.
    pub steers: bool,
    /// Position (north, east) less the real craft's, m.
    pub offset: Vector2<f64>,
    /// The same at the moment that is compared next, m.
    pub then: Vector2<f64>,
    /// Heading, rad.
    pub heading: f64,
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Its references, rad and m/s.
    pub asked: Vector2<f64>,
    /// Mean square distance from where the goal turned out to be, m².
    pub square: f64,
    /// Evidence that it is nearer than the one that steers, s.
    pub evidence: f64,
}

impl Trial {
    /// A trial in which all are where the real craft is, which the planner steers.
    pub(crate) fn new(heading: f64, speed: f64) -> Self {
        let asked = Vector2::new(heading, speed);
        Self {
            crafts: [TrialCraft { heading, speed, asked, ..Default::default() }; LAWS + 1],
            ..Self::default()
        }
    }

    /// Index of the craft that is the real one.
    pub fn real(&self) -> usize {
        self.crafts.iter().position(|craft| craft.steers).unwrap_or(0)
    }
}
