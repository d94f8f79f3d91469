//! What is known of a craft before it moves.

use nalgebra::Vector2;

use super::{Craft, CraftDescription, HeadingHeld, SpeedHeld, observer::Gaussian};

/// Relative standard deviation of what a client says of its craft, where it does not say.
const TOLD_UNCERTAINTY: f64 = 0.15;
/// Standard deviation of the logarithm of a time constant that is not told: a factor of two either way.
const UNTOLD_LAG_SIGMA: f64 = 0.7;
/// Standard deviation of a drift in turns that is not told, s.
const UNTOLD_DRIFT_SIGMA: f64 = 0.7;
/// Smallest standard deviation of a drift in turns, s.
const DRIFT_SIGMA_MIN: f64 = 0.05;
/// Shortest lag whose logarithm is taken, s.
const LAG_MIN: f64 = 0.2;

/// What is told of a craft, and how surely; what is not told is the generic craft's.
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
    /// What the heading loop holds, where that was told.
    pub heading_held: Option<HeadingHeld>,
    /// What the speed loop holds, where that was told.
    pub speed_held: Option<SpeedHeld>,
    /// Whether the heading loop was told.
    pub heading_told: bool,
    /// Whether the speed loop was told.
    pub surge_told: bool,
}

impl Prior {
    /// Delays of the heading loop and of the speed loop, s.
    pub(super) fn delays(&self) -> Vector2<f64> {
        Vector2::new(self.craft.heading.effective_delay(), self.craft.surge.delay)
    }
}

impl From<&CraftDescription> for Prior {
    fn from(told: &CraftDescription) -> Self {
        let craft = told.craft();
        let sigma = told.relative_uncertainty.unwrap_or(TOLD_UNCERTAINTY);
        let (by_name, lag_sigma) = (
            told.preset.is_some_and(|preset| preset.name != "generic"),
            |told| {
                if told { sigma } else { UNTOLD_LAG_SIGMA }
            },
        );
        let heading_told = by_name || told.heading_dynamics.is_some();
        let surge_told = by_name || told.surge_time_constant.is_some();
        let drift_told = by_name || told.sway_per_yaw_rate.is_some();
        let lag = |seconds: f64, told| Gaussian {
            mean: seconds.max(LAG_MIN).ln(),
            variance: lag_sigma(told) * lag_sigma(told),
        };
        let drift_sigma = if drift_told {
            (sigma * craft.sway_per_yaw_rate.abs()).max(DRIFT_SIGMA_MIN)
        } else {
            UNTOLD_DRIFT_SIGMA
        };
        Self {
            heading_lag: lag(craft.heading.time_constant(), heading_told),
            surge_lag: lag(craft.surge.time_constant, surge_told),
            drift: Gaussian {
                mean: craft.sway_per_yaw_rate,
                variance: drift_sigma * drift_sigma,
            },
            heading_held: told.heading_held.or(by_name.then_some(craft.heading_held)),
            speed_held: told.speed_held.or(by_name.then_some(craft.speed_held)),
            heading_told,
            surge_told,
            craft,
        }
    }
}
