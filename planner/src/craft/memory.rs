//! The estimate of the craft as numbers, which a client returns with its next request.

use std::ops::RangeInclusive;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::{
    craft::{
        effect::{self, Effect},
        estimate::{CraftEstimate, EVIDENCE_MAX, VARIANCE_MAX},
        monitor::{Monitor, Realised, SINCE_MAX},
        prior::Gaussian,
    },
    facts::{previous_plan::PreviousPlan, ranges::CURRENT_MAX},
};

/// Length of a [`CraftEstimate`]'s memory.
pub const MEMORY_LENGTH: usize = 53;

/// Index of the craft's position in it.
const POSITION: usize = 31;

/// Length of earlier answers' memories, without the tests for effects, which then start now.
const MEMORY_LENGTH_WITHOUT_EFFECTS: usize = 43;

/// Largest declared drift in a turn, s; its variance at twice the uncertainty bounds a memory.
const DRIFT_DECLARED_MAX: f64 = 20.0;

/// Largest variance of the drift, s².
const DRIFT_VARIANCE_MAX: f64 = 4.0 * DRIFT_DECLARED_MAX * DRIFT_DECLARED_MAX;

/// Tolerance for a negative eigenvalue through rounding, relative to the largest element.
const COVARIANCE_ROUNDING: f64 = 1.0e-9;

impl PreviousPlan {
    /// `true` if its memory of the craft cannot be used.
    #[must_use]
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
        }
        for visit in self.schedule.iter_mut().flat_map(|schedule| &mut schedule.visits) {
            put(&mut visit.north_m, &mut visit.east_m);
        }
        let memory = self
            .craft_estimate
            .as_mut()
            .map(|craft| craft.memory.as_mut_slice());
        if let Some([north, east]) = memory.and_then(|memory| memory.get_mut(POSITION..POSITION + 2)) {
            put(north, east);
        }
    }

    /// Its estimate of the craft; none if the memory cannot be used.
    #[must_use]
    pub fn craft(&self) -> Option<CraftEstimate> {
        CraftEstimate::from_memory(&self.craft_estimate.as_ref()?.memory)
    }
}

impl CraftEstimate {
    /// All its numbers; only [`Self::from_memory`] knows their order.
    #[must_use]
    pub fn memory(&self) -> [f64; MEMORY_LENGTH] {
        let mut memory = [0.0; MEMORY_LENGTH];
        let numbers = vector(&self.heading)
            .chain(upper(&self.heading_covariance))
            .chain(vector(&self.surge))
            .chain(upper(&self.surge_covariance))
            .chain([
                self.delays.x,
                self.delays.y,
                self.followed_heading,
                self.followed_speed,
                self.followed_command.x,
                self.followed_command.y,
                self.evidence.x,
                self.evidence.y,
                self.drift.mean,
                self.drift.variance,
                self.current.x,
                self.current.y,
                self.current_variance,
                self.position.x,
                self.position.y,
            ])
            .chain(self.monitor.memory())
            .chain(self.realised.memory())
            .chain(self.heading_effect.memory())
            .chain(self.speed_effect.memory());
        for (place, number) in memory.iter_mut().zip(numbers) {
            *place = number;
        }
        memory
    }

