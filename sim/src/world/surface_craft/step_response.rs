//! Commissioning tests: steps and turns in calm water, and the response model fitted to them.

use nalgebra::Vector2;
use planner::{
    angle::Heading,
    craft::{Craft, CraftDescription, HeadingReference, Power, SurgeResponse},
    los::Reference,
    snapshot::Limits,
};

use super::{Sea, SurfaceCraft, SurfaceHull, ThrusterHealth};
use crate::world::inner_loop::{PERIOD, SurfaceAutopilot};

mod fit;

use fit::{Sample, fit_heading, fit_surge};

/// Speed of the heading tests, as a share of the top speed.
const CRUISE_SHARE: f64 = 0.4;
/// Slowest speed at which a craft must hold its heading, m/s: an AUV's at 0.3 m/s and 50° of pitch.
const SLOW: f64 = 0.19;
/// Small heading step, rad.
const HEADING_STEP: f64 = 0.3;
/// Duration of the trial of a small heading step, s.
const HEADING_TIME: f64 = 50.0;
/// Large heading step, rad: 150°.
const TURN: f64 = 2.6;
/// Duration of a turn at a steady rate, s.
const TURN_TIME: f64 = 20.0;
/// Largest lag of the bow behind a heading reference that turns at [`Limits::turn_rate_max`], rad.
const BEHIND_MAX: f64 = 0.8;
/// Shares of the top speed that are tried as the fastest reference.
const TOP_SHARES: [f64; 6] = [0.9, 0.8, 0.7, 0.6, 0.5, 0.4];
/// Shares of the fastest turn that are tried as [`Limits::turn_rate_max`].
const TURN_SHARES: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];
/// Share of the top speed that needs no slower turn.
const GOOD_TOP: f64 = 0.7;
/// Relative tolerance of the yaw rate of a steady turn.
const RATE_TOLERANCE: f64 = 0.1;
/// Least useful speed, m/s: to catch up with an AUV at 0.193 m/s against 0.12 m/s of current.
const TOP_MIN: f64 = 0.45;
/// Share of the speed reference that the craft must keep in a turn.
const KEPT_IN_TURN: f64 = 0.93;
/// Share of [`Limits::turn_rate_max`] in that turn.
const TRIED_TURN: f64 = 0.8;
/// Duration of the trial of a speed step, s.
const SPEED_TIME: f64 = 50.0;
/// Duration of the trial of a large speed step, s.
const SPEED_TIME_LARGE: f64 = 70.0;
/// Largest heading error at the end of a step, rad.
const HEADING_ERROR_MAX: f64 = 0.06;
/// Largest speed error at the end of a step, as a share of the reference.
const SPEED_ERROR_SHARE: f64 = 0.05;
/// Longest time to 63 % of a small step beyond its delay, s: a third more than 8 s. Assumption.
const TIME_TO_63_MAX: f64 = 12.0;

/// The result of step tests.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTestResult {
    /// The limits that the tests found.
    pub limits: Limits,
    /// Its closed-loop response.
    pub craft: Craft,
}

/// Reason why a craft fails the step tests.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StepTestFailed {
    #[error("the craft does not follow a heading step at {0:.2} m/s")]
    Heading(f64),
    #[error("the craft does not follow a speed step from {0:.2} to {1:.2} m/s")]
    Speed(f64, f64),
    #[error("the response of the craft is outside the range of a craft description")]
    OutOfRange,
    #[error("the craft cannot turn at {TOP_MIN} m/s without losing speed")]
    NoSpeed,
}

