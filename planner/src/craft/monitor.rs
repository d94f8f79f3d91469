//! Whether the craft does what is predicted: a test on predictions that only references drive.
//!
//! ```text
//! ψ_o⁺ = response(ψ_o, ψ_ref)      ε = ψ − ψ_o⁺      ψ_o ← ψ_o⁺ + (1 − exp(−Δ/τ_o)) ε        the same for speed
//! σ² = σ_0² + (κ turn of late)²               of ε in the direction of the change, what exceeds (1 + τ/Δ) |change|
//! J ← J + (1 − exp(−Δ/τ)) (max(ε_ψ²/σ_ψ², ε_u²/σ_u²) − J)
//! ```
//! A prediction that is corrected this slowly gathers over seconds what a lag, a lost thruster or a stuck rudder does to
//! each of them; one step ahead they cannot be distinguished from waves. The alarm is raised above one threshold and withdrawn below
//! another. Its false alarms and delays are measured over whole missions, see `docs/evidence.md#random-craft`.

use crate::{
    craft::{
        model::CraftModel,
        one_step::{heading_change, surge_after},
    },
    facts::{angle::wrap, asc::Asc},
};

/// Time τ_o in which the prediction is led back to what is measured, s.
const CORRECTION_TIME: f64 = 8.0;

/// Time over which the test averages, s.
const AVERAGING_TIME: f64 = 15.0;

/// What a craft that follows is off its prediction, rad: compass, waves, and a response that is not quite first order.
const HEADING_SIGMA: f64 = 0.12;

/// Part by which the crab angle of a craft that holds its course may be wrong: by what is wrong with the current and with
/// the speed.
const CRAB_ERROR: f64 = 0.5;

/// What a craft that follows is off its predicted speed, m/s.
const SPEED_SIGMA: f64 = 0.14;

/// Part of a turn by which its prediction may be wrong, and what a turn takes of the speed, m/s per rad: weak thrusters serve the
/// turn first. A rudder that does nothing makes no turn.
const TURN_ERROR: f64 = 0.15;

/// Mean square, in units of those, above which the craft is said not to follow.
const ALARM: f64 = 4.0;

/// The same below which it follows again.
const ALL_CLEAR: f64 = 1.5;

/// What the monitor remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    /// Heading that references alone lead to, rad.
    pub heading: f64,
    /// Speed that references alone lead to, m/s.
    pub speed: f64,
    /// Mean square of what the craft is off them, in units of what one that follows is.
    pub statistic: f64,
    /// Whether the craft is taken not to follow.
    pub alarm: bool,
    /// Heading error now, seen less expected, rad.
    pub heading_error: f64,
    /// Speed error now, seen less expected, m/s.
    pub speed_error: f64,
}

impl Monitor {
    /// Its numbers, in the order in which a memory has them.
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

    /// A monitor of a craft that has done nothing yet.
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

    /// The monitor `elapsed` later, of a craft that was asked for a heading and a speed, both behind the loops' delays, that
    /// `turned` of late, rad, and that holds a course with an angle of up to `crab` between heading and course, rad, 0 if it
    /// holds the heading.
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
        let wrong_heading = but_for_lead(heading_error, change, craft.heading_time, elapsed);
        let wrong_speed = but_for_lead(
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

/// What of an error is not the lead of a craft on its way: who steers it along the trajectory of a plan sends references that go on
/// between two plans, ahead of its loop by the lag. `change` is expected in `elapsed` s, with the time constant `time` of the loop, s.
fn but_for_lead(error: f64, change: f64, time: f64, elapsed: f64) -> f64 {
    let rate = if 0.0 < elapsed { change / elapsed } else { 0.0 };
    let lead = change.abs() + rate.abs() * time;
    if 0.0 < error * change {
        error.signum() * (error.abs() - lead).max(0.0)
    } else {
        error
    }
}

/// A single error counts as no more than this many of those of a craft that follows: one wild reading is no trend.
const SQUARE_ROOT_MAX: f64 = 6.0;

/// How near the planner and the law kept the craft to its goal, each while it steered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Realised {
    /// Mean square distance while the planner steered, m².
    pub planner: f64,
    /// Mean square distance while the law steered because the craft did not follow, m²; the planner's until then.
    pub law: f64,
    /// Whether the law steers because the craft does not follow.
    pub law_steers: bool,
    /// For how long the one that steers has done so, s.
    pub since: f64,
}

impl Realised {
    /// Nothing flown yet.
    pub(crate) const START: Self = Self {
        planner: 0.0,
        law: 0.0,
        law_steers: false,
        since: 0.0,
    };

    /// Its numbers, in the order in which a memory has them.
    pub(crate) fn memory(&self) -> [f64; 4] {
        [
            self.planner,
            self.law,
            f64::from(u8::from(self.law_steers)),
            self.since,
        ]
    }

    /// What is known after `elapsed` at `distance` from the goal, m. While there is an `alarm`, each steers for
    /// a minute at least, and then as long as it is nearer than the other was; without one, the planner does.
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
        // What the other did is forgotten: it is tried again in the end.
        let fade = (-elapsed / TRIAL_MEMORY).exp();
        let resting = if self.law_steers {
            &mut next.planner
        } else {
            &mut next.law
        };
        *resting *= fade;
        if !alarm {
            // The law is as good as the planner until it is tried.
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

/// Time for which one steers at least while the craft does not follow, s.
const TRIAL_TIME: f64 = 60.0;

/// Longest time that is counted, s.
pub(super) const SINCE_MAX: f64 = 1.0e12;

/// Time over which a realised distance is averaged, s.
const REALISED_TIME: f64 = 30.0;

/// Time in which the distance of the one that rests is forgotten, s.
const TRIAL_MEMORY: f64 = 900.0;

/// Farthest that a distance counts, m.
const DISTANCE_MAX: f64 = 1.0e4;
