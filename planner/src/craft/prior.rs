//! Prior knowledge of a craft before it moves.

use nalgebra::Vector2;

use crate::{
    craft::{
        closed_loop::{Craft, HeadingReference, SpeedReference},
        description::CraftDescription,
        model::CraftModel,
    },
    facts::asc::Limits,
};

/// A number with a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Its mean.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
}

impl Gaussian {
    /// Largest plausible logarithm of a lag with this prior.
    pub(crate) fn largest(&self) -> f64 {
        self.mean + self.most()
    }

    /// `log_lag` within the plausible range.
    pub(crate) fn bounded(&self, log_lag: f64) -> f64 {
        log_lag.clamp(self.mean - self.most(), self.largest())
    }

    fn most(&self) -> f64 {
        (LAG_DEVIATIONS * self.variance.sqrt()).max(LOG_LAG_SPREAD_MIN)
    }
}

/// Default relative standard deviation of a client's description.
const DECLARED_UNCERTAINTY: f64 = 0.15;

/// Standard deviation of an undeclared time constant's logarithm: a factor of two.
const DEFAULT_LAG_SIGMA: f64 = 0.7;

/// Standard deviation of an undeclared drift in turns, s.
const DEFAULT_DRIFT_SIGMA: f64 = 0.7;

/// Smallest standard deviation of a drift in turns, s.
const DRIFT_SIGMA_MIN: f64 = 0.05;

/// Plausible deviation of a time constant in standard deviations: a factor of 4 for an undeclared
/// one. Beyond it the craft has a fault.
const LAG_DEVIATIONS: f64 = 2.0;

/// Least plausible deviation as a logarithm: a factor of 2.2 for a declared one.
const LOG_LAG_SPREAD_MIN: f64 = 0.8;

/// Share of its declared rates of the slowest plausible craft.
const SLOWEST_RATE_DECLARED: f64 = 0.7;

/// The same for undeclared rates.
const SLOWEST_RATE: f64 = 0.5;

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
    /// Delays of the heading loop and of the speed loop, s.
    pub(crate) fn delays(&self) -> Vector2<f64> {
        Vector2::new(self.craft.heading.effective_delay(), self.craft.surge.delay)
    }

    /// The slowest plausible craft.
    pub(crate) fn slowest(&self, limits: &Limits) -> CraftModel {
        let craft = CraftModel::new(&self.craft, limits);
        let share = |declared| {
            if declared {
                SLOWEST_RATE_DECLARED
            } else {
                SLOWEST_RATE
            }
        };
        let (turning, surging) = (share(self.heading_declared), share(self.surge_declared));
        CraftModel {
            heading_time: self.heading_lag.largest().exp(),
            surge_time: self.surge_lag.largest().exp(),
            limits: Limits {
                turn_rate_max: turning * craft.limits.turn_rate_max,
                acceleration_max: surging * craft.limits.acceleration_max,
                deceleration_max: surging * craft.limits.deceleration_max,
                ..craft.limits
            },
            ..craft
        }
    }
}

impl From<&CraftDescription> for Prior {
    fn from(declared: &CraftDescription) -> Self {
        let craft = declared.craft();
        let sigma = declared.relative_uncertainty.unwrap_or(DECLARED_UNCERTAINTY);
        let by_name = declared.preset().is_some_and(|preset| preset.name != "generic");
        let lag_sigma = |declared| if declared { sigma } else { DEFAULT_LAG_SIGMA };
        let heading_declared = by_name || declared.heading_loop.dynamics().is_some();
        let surge_declared = by_name || declared.surge_loop.time_constant_s.is_some();
        let drift_declared = by_name || declared.sway_per_yaw_rate_s.is_some();
        let lag = |seconds: f64, declared| Gaussian {
            mean: seconds.max(LAG_MIN).ln(),
            variance: lag_sigma(declared) * lag_sigma(declared),
        };
        let drift_sigma = if drift_declared {
            (sigma * craft.sway_per_yaw_rate.abs()).max(DRIFT_SIGMA_MIN)
        } else {
            DEFAULT_DRIFT_SIGMA
        };
        Self {
            heading_lag: lag(craft.heading.time_constant(), heading_declared),
            surge_lag: lag(craft.surge.time_constant, surge_declared),
            drift: Gaussian {
                mean: craft.sway_per_yaw_rate,
                variance: drift_sigma * drift_sigma,
            },
            heading_held: declared.heading_held.or(by_name.then_some(craft.heading_held)),
            speed_held: declared.speed_held.or(by_name.then_some(craft.speed_held)),
            heading_declared,
            surge_declared,
            craft,
        }
    }
}