/// Tests a hull with its autopilot.
///
/// The heading response is that of the angle which the loop holds, heading or course.
pub fn step_test(hull: &SurfaceHull, autopilot: &SurfaceAutopilot) -> Result<StepTestResult, StepTestFailed> {
    let top = hull.speed_top();
    let cruise = CRUISE_SHARE * top;
    let trial = StepTest { hull, autopilot };
    trial.heading_step(SLOW)?;
    let small = trial.heading_step(cruise)?;
    let peak = peak_rate(&trial.fly(cruise, HEADING_TIME, |_| (cruise, TURN)));
    // Well below the largest yaw rate, so that the response is linear.
    let ramp_rate = 0.3 * peak;
    let ramp = trial.fly(cruise, TURN_TIME, |time| (cruise, ramp_rate * time));
    let heading = fit_heading(&[&small, &ramp], peak);
    let fastest = peak.min(BEHIND_MAX / heading.lag());
    let (turn_rate_max, speed_max) = trial.turn_and_speed(top, fastest)?;
    let surge = trial.surge(speed_max)?;
    let limits = Limits {
        speed_min: hull.speed_least(),
        speed_max,
        turn_rate_max,
        acceleration_max: surge.acceleration_max,
        deceleration_max: surge.deceleration_max,
    };
    let craft = Craft {
        heading,
        surge,
        sway_per_yaw_rate: sway_per_yaw_rate(&ramp),
        power: propulsion_power(hull, speed_max),
        speed_held: autopilot.speed_held,
        heading_held: autopilot.heading_held,
    };
    if !CraftDescription::from(&craft).faults().is_empty() {
        return Err(StepTestFailed::OutOfRange);
    }
    Ok(StepTestResult { limits, craft })
}

struct StepTest<'a> {
    hull: &'a SurfaceHull,
    autopilot: &'a SurfaceAutopilot,
}

impl StepTest<'_> {
    /// Steady to the north at `speed`, then references (speed, heading) over time.
    fn fly(&self, speed: f64, duration: f64, references: impl Fn(f64) -> (f64, f64)) -> Vec<Sample> {
        let mut craft = SurfaceCraft::cruising(*self.hull, *self.autopilot, &Vector2::zeros(), 0.0, speed);
        let mut samples = Vec::with_capacity(1000);
        let mut time = 0.0;
        while time < duration {
            let (speed, heading) = references(time);
            let reference = Reference { speed, heading: Heading::new(heading) };
            let [u, v] = [craft.state[3], craft.state[4]];
            let drift = match self.autopilot.heading_held {
                HeadingReference::Heading => 0.0,
                HeadingReference::Course => v.atan2(u),
            };
            samples.push(Sample {
                reference,
                angle: craft.state[2] + drift,
                surge: u,
                sway: v,
                yaw_rate: craft.state[5],
            });
            craft.step(&reference, ThrusterHealth::SOUND, &Sea::calm());
            time += PERIOD;
        }
        samples
    }

    fn heading_step(&self, speed: f64) -> Result<Vec<Sample>, StepTestFailed> {
        let samples = self.fly(speed, HEADING_TIME, |_| (speed, HEADING_STEP));
        let waited = TIME_TO_63_MAX + self.delay();
        let answer = |sample: &Sample| sample.angle / HEADING_STEP;
        let end = &samples[samples.len() * 4 / 5..];
        let is_there = |sample: &Sample| (sample.angle - HEADING_STEP).abs() < HEADING_ERROR_MAX;
        if end.iter().all(is_there) && time_to_63(&samples, answer).is_some_and(|time| time < waited) {
            Ok(samples)
        } else {
            Err(StepTestFailed::Heading(speed))
        }
    }

    /// The fastest turn, rad/s, at which the craft keeps most of its top speed, m/s, and that
    /// speed: limits describe a hull at most speeds, not its fastest turn at half the speed.
    fn turn_and_speed(&self, top: f64, turn_rate: f64) -> Result<(f64, f64), StepTestFailed> {
        let mut best: Option<(f64, f64)> = None;
        for share in TURN_SHARES {
            let rate = share * turn_rate;
            let Some(speed) = self.speed_max(top, rate) else { continue };
            if best.is_none_or(|(_, slower)| slower < speed) {
                best = Some((rate, speed));
            }
            if GOOD_TOP * top <= speed {
                break;
            }
        }
        best.filter(|(_, speed)| TOP_MIN <= *speed).ok_or(StepTestFailed::NoSpeed)
    }

    /// The fastest reference at which the craft turns and keeps its speed, m/s.
    fn speed_max(&self, top: f64, turn_rate_max: f64) -> Option<f64> {
        let rate = TRIED_TURN * turn_rate_max;
        let steers = |speed: f64| {
            let samples = self.fly(speed, TURN_TIME, |time| (speed, rate * time));
            let end = &samples[samples.len() * 3 / 4..];
            mean(end, |sample| sample.surge) > KEPT_IN_TURN * speed
                && (mean(end, |sample| sample.yaw_rate) / rate - 1.0).abs() < RATE_TOLERANCE
        };
        let speeds = TOP_SHARES.map(|share| share * top);
        speeds.into_iter().find(|speed| steers(*speed))
    }

    fn surge(&self, speed_max: f64) -> Result<SurgeResponse, StepTestFailed> {
        let [slow, middle, fast] = [0.3, 0.45, 0.95].map(|share| share * speed_max);
        let mut trials = vec![];
        for (from, to, duration) in
            [(slow, middle, SPEED_TIME), (slow, fast, SPEED_TIME_LARGE), (fast, slow, SPEED_TIME_LARGE)]
        {
            let samples = self.fly(from, duration, |_| (to, 0.0));
            let answer = |sample: &Sample| (sample.surge - from) / (to - from);
            let gone = (to - from).abs() / self.acceleration();
            let waited = TIME_TO_63_MAX + self.delay() + gone;
            let end = samples[samples.len() - 1].surge;
            let settled = (end - to).abs() < SPEED_ERROR_SHARE * speed_max;
            if !settled || time_to_63(&samples, answer).is_none_or(|time| waited < time) {
                return Err(StepTestFailed::Speed(from, to));
            }
            trials.push(samples);
        }
        Ok(fit_surge(&trials))
    }

    /// Largest acceleration that the autopilot commands, m/s².
    fn acceleration(&self) -> f64 {
        let clamped =
            self.autopilot.surge.proportional * self.autopilot.surge.error_max / self.hull.mass_surge;
        let slew = self.autopilot.speed_slew;
        slew.map_or(clamped, |slew| clamped.min(slew.acceleration).min(slew.deceleration))
    }

    fn delay(&self) -> f64 {
        PERIOD * f64::from(u32::try_from(self.autopilot.delay_periods).expect("dozens"))
    }
}

