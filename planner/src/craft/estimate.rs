//! Estimate of the craft's loops, with its uncertainty.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::craft::effect::Effect;
use crate::craft::monitor::{Monitor, Realised, Trial};
use crate::craft::prior::Gaussian;
use crate::tuned::CraftNumbers;

/// Standard deviation below which a current from positions is used, m/s.
const CURRENT_KNOWN: f64 = 0.1;

/// Bound of log-likelihood ratios, so that a switched mode is noticed.
pub(crate) const EVIDENCE_MAX: f64 = 10.0;

/// Largest variance.
pub(crate) const VARIANCE_MAX: f64 = 100.0;

/// Estimate of the craft's loops from declaration and response; the next request returns it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CraftEstimate {
    /// Filtered heading, rad; logarithm of its time constant in s; offset from the reference, rad.
    pub heading: Vector3<f64>,
    /// Covariance of the same.
    pub heading_covariance: Matrix3<f64>,
    /// Declared delays of the heading loop and of the speed loop, s.
    pub delays: Vector2<f64>,
    /// Heading reference behind the loop's delay, rad.
    pub followed_heading: f64,
    /// Speed reference behind the loop's delay, m/s.
    pub followed_speed: f64,
    /// Heading and speed of the command behind the loops' delays, rad and m/s.
    pub followed_command: Vector2<f64>,
    /// Bounded log-likelihood ratios, 0 if unknown: the loops hold course and speed over ground.
    pub evidence: Vector2<f64>,
    /// Filtered surge, m/s; logarithm of its time constant in s; acceleration disturbance, m/s².
    pub surge: Vector3<f64>,
    /// Covariance of the same.
    pub surge_covariance: Matrix3<f64>,
    /// Sway per surge and yaw rate k_β, s.
    pub drift: Gaussian,
    /// Current (north, east) from positions and speed through the water, m/s.
    pub current: Vector2<f64>,
    /// Variance of the current along an axis, (m/s)².
    pub current_variance: f64,
    /// Position at that time (north, east), m.
    pub position: Vector2<f64>,
    /// Test of the craft against its prediction.
    pub monitor: Monitor,
    /// Test of the heading references' effect.
    pub heading_effect: Effect,
    /// Test of the speed references' effect.
    pub speed_effect: Effect,
    /// Distances to the goal under the planner and under the law.
    pub realised: Realised,
    /// Planner and laws, simulated beside the craft.
    pub trial: Trial,
}

impl CraftEstimate {
    /// Time constant of the heading loop, s: median and standard deviation.
    pub fn heading_time(&self) -> (f64, f64) {
        log_normal(self.heading.y, self.heading_covariance.m22)
    }

    /// Time constant of the speed loop, s: median and standard deviation.
    pub fn surge_time(&self) -> (f64, f64) {
        log_normal(self.surge.y, self.surge_covariance.m22)
    }

    /// Lag behind a reference that turns steadily, s, and its standard deviation.
    pub fn heading_lag(&self, tuned: &CraftNumbers) -> (f64, f64) {
        let (time, sigma) = self.heading_time();
        with_model_error(self.delays.x + time, sigma, tuned)
    }

    /// Lag behind a reference that rises steadily, s, and its standard deviation.
    pub fn surge_lag(&self, tuned: &CraftNumbers) -> (f64, f64) {
        let (time, sigma) = self.surge_time();
        with_model_error(self.delays.y + time, sigma, tuned)
    }

    /// Offset of the heading from its reference, rad, and its standard deviation.
    pub fn heading_offset(&self) -> (f64, f64) {
        (self.heading.z, self.heading_covariance.m33.sqrt())
    }

    /// Acceleration disturbance of the speed loop, m/s², and its standard deviation.
    pub fn surge_disturbance(&self) -> (f64, f64) {
        (self.surge.z, self.surge_covariance.m33.sqrt())
    }

    /// Current from positions (north, east), m/s, if sufficiently known.
    pub fn current_from_positions(&self) -> Option<Vector2<f64>> {
        (self.current_variance < CURRENT_KNOWN * CURRENT_KNOWN).then_some(self.current)
    }
}

/// Adds the approximation error of delay and first-order lag to a lag's standard deviation.
fn with_model_error(lag: f64, sigma: f64, tuned: &CraftNumbers) -> (f64, f64) {
    (lag, sigma.hypot(tuned.lag_model_error * lag))
}

fn log_normal(mean: f64, variance: f64) -> (f64, f64) {
    let median = mean.exp();
    (median, median * variance.max(0.0).sqrt())
}
