//! Recent turns of heading, measured yaw rate and course.
//!
//! A current changes the turn of the course. It reverses it only if faster than the craft:
//!
//! ```text
//! v = u n(ψ) + c    dχ/dψ = u (u + c cos(ψ − χ_c))/v²    < 0 only where v < c, for constant u
//! ```
//! Headings and courses are means over the same seconds: waves and receivers' lags affect both.

use std::collections::VecDeque;

use nalgebra::Vector2;
use planner::angle::{angle_of, wrap};

use crate::recent_positions::trend;

/// Time between two samples, and the time for which they are kept, s.
const TURN_EACH_S: f64 = 1.0;
const TURN_KEPT_S: f64 = 20.0;
/// Time of a mean heading and course, s: about a wave.
const MEAN_S: f64 = 5.0;
/// Slowest useful mean velocity, m/s: 0.5 m/s of current makes up to 0.8 rad beside the heading.
const MEAN_SPEED: f64 = 0.7;
/// Opposite turns of heading and course that contradict, rad. Larger ones may be to the same side.
const OPPOSITE: [f64; 2] = [0.8, 2.2];
/// Difference of heading's and yaw rate's turns that contradicts, rad: twice a gyro's bias.
const OFF_RATE: f64 = 0.8;
/// Mean swing of the yaw rate, rad, and its time, s, that contradict a still heading: waves.
const SWING: f64 = 0.015;
const SWING_AFTER_S: f64 = 8.0;
/// The integral of a sampled yaw rate still turns when the heading has come to rest already, s.
const SETTLES_S: f64 = 2.0;

#[derive(Clone, Debug, Default)]
pub(super) struct Turns {
    samples: VecDeque<HeadingSample>,
    newest: Option<HeadingSample>,
}

#[derive(Clone, Copy, Debug)]
struct HeadingSample {
    t_s: f64,
    /// Heading without jumps at ±π, rad, and its integral, rad s.
    heading: f64,
    integral: f64,
    /// Integral of the yaw rate, rad, and its greatest error; `None` without a yaw rate.
    turned: Option<[f64; 2]>,
    travelled: Vector2<f64>,
}

impl Turns {
    /// Adds a heading, rad, with the integrals of yaw rate, rad, and velocity, m. A gap or a clock
    /// set back restarts. `true` if it is kept: new contradictions are possible.
    pub(super) fn push(
        &mut self,
        t_s: f64,
        heading: f64,
        turned: Option<[f64; 2]>,
        travelled: Vector2<f64>,
    ) -> bool {
        let first = HeadingSample { t_s, heading, integral: 0.0, turned, travelled };
        let newest = match self.newest {
            Some(before) if (0.0..=TURN_EACH_S).contains(&(t_s - before.t_s)) => {
                let change = wrap(heading - before.heading);
                HeadingSample {
                    heading: before.heading + change,
                    integral: before.integral + (before.heading + 0.5 * change) * (t_s - before.t_s),
                    ..first
                }
            }
            _ => {
                self.samples.clear();
                first
            }
        };
        self.newest = Some(newest);
        let last = self.samples.back();
        let is_kept = last.is_none_or(|last| t_s - last.t_s >= TURN_EACH_S);
        if is_kept {
            self.samples.push_back(newest);
        }
        let is_old = |oldest: &HeadingSample| t_s - oldest.t_s > TURN_KEPT_S;
        while self.samples.front().is_some_and(is_old) {
            self.samples.pop_front();
        }
        is_kept
    }

    /// `true` if the heading turned otherwise than the yaw rate.
    pub(super) fn contradict_rate(&self) -> bool {
        let off = |sample: &HeadingSample| {
            let [turned, error] = sample.turned?;
            Some((sample.heading - turned, error))
        };
        let Some((now, error)) = self.newest.as_ref().and_then(off) else {
            return false;
        };
        let mut earlier = self.samples.iter().rev().map_while(off);
        earlier.any(|(before, error_before)| (now - before).abs() >= OFF_RATE + error - error_before)
    }

    /// `true` if the heading turned opposite to the course.
    pub(super) fn contradict_course(&self) -> bool {
        let Some((heading, course)) = self.newest.as_ref().and_then(|newest| self.mean_until(newest)) else {
            return false;
        };
        let means = self.samples.iter().filter_map(|sample| self.mean_until(sample));
        means.into_iter().any(|(before, course_before)| {
            let turns = [wrap(heading - before), wrap(course - course_before)];
            let [least, most] = OPPOSITE;
            turns[0] * turns[1] < 0.0 && turns.iter().all(|turn| (least..=most).contains(&turn.abs()))
        })
    }

    /// `true` if the yaw rate has swung while the heading stayed, from `since_s` on, s.
    pub(super) fn swing_since(&self, since_s: f64) -> bool {
        let steady = self.samples.iter().rev();
        let steady = steady.take_while(|sample| since_s + SETTLES_S <= sample.t_s);
        let turned = steady.map_while(|sample| Some((sample.t_s, Vector2::new(sample.turned?[0], 0.0))));
        trend(turned).is_some_and(|trend| trend.span_s >= SWING_AFTER_S && trend.rms >= SWING)
    }

    /// Mean heading and course, rad, before `end`; `None` if unknown or if the craft was slow.
    fn mean_until(&self, end: &HeadingSample) -> Option<(f64, f64)> {
        let is_start = |sample: &&HeadingSample| end.t_s - sample.t_s <= MEAN_S + 0.5 * TURN_EACH_S;
        let start = self.samples.iter().find(is_start)?;
        let span = end.t_s - start.t_s;
        let velocity = (end.travelled - start.travelled) / span;
        let is_known = span >= MEAN_S - 0.5 * TURN_EACH_S && velocity.norm() >= MEAN_SPEED;
        is_known.then(|| ((end.integral - start.integral) / span, angle_of(&velocity)))
    }
}
