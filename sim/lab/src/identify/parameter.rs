//! Identified quantities and their intervals.

use planner::snapshot::ranges_by_shape;

use super::fit::{self, Estimate};

/// A parameter with a wider interval than this share of its estimate is not identified.
pub(super) const RELATIVE_WIDTH_MAX: f64 = 0.5;
/// The same for delays and for sway per yaw rate, s, which may be 0.
const ABSOLUTE_WIDTH_MAX: f64 = 0.5;
/// An integrator slower than this has no effect while a craft changes its speed, s.
pub(super) const SLOW_INTEGRAL_TIME: f64 = 60.0;

/// An identified quantity, named as in a craft file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    HeadingTimeConstant,
    HeadingNaturalFrequency,
    HeadingDamping,
    HeadingDelay,
    HeadingRateMax,
    SurgeTimeConstant,
    SurgeDelay,
    AccelerationMax,
    DecelerationMax,
    IntegralTime,
    SwayPerYawRate,
    PowerLinear,
    PowerCubic,
    SpeedReference,
    HeadingReference,
}

const HEADING_STEPS: &str =
    "heading steps of 10 to 30 degrees to either side, each held until the bow is steady";
const SPEED_STEPS: &str =
    "small speed steps, a tenth of the top speed up and down, on a straight course, each held for 30 s";
const STEADY_SPEEDS: &str =
    "three steady speeds, slow, working and top, each held for 60 s, with power_w in the log";

impl Quantity {
    /// Its name in a craft file, and the manoeuvre that shows it.
    pub(super) fn name_and_manoeuvre(self) -> (&'static str, &'static str) {
        match self {
            Self::HeadingTimeConstant => ("heading_loop/time_constant_s", HEADING_STEPS),
            Self::HeadingNaturalFrequency => ("heading_loop/natural_frequency_radps", HEADING_STEPS),
            Self::HeadingDamping => ("heading_loop/damping", HEADING_STEPS),
            Self::HeadingDelay => ("heading_loop/delay_s", HEADING_STEPS),
            Self::HeadingRateMax => {
                ("heading_loop/rate_max_radps", "heading steps of 120 to 170 degrees at working speed")
            }
            Self::SurgeTimeConstant => ("surge_loop/time_constant_s", SPEED_STEPS),
            Self::SurgeDelay => ("surge_loop/delay_s", SPEED_STEPS),
            Self::AccelerationMax => (
                "surge_loop/acceleration_max_mps2",
                "a speed step from slow to top speed on a straight course, held for 60 s",
            ),
            Self::DecelerationMax => (
                "surge_loop/deceleration_max_mps2",
                "a speed step from top speed to slow on a straight course, held for 60 s",
            ),
            Self::IntegralTime => (
                "surge_loop/integral_time_s",
                "large speed steps up and down on a straight course, each held until the overshoot has settled, 60 s or more",
            ),
            Self::SwayPerYawRate => (
                "sway_per_yaw_rate_s",
                "a full turning circle to either side at working speed, with a sway log or satellite velocity in the log",
            ),
            Self::PowerLinear => ("power/linear_w_per_mps", STEADY_SPEEDS),
            Self::PowerCubic => ("power/cubic_w_per_mps3", STEADY_SPEEDS),
            Self::SpeedReference => (
                "speed_held",
                "the same speed reference up and down a current, with satellite velocity in the log",
            ),
            Self::HeadingReference => (
                "heading_held",
                "the same speed across a current from either side, with satellite velocity in the log",
            ),
        }
    }

    /// `true` if it is neither 0 nor infinite.
    pub(super) fn is_positive(self) -> bool {
        matches!(
            self,
            Self::HeadingNaturalFrequency
                | Self::HeadingDamping
                | Self::HeadingRateMax
                | Self::AccelerationMax
                | Self::DecelerationMax
        )
    }
}

/// A parameter with its 95 % confidence interval, SI and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parameter {
    pub(super) quantity: Quantity,
    pub(super) estimate: f64,
    pub(super) low: f64,
    /// Infinite if the log sets no limit.
    pub(super) high: f64,
    /// `true` if the log identifies it; it is then in the craft file.
    pub(super) identified: bool,
}

impl Parameter {
    /// `true` if a service accepts it in a craft; an infinite integral time is none there.
    pub(super) fn is_accepted(&self) -> bool {
        let (name, _) = self.quantity.name_and_manoeuvre();
        let (shape, member) = match name.split_once('/') {
            Some(("heading_loop", member)) => ("HeadingLoop", member),
            Some(("surge_loop", member)) => ("SurgeLoop", member),
            Some((_, member)) => ("Power", member),
            None => ("CraftDescription", name),
        };
        let mut ranges = ranges_by_shape().filter(|(of, range)| (*of, range.0) == (shape, member));
        self.estimate.is_infinite() || ranges.all(|(_, range)| range.1.contains(&self.estimate))
    }
}

/// A parameter that was estimated as its logarithm.
pub(super) fn positive(quantity: Quantity, logarithm: Estimate) -> Parameter {
    let half = fit::QUANTILE * logarithm.sigma;
    let [low, estimate, high] = [-half, 0.0, half].map(|by| (logarithm.value + by).exp());
    let wide = RELATIVE_WIDTH_MAX * estimate;
    Parameter { quantity, estimate, low, high, identified: high - estimate <= wide && estimate - low <= wide }
}

/// A time constant from its logarithm. Near 0, it is well known although the logarithm is not.
pub(super) fn time_constant(quantity: Quantity, logarithm: Estimate) -> Parameter {
    let estimate = logarithm.value.exp();
    let half = fit::QUANTILE * estimate * logarithm.sigma;
    if half.is_finite() && half <= ABSOLUTE_WIDTH_MAX {
        let (low, high) = ((estimate - half).max(0.0), estimate + half);
        return Parameter { quantity, estimate, low, high, identified: true };
    }
    positive(quantity, logarithm)
}

/// A parameter that may be 0, at least `least`.
pub(super) fn signed(quantity: Quantity, given: Estimate, least: f64) -> Parameter {
    let half = fit::QUANTILE * given.sigma;
    let [low, estimate, high] = [-half, 0.0, half].map(|by| (given.value + by).max(least));
    let identified = half <= ABSOLUTE_WIDTH_MAX.max(RELATIVE_WIDTH_MAX * given.value.abs());
    Parameter { quantity, estimate, low, high, identified }
}