fn mean(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    samples.iter().map(of).sum::<f64>() / samples.iter().map(|_| 1.0).sum::<f64>()
}

/// Time at which an answer from 0 to 1 first exceeds 63 %, s.
fn time_to_63(samples: &[Sample], answer: impl Fn(&Sample) -> f64) -> Option<f64> {
    let there = samples.iter().position(|sample| 0.632 <= answer(sample))?;
    Some(PERIOD * f64::from(u32::try_from(there).expect("trials are short")))
}

/// Fastest turn over a second, rad/s.
fn peak_rate(samples: &[Sample]) -> f64 {
    let second = 10;
    let rate = |window| mean(window, |sample| sample.yaw_rate.abs());
    samples.windows(second).map(rate).fold(0.0, f64::max)
}

/// k_β of v = −k_β u r in a steady turn, s.
fn sway_per_yaw_rate(ramp: &[Sample]) -> f64 {
    let end = &ramp[ramp.len() * 3 / 4..];
    let ur = mean(end, |sample| sample.surge * sample.yaw_rate);
    -mean(end, |sample| sample.sway) / ur
}

/// Least-squares P = c₁ u + c₃ u³ to the power at steady speeds, with coefficients of at least 0.
fn propulsion_power(hull: &SurfaceHull, speed_max: f64) -> Power {
    let points = [0.2, 0.4, 0.6, 0.8, 1.0].map(|share| {
        let speed = share * speed_max;
        let steady = hull.cruising(&Vector2::zeros(), 0.0, speed);
        (speed, hull.propulsion_power(&steady))
    });
    let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|(u, p)| of(*u, *p)).sum::<f64>();
    let (a, b, c) = (sum(&|u, _| u * u), sum(&|u, _| u.powi(4)), sum(&|u, _| u.powi(6)));
    let (d, e) = (sum(&|u, p| u * p), sum(&|u, p| u.powi(3) * p));
    let determinant = a * c - b * b;
    let (linear, cubic) = ((d * c - e * b) / determinant, (a * e - b * d) / determinant);
    let (linear_w_per_mps, cubic_w_per_mps3) = if linear < 0.0 {
        (0.0, e / c)
    } else if cubic < 0.0 {
        (d / a, 0.0)
    } else {
        (linear, cubic)
    };
    Power { linear_w_per_mps, cubic_w_per_mps3 }
}
