//! What the planner knows of its craft as numbers that a client hands back with its next request.

use std::ops::RangeInclusive;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::{
    craft::{
        estimate::{CraftEstimate, EVIDENCE_MAX, VARIANCE_MAX},
        monitor::{Monitor, Realised},
        prior::Gaussian,
    },
    facts::ranges::CURRENT_MAX,
};

/// How many numbers a [`CraftEstimate`] is.
pub const MEMORY_LENGTH: usize = 43;

/// Largest drift in a turn that may be declared, s, and its variance where that is twice as uncertain: memories begin with it.
const DRIFT_DECLARED_MAX: f64 = 20.0;

/// As above, s².
const DRIFT_VARIANCE_MAX: f64 = 4.0 * DRIFT_DECLARED_MAX * DRIFT_DECLARED_MAX;

impl CraftEstimate {
    /// All its numbers, in an order that only [`Self::from_memory`] knows.
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
            .chain(self.realised.memory());
        for (place, number) in memory.iter_mut().zip(numbers) {
            *place = number;
        }
        memory
    }

    /// What [`Self::memory`] gave; none where it is not whole, or a number is out of the range that it can have.
    #[must_use]
    pub fn from_memory(memory: &[f64]) -> Option<Self> {
        let numbers: &[f64; MEMORY_LENGTH] = memory.try_into().ok()?;
        let mut left = numbers.iter().copied();
        let mut take = |range: RangeInclusive<f64>| left.next().filter(|number| range.contains(number));
        let (angle, speed) = (-4.0..=4.0, -40.0..=40.0);
        let log_time = -6.0..=6.0;
        let heading = Vector3::new(
            take(angle.clone())?,
            take(log_time.clone())?,
            take(angle.clone())?,
        );
        let heading_covariance = covariance([(); 6].map(|()| take(-VARIANCE_MAX..=VARIANCE_MAX)))?;
        let surge = Vector3::new(take(speed.clone())?, take(log_time)?, take(-20.0..=20.0)?);
        let surge_covariance = covariance([(); 6].map(|()| take(-VARIANCE_MAX..=VARIANCE_MAX)))?;
        let estimate = Self {
            heading,
            heading_covariance,
            surge,
            surge_covariance,
            delays: Vector2::new(take(0.0..=100.0)?, take(0.0..=100.0)?),
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
                since: take(0.0..=1.0e12)?,
            },
        };
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

/// The matrix of an upper triangle, where it can be a covariance.
fn covariance([m11, m12, m13, m22, m23, m33]: [Option<f64>; 6]) -> Option<Matrix3<f64>> {
    let (m11, m12, m13, m22, m23, m33) = (m11?, m12?, m13?, m22?, m23?, m33?);
    let is_one = |a: f64, b: f64, ab: f64| a >= 0.0 && b >= 0.0 && ab * ab <= 2.0 * a * b + 1.0e-6;
    let plausible = is_one(m11, m22, m12) && is_one(m11, m33, m13) && is_one(m22, m33, m23);
    plausible.then(|| Matrix3::new(m11, m12, m13, m12, m22, m23, m13, m23, m33))
}
