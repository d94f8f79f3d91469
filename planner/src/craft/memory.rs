//! The estimate of the craft as numbers, which a client returns with its next request.

use std::ops::RangeInclusive;

use nalgebra::{Matrix3, Vector2};

use crate::craft::effect::{self, Effect};
use crate::craft::estimate::{CraftEstimate, EVIDENCE_MAX, VARIANCE_MAX};
use crate::craft::monitor::{DISTANCE_MAX, LAWS, SINCE_MAX, Trial};
use crate::facts::previous_plan::PreviousPlan;
use crate::facts::ranges::CURRENT_MAX;

/// Length of a [`CraftEstimate`]'s memory.
pub const MEMORY_LENGTH: usize = MEMORY_LENGTH_WITHOUT_TRIAL + 11 * (LAWS + 1) + 5;

/// Index of the craft's position in it.
const POSITION: usize = 31;

/// Lengths of earlier answers' memories: without the trial, or without the tests for effects.
const MEMORY_LENGTH_WITHOUT_TRIAL: usize = 53;
const MEMORY_LENGTH_WITHOUT_EFFECTS: usize = 43;

/// Largest declared drift in a turn, s; its variance at twice the uncertainty bounds a memory.
const DRIFT_DECLARED_MAX: f64 = 20.0;

/// Largest variance of the drift, s².
const DRIFT_VARIANCE_MAX: f64 = 4.0 * DRIFT_DECLARED_MAX * DRIFT_DECLARED_MAX;

/// Tolerance for a negative eigenvalue through rounding, relative to the largest element.
const COVARIANCE_ROUNDING: f64 = 1.0e-9;

impl PreviousPlan {
    /// `true` if its memory of the craft cannot be used.
    pub fn has_unusable_memory(&self) -> bool {
        let memory = self.craft_estimate.as_ref().map(|craft| craft.memory.as_slice());
        memory.is_some_and(|memory| !memory.is_empty() && CraftEstimate::from_memory(memory).is_none())
    }

    /// Replaces every position (north, east), m, by `moved` of it.
    pub fn move_positions(&mut self, moved: impl Fn(Vector2<f64>) -> Vector2<f64>) {
        let put = |north: &mut f64, east: &mut f64| {
            let position = moved(Vector2::new(*north, *east));
            (*north, *east) = (position.x, position.y);
        };
        for point in &mut self.trajectory {
            put(&mut point.north_m, &mut point.east_m);
        }
        for target in self.targets.iter_mut().flatten() {
            if let Some(estimate) = &mut target.estimate {
                put(&mut estimate.north_m, &mut estimate.east_m);
            }
            for [_, north, east] in &mut target.track {
                put(north, east);
            }
            for [_, north, east, ..] in &mut target.states {
                put(north, east);
            }
            for [_, _, _, north, east, ..] in target.ranging.iter_mut().flat_map(|of| &mut of.gaussians) {
                put(north, east);
            }
        }
        for visit in self.schedule.iter_mut().flat_map(|schedule| &mut schedule.visits) {
            put(&mut visit.north_m, &mut visit.east_m);
        }
        if let Some(figure) = &mut self.figure {
            put(&mut figure.north_m, &mut figure.east_m);
        }
        let memory = self.craft_estimate.as_mut().map(|craft| craft.memory.as_mut_slice());
        if let Some([north, east]) = memory.and_then(|memory| memory.get_mut(POSITION..POSITION + 2)) {
            put(north, east);
        }
    }

    /// Its estimate of the craft; none if the memory cannot be used.
    pub fn craft(&self) -> Option<CraftEstimate> {
        CraftEstimate::from_memory(&self.craft_estimate.as_ref()?.memory)
    }
}

impl CraftEstimate {
    /// All its numbers, as [`Self::from_memory`] reads them.
    pub fn memory(&self) -> [f64; MEMORY_LENGTH] {
        let mut memory = [0.0; MEMORY_LENGTH];
        let mut places = memory.iter_mut();
        let mut copy = *self;
        copy.each(&mut |number, _| *places.next().expect("a place for each number") = *number);
        memory
    }

    /// Inverse of [`Self::memory`]; none for a missing or invalid number or covariance.
    pub fn from_memory(memory: &[f64]) -> Option<Self> {
        if ![MEMORY_LENGTH_WITHOUT_EFFECTS, MEMORY_LENGTH_WITHOUT_TRIAL, MEMORY_LENGTH]
            .contains(&memory.len())
        {
            return None;
        }
        let (mut estimate, mut is_valid) = (Self::default(), true);
        let mut left = memory.iter();
        estimate.each(&mut |number, range| {
            if let Some(remembered) = left.next() {
                is_valid &= range.contains(remembered);
                *number = *remembered;
            }
        });
        if memory.len() < MEMORY_LENGTH {
            estimate.trial = Trial::new(estimate.heading.x, estimate.surge.x);
        }
        if memory.len() < MEMORY_LENGTH_WITHOUT_TRIAL {
            estimate.heading_effect = Effect::new(estimate.heading.x);
            estimate.speed_effect = Effect::new(estimate.surge.x);
        }
        let covariances = [&estimate.heading_covariance, &estimate.surge_covariance];
        (is_valid && covariances.into_iter().all(is_covariance)).then_some(estimate)
    }

