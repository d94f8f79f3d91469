//! What is known of the craft's loops, and how surely.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::craft::{
    effect::Effect,
    monitor::{Monitor, Realised},
    prior::Gaussian,
};

/// Standard deviation below which a current found from positions is known, m/s.
const CURRENT_KNOWN: f64 = 0.1;

/// Largest log-likelihood ratio that is remembered, so that a craft whose mode is switched is noticed.
pub(crate) const EVIDENCE_MAX: f64 = 10.0;

/// Largest variance that is accepted.
pub(crate) const VARIANCE_MAX: f64 = 100.0;

/// Relative standard deviation of a loop's lag about that of the delay and the first-order lag that come nearest to it.
/// See `docs/rationale.md#learning-the-craft`.
const LAG_MODEL_ERROR: f64 = 0.15;

/// What is known of the craft's loops: from what was declared, and from how it answered. Hand it back, and the next answer
/// knows more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraftEstimate {
    /// Heading as filtered, rad, the logarithm of its time constant in s, and its offset from the reference, rad.
    pub heading: Vector3<f64>,
    /// Covariance of the same.
    pub heading_covariance: Matrix3<f64>,
    /// Delays of the heading loop and of the speed loop, as declared, s.
    pub delays: Vector2<f64>,
    /// Heading reference behind the loop's delay, rad.
    pub followed_heading: f64,
    /// Speed reference behind the loop's delay, m/s.
    pub followed_speed: f64,
    /// Heading and speed of the command, whatever its loops hold, behind the loops' delays, rad and m/s.
    pub followed_command: Vector2<f64>,
    /// Evidence that the heading loop holds the course over ground, and that the speed loop holds the speed over ground:
    /// a log-likelihood ratio each, bounded, 0 where nothing is known.
    pub evidence: Vector2<f64>,
    /// Surge speed as filtered, m/s, the logarithm of its time constant in s, and what the loop gives unasked, m/s².
    pub surge: Vector3<f64>,
    /// Covariance of the same.
    pub surge_covariance: Matrix3<f64>,
    /// Sway per surge and yaw rate k_β, s.
    pub drift: Gaussian,
    /// Current (north, east) found from positions and speed through the water, m/s.
    pub current: Vector2<f64>,
    /// Its variance along an axis, (m/s)².
    pub current_variance: f64,
    /// Position then (north, east), m.
    pub position: Vector2<f64>,
    /// Whether the craft does what is predicted.
    pub monitor: Monitor,
    /// Whether heading references have an effect.
    pub heading_effect: Effect,
    /// Whether speed references have an effect.
    pub speed_effect: Effect,
    /// How near the planner and the law kept it to its goal.
    pub realised: Realised,
}

impl CraftEstimate {
    /// Time constant of the heading loop, s: the median, and its standard deviation.
    #[must_use]
    pub fn heading_time(&self) -> (f64, f64) {
        log_normal(self.heading.y, self.heading_covariance.m22)
    }

    /// Time constant of the speed loop, s: the median, and its standard deviation.
    #[must_use]
    pub fn surge_time(&self) -> (f64, f64) {
        log_normal(self.surge.y, self.surge_covariance.m22)
    }

    /// By how much the heading is behind a reference that turns steadily, s, and the standard deviation of that.
    #[must_use]
    pub fn heading_lag(&self) -> (f64, f64) {
        let (time, sigma) = self.heading_time();
        of_a_model(self.delays.x + time, sigma)
    }

    /// By how much the speed is behind a reference that rises steadily, s, and the standard deviation of that.
    #[must_use]
    pub fn surge_lag(&self) -> (f64, f64) {
        let (time, sigma) = self.surge_time();
        of_a_model(self.delays.y + time, sigma)
    }

    /// What the heading stays off its reference, rad, and its standard deviation.
    #[must_use]
    pub fn heading_offset(&self) -> (f64, f64) {
        (self.heading.z, self.heading_covariance.m33.sqrt())
    }

    /// Acceleration that the speed loop gives unasked, m/s², and its standard deviation.
    #[must_use]
    pub fn surge_disturbance(&self) -> (f64, f64) {
        (self.surge.z, self.surge_covariance.m33.sqrt())
    }

    /// Current found from positions (north, east), m/s, where it is known better than not at all.
    #[must_use]
    pub fn current_from_positions(&self) -> Option<Vector2<f64>> {
        (self.current_variance < CURRENT_KNOWN * CURRENT_KNOWN).then_some(self.current)
    }
}

/// A lag and its standard deviation as an estimate's, which is of a delay and a first-order lag: that of the loop too.
fn of_a_model(lag: f64, sigma: f64) -> (f64, f64) {
    (lag, sigma.hypot(LAG_MODEL_ERROR * lag))
}

fn log_normal(mean: f64, variance: f64) -> (f64, f64) {
    let median = mean.exp();
    (median, median * variance.max(0.0).sqrt())
}