    /// Inverse of [`Self::memory`]; none for a missing or invalid number or covariance.
    #[must_use]
    pub fn from_memory(memory: &[f64]) -> Option<Self> {
        if ![MEMORY_LENGTH_WITHOUT_EFFECTS, MEMORY_LENGTH].contains(&memory.len()) {
            return None;
        }
        let mut left = memory.iter().copied();
        let mut take = |range: RangeInclusive<f64>| left.next().filter(|number| range.contains(number));
        let (angle, speed) = (-4.0..=4.0, -40.0..=40.0);
        let log_time = -7.0..=7.0;
        let heading = Vector3::new(
            take(angle.clone())?,
            take(log_time.clone())?,
            take(angle.clone())?,
        );
        let heading_covariance = covariance([(); 6].map(|()| take(-VARIANCE_MAX..=VARIANCE_MAX)))?;
        let surge = Vector3::new(take(speed.clone())?, take(log_time)?, take(-20.0..=20.0)?);
        let surge_covariance = covariance([(); 6].map(|()| take(-VARIANCE_MAX..=VARIANCE_MAX)))?;
        let mut estimate = Self {
            heading,
            heading_covariance,
            surge,
            surge_covariance,
            delays: Vector2::new(take(0.0..=1.0e3)?, take(0.0..=1.0e3)?),
            followed_heading: take(angle.clone())?,
            followed_speed: take(speed.clone())?,
            followed_command: Vector2::new(take(angle.clone())?, take(speed.clone())?),
            evidence: Vector2::new(
                take(-EVIDENCE_MAX..=EVIDENCE_MAX)?,
                take(-EVIDENCE_MAX..=EVIDENCE_MAX)?,
            ),
            drift: Gaussian {
                mean: take(-DRIFT_DECLARED_MAX..=DRIFT_DECLARED_MAX)?,
                variance: take(0.0..=DRIFT_VARIANCE_MAX)?,
            },
            current: Vector2::new(
                take(-CURRENT_MAX..=CURRENT_MAX)?,
                take(-CURRENT_MAX..=CURRENT_MAX)?,
            ),
            current_variance: take(0.0..=VARIANCE_MAX)?,
            position: Vector2::new(take(-2.0e6..=2.0e6)?, take(-2.0e6..=2.0e6)?),
            monitor: Monitor {
                heading: take(angle)?,
                speed: take(speed)?,
                statistic: take(0.0..=1.0e3)?,
                alarm: take(0.0..=1.0)? > 0.5,
                heading_error: take(-4.0..=4.0)?,
                speed_error: take(-80.0..=80.0)?,
            },
            realised: Realised {
                planner: take(0.0..=1.0e9)?,
                law: take(0.0..=1.0e9)?,
                law_steers: take(0.0..=1.0)? > 0.5,
                since: take(0.0..=SINCE_MAX)?,
            },
            heading_effect: Effect::new(heading.x),
            speed_effect: Effect::new(surge.x),
        };
        if memory.len() == MEMORY_LENGTH {
            let mut effect = |state: RangeInclusive<f64>, change: RangeInclusive<f64>| {
                Some(Effect {
                    expected: take(state.clone())?,
                    seen: take(state)?,
                    expected_change: take(change.clone())?,
                    seen_change: take(change)?,
                    evidence: take(0.0..=effect::EVIDENCE_MAX)?,
                })
            };
            estimate.heading_effect = effect(-4.0..=4.0, -1.0e4..=1.0e4)?;
            estimate.speed_effect = effect(-1.0e3..=1.0e3, -1.0e4..=1.0e4)?;
        }
        Some(estimate)
    }
}

fn vector(vector: &Vector3<f64>) -> impl Iterator<Item = f64> {
    [vector.x, vector.y, vector.z].into_iter()
}

fn upper(matrix: &Matrix3<f64>) -> impl Iterator<Item = f64> {
    let m = matrix;
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33].into_iter()
}

/// The matrix of an upper triangle, if it is a covariance: no eigenvalue negative beyond rounding.
fn covariance(upper: [Option<f64>; 6]) -> Option<Matrix3<f64>> {
    let [m11, m12, m13, m22, m23, m33] = upper;
    let (m11, m12, m13, m22, m23, m33) = (m11?, m12?, m13?, m22?, m23?, m33?);
    let matrix = Matrix3::new(m11, m12, m13, m12, m22, m23, m13, m23, m33);
    let rounding = COVARIANCE_ROUNDING * matrix.amax();
    (-rounding <= matrix.symmetric_eigenvalues().min()).then_some(matrix)
}