    /// Visits all its numbers with their ranges, in the order of the memory.
    fn each(&mut self, visit: &mut dyn FnMut(&mut f64, RangeInclusive<f64>)) {
        let (angle, speed, log_time) = (4.0, 40.0, 7.0);
        let loops = [
            (&mut self.heading, &mut self.heading_covariance, angle, angle),
            (&mut self.surge, &mut self.surge_covariance, speed, 20.0),
        ];
        for (state, covariance, most, offset) in loops {
            for (number, most) in state.iter_mut().zip([most, log_time, offset]) {
                visit(number, -most..=most);
            }
            for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
                visit(&mut covariance[(row, column)], -VARIANCE_MAX..=VARIANCE_MAX);
                covariance[(column, row)] = covariance[(row, column)];
            }
        }
        visit(&mut self.delays.x, 0.0..=1.0e3);
        visit(&mut self.delays.y, 0.0..=1.0e3);
        visit(&mut self.followed_heading, -angle..=angle);
        visit(&mut self.followed_speed, -speed..=speed);
        visit(&mut self.followed_command.x, -angle..=angle);
        visit(&mut self.followed_command.y, -speed..=speed);
        for evidence in &mut self.evidence {
            visit(evidence, -EVIDENCE_MAX..=EVIDENCE_MAX);
        }
        visit(&mut self.drift.mean, -DRIFT_DECLARED_MAX..=DRIFT_DECLARED_MAX);
        visit(&mut self.drift.variance, 0.0..=DRIFT_VARIANCE_MAX);
        for current in &mut self.current {
            visit(current, -CURRENT_MAX..=CURRENT_MAX);
        }
        visit(&mut self.current_variance, 0.0..=VARIANCE_MAX);
        for position in &mut self.position {
            visit(position, -2.0e6..=2.0e6);
        }
        let monitor = &mut self.monitor;
        visit(&mut monitor.heading, -angle..=angle);
        visit(&mut monitor.speed, -speed..=speed);
        visit(&mut monitor.statistic, 0.0..=1.0e3);
        visit_flag(&mut monitor.alarm, visit);
        visit(&mut monitor.heading_error, -angle..=angle);
        visit(&mut monitor.speed_error, -80.0..=80.0);
        let realised = &mut self.realised;
        visit(&mut realised.planner, 0.0..=1.0e9);
        visit(&mut realised.law, 0.0..=1.0e9);
        visit_flag(&mut realised.law_steers, visit);
        visit(&mut realised.since, 0.0..=SINCE_MAX);
        for (effect, most) in [(&mut self.heading_effect, angle), (&mut self.speed_effect, 1.0e3)] {
            visit(&mut effect.expected, -most..=most);
            visit(&mut effect.seen, -most..=most);
            visit(&mut effect.expected_change, -1.0e4..=1.0e4);
            visit(&mut effect.seen_change, -1.0e4..=1.0e4);
            visit(&mut effect.evidence, 0.0..=effect::EVIDENCE_MAX);
        }
        let trial = &mut self.trial;
        for craft in &mut trial.crafts {
            visit_flag(&mut craft.steers, visit);
            let places = craft.offset.iter_mut().chain(&mut craft.then);
            places.for_each(|along| visit(along, -DISTANCE_MAX..=DISTANCE_MAX));
            visit(&mut craft.heading, -angle..=angle);
            visit(&mut craft.speed, -speed..=speed);
            visit(&mut craft.asked.x, -angle..=angle);
            visit(&mut craft.asked.y, -speed..=speed);
            visit(&mut craft.square, 0.0..=1.0e9);
            visit(&mut craft.evidence, 0.0..=SINCE_MAX);
        }
        trial.place.iter_mut().for_each(|along| visit(along, -DISTANCE_MAX..=DISTANCE_MAX));
        for time in [&mut trial.waiting, &mut trial.since, &mut trial.hold] {
            visit(time, 0.0..=SINCE_MAX);
        }
    }
}

fn visit_flag(flag: &mut bool, visit: &mut dyn FnMut(&mut f64, RangeInclusive<f64>)) {
    let mut number = f64::from(u8::from(*flag));
    visit(&mut number, 0.0..=1.0);
    *flag = number > 0.5;
}

/// `true` for a covariance: no eigenvalue is negative beyond rounding.
fn is_covariance(matrix: &Matrix3<f64>) -> bool {
    -COVARIANCE_ROUNDING * matrix.amax() <= matrix.symmetric_eigenvalues().min()
}
