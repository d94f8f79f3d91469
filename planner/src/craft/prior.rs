//! Prior knowledge of a craft before it moves.

use nalgebra::Vector2;

use crate::craft::closed_loop::{Craft, HeadingReference, SpeedReference};
use crate::craft::description::CraftDescription;
use crate::craft::model::CraftModel;
use crate::facts::asc::Limits;
use crate::tuned::CraftNumbers;

/// A number with a standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaussian {
    /// Its mean.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
}

impl Gaussian {
    /// Largest plausible logarithm of a lag with this prior.
    pub(crate) fn largest(&self, tuned: &CraftNumbers) -> f64 {
        self.mean + self.most(tuned)
    }

    pub(crate) fn bounded(&self, log_lag: f64, tuned: &CraftNumbers) -> f64 {
        log_lag.clamp(self.mean - self.most(tuned), self.largest(tuned))
    }

    fn most(&self, tuned: &CraftNumbers) -> f64 {
        (tuned.lag_deviations * self.variance.sqrt()).max(tuned.log_lag_spread_min)
    }
}

/// Default relative standard deviation of a client's description.
const DECLARED_UNCERTAINTY: f64 = 0.15;

/// Shortest lag in a logarithm, s.
const LAG_MIN: f64 = 0.2;

/// The declared craft with its uncertainty; undeclared members are the generic craft's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The craft.
    pub craft: Craft,
    /// Logarithm of the heading loop's time constant in s.
    pub heading_lag: Gaussian,
    /// Logarithm of the speed loop's time constant in s.
    pub surge_lag: Gaussian,
    /// Sway per surge and yaw rate, s.
    pub drift: Gaussian,
    /// Declared mode of the heading loop.
    pub heading_held: Option<HeadingReference>,
    /// Declared mode of the speed loop.
    pub speed_held: Option<SpeedReference>,
    /// `true` if the heading loop is declared.
    pub heading_declared: bool,
    /// `true` if the speed loop is declared.
    pub surge_declared: bool,
}

impl Prior {
    pub(crate) fn delays(&self) -> Vector2<f64> {
        Vector2::new(self.craft.heading.effective_delay(), self.craft.surge.delay)
    }

    /// The slowest plausible craft.
    pub(crate) fn slowest(&self, limits: &Limits, tuned: &CraftNumbers) -> CraftModel {
        let craft = CraftModel::new(&self.craft, limits);
        let share = |declared| {
            if declared { tuned.slowest_rate_declared } else { tuned.slowest_rate }
        };
        let (turning, surging) = (share(self.heading_declared), share(self.surge_declared));
        CraftModel {
            heading_time: self.heading_lag.largest(tuned).exp(),
            surge_time: self.surge_lag.largest(tuned).exp(),
            limits: Limits {
                turn_rate_max: turning * craft.limits.turn_rate_max,
                acceleration_max: surging * craft.limits.acceleration_max,
                deceleration_max: surging * craft.limits.deceleration_max,
                ..craft.limits
            },
            ..craft
        }
    }

    pub(crate) fn new(declared: &CraftDescription, tuned: &CraftNumbers) -> Self {
        let craft = declared.craft();
        let sigma = declared.relative_uncertainty.unwrap_or(DECLARED_UNCERTAINTY);
        let by_name = declared.preset().is_some_and(|preset| preset.name != "generic");
        let lag_sigma = |declared| if declared { sigma } else { tuned.lag_sigma };
        let heading_declared = by_name || declared.heading_loop.dynamics().is_some();
        let surge_declared = by_name || declared.surge_loop.time_constant_s.is_some();
        let drift_declared = by_name || declared.sway_per_yaw_rate_s.is_some();
        let lag = |seconds: f64, declared| Gaussian {
            mean: seconds.max(LAG_MIN).ln(),
            variance: lag_sigma(declared) * lag_sigma(declared),
        };
        let drift_sigma = if drift_declared {
            (sigma * craft.sway_per_yaw_rate.abs()).max(tuned.drift_sigma_min)
        } else {
            tuned.drift_sigma
        };
        Self {
            heading_lag: lag(craft.heading.time_constant(), heading_declared),
            surge_lag: lag(craft.surge.time_constant, surge_declared),
            drift: Gaussian { mean: craft.sway_per_yaw_rate, variance: drift_sigma * drift_sigma },
            heading_held: declared.heading_held.or(by_name.then_some(craft.heading_held)),
            speed_held: declared.speed_held.or(by_name.then_some(craft.speed_held)),
            heading_declared,
            surge_declared,
            craft,
        }
    }
}
