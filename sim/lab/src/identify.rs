//! From a log of references and motion to the craft that made it.
//!
//! Output-error identification: the craft's response model of [`planner::craft`] is simulated from the logged references
//! alone, and its parameters are those for which the simulated motion is nearest to the measured one, by least squares
//! over all samples. Source: L. Ljung, *System Identification: Theory for the User* (1999), chapters 7 and 9.
//!
//! ```text
//! heading   ψ_m = ψ(ψ_ref; T or ω, ζ, t_d, r_max) + compass bias
//! surge     log: u          sway log: v = −k_β u r
//! ground    along the bow: u + v_c · bow          to starboard: v + v_c · starboard − compass bias · u
//! ```
//! The current v_c is taken to be constant over the log, and is a nuisance parameter as the compass bias is. Whether speed
//! is held through the water or over ground, and heading or course, is decided by which of both fits better.
//!
//! [`Log`] checks the rows, [`identify`] fits, [`Identification`] says what was found, how surely, and what is missing.
//! Pure: reading files is the caller's affair.

use planner::craft::{
    CraftDescription, HeadingDynamics, HeadingHeld, Integrator, PropulsionPower, SpeedHeld,
};

mod fit;
mod heading;
mod held;
mod log;
mod page;
mod power;
mod surge;
#[cfg(test)]
mod tests;

pub use log::{InvalidLog, Log, LogRow};
pub use page::{digits, page};

use fit::Estimate;

/// An interval wider than this part of its estimate to either side does not identify a parameter.
const RELATIVE_WIDTH_MAX: f64 = 0.5;
/// The same for delays and for sway per yaw rate, s, which may be 0.
const ABSOLUTE_WIDTH_MAX: f64 = 0.5;
/// An integrator slower than this gathers nothing noticeable while a craft changes its speed, s.
const SLOW_INTEGRAL_TIME: f64 = 60.0;
/// Least relative uncertainty that a craft file claims. Assumption: no craft is a first- or second-order system to better
/// than that.
const RELATIVE_UNCERTAINTY_MIN: f64 = 0.02;

/// What a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Time constant of the heading loop.
    HeadingTimeConstant,
    /// Natural frequency of the heading loop.
    HeadingNaturalFrequency,
    /// Damping ratio of the heading loop.
    HeadingDamping,
    /// Delay of the heading loop.
    HeadingDelay,
    /// Fastest turn.
    HeadingRateMax,
    /// Time constant of the speed loop.
    SurgeTimeConstant,
    /// Delay of the speed loop.
    SurgeDelay,
    /// Largest acceleration.
    AccelerationMax,
    /// Largest deceleration.
    DecelerationMax,
    /// Time in which the speed loop's integrator gathers what its proportional part asks for.
    IntegralTime,
    /// Sway per surge and yaw rate.
    SwayPerYawRate,
    /// Linear coefficient of propulsion power.
    PowerLinear,
    /// Cubic coefficient of propulsion power.
    PowerCubic,
    /// What the speed reference is held against.
    SpeedHeld,
    /// What the heading reference is held against.
    HeadingHeld,
}

impl Quantity {
    /// Its name in a craft file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HeadingTimeConstant => "heading_loop/time_constant_s",
            Self::HeadingNaturalFrequency => "heading_loop/natural_frequency_radps",
            Self::HeadingDamping => "heading_loop/damping",
            Self::HeadingDelay => "heading_loop/delay_s",
            Self::HeadingRateMax => "heading_loop/rate_max_radps",
            Self::SurgeTimeConstant => "surge_loop/time_constant_s",
            Self::SurgeDelay => "surge_loop/delay_s",
            Self::AccelerationMax => "surge_loop/acceleration_max_mps2",
            Self::DecelerationMax => "surge_loop/deceleration_max_mps2",
            Self::IntegralTime => "surge_loop/integral_time_s",
            Self::SwayPerYawRate => "sway_per_yaw_rate_s",
            Self::PowerLinear => "power/linear_w_per_mps",
            Self::PowerCubic => "power/cubic_w_per_mps3",
            Self::SpeedHeld => "speed_held",
            Self::HeadingHeld => "heading_held",
        }
    }

    /// What shows it.
    #[must_use]
    pub fn manoeuvre(self) -> &'static str {
        match self {
            Self::HeadingTimeConstant
            | Self::HeadingNaturalFrequency
            | Self::HeadingDamping
            | Self::HeadingDelay => {
                "heading steps of 10 to 30 degrees to either side, each held until the bow is steady"
            }
            Self::HeadingRateMax => "heading steps of 120 to 170 degrees at working speed",
            Self::SurgeTimeConstant | Self::SurgeDelay => {
                "small speed steps, a tenth of the top speed up and down, on a straight course, each held for 30 s"
            }
            Self::AccelerationMax => {
                "a speed step from slow to top speed on a straight course, held for 60 s"
            }
            Self::DecelerationMax => {
                "a speed step from top speed to slow on a straight course, held for 60 s"
            }
            Self::IntegralTime => {
                "large speed steps up and down on a straight course, each held until the overshoot has settled, 60 s or more"
            }
            Self::SwayPerYawRate => {
                "a full turning circle to either side at working speed, with a sway log or satellite velocity in the log"
            }
            Self::PowerLinear | Self::PowerCubic => {
                "three steady speeds, slow, working and top, each held for 60 s, with power_w in the log"
            }
            Self::SpeedHeld => {
                "the same speed reference up and down a current, with satellite velocity in the log"
            }
            Self::HeadingHeld => {
                "the same speed across a current from either side, with satellite velocity in the log"
            }
        }
    }
}

/// A parameter with its 95 % confidence interval, SI and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// What it is.
    pub quantity: Quantity,
    /// Its estimate.
    pub estimate: f64,
    /// Lower end of its interval.
    pub low: f64,
    /// Upper end of its interval, infinite where the log sets none.
    pub high: f64,
    /// Whether the log shows it: it is then in the craft file.
    pub identified: bool,
}

/// Measured and simulated motion, sample by sample, for a page. `None` where nothing was measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// Time, s.
    pub time: Vec<f64>,
    /// Heading reference, continuous, rad.
    pub heading_reference: Vec<f64>,
    /// Measured heading, continuous, rad.
    pub heading: Vec<f64>,
    /// Simulated heading with the compass bias, rad.
    pub heading_model: Vec<f64>,
    /// Speed reference, m/s.
    pub speed_reference: Vec<f64>,
    /// Measured surge through the water, m/s: the log's, or the ground velocity's less the current.
    pub surge: Vec<Option<f64>>,
    /// Simulated surge through the water, m/s.
    pub surge_model: Vec<f64>,
    /// Measured sway through the water, m/s.
    pub sway: Vec<Option<f64>>,
    /// Simulated sway through the water, m/s.
    pub sway_model: Vec<f64>,
}

/// What a log says of a craft.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// Every parameter that the log was asked for, identified or not.
    pub parameters: Vec<Parameter>,
    /// What the speed reference is held against, where the log tells.
    pub speed_held: Option<SpeedHeld>,
    /// What the heading reference is held against, where the log tells.
    pub heading_held: Option<HeadingHeld>,
    /// Mean current (north, east), m/s, with the standard deviation of each component, where the log has velocity over
    /// ground.
    pub current: Option<[(f64, f64); 2]>,
    /// By how much the compass reads too much, rad, as seen from the satellite track, with its standard deviation.
    pub compass_bias: Option<(f64, f64)>,
    /// Root mean square of measured less simulated heading, rad.
    pub heading_residual: f64,
    /// Root mean square of measured less simulated surge on straight courses, m/s.
    pub surge_residual: f64,
    /// Motion, measured and simulated.
    pub traces: Traces,
}

impl Identification {
    /// The craft, as far as the log shows it.
    #[must_use]
    pub fn description(&self) -> CraftDescription {
        let known = |quantity| {
            let is = |parameter: &&Parameter| parameter.quantity == quantity && parameter.identified;
            self.parameters
                .iter()
                .find(is)
                .map(|parameter| parameter.estimate)
        };
        let second_order = known(Quantity::HeadingNaturalFrequency).zip(known(Quantity::HeadingDamping));
        let power = known(Quantity::PowerLinear).zip(known(Quantity::PowerCubic));
        CraftDescription {
            preset: None,
            heading_dynamics: known(Quantity::HeadingTimeConstant)
                .map(|time_constant| HeadingDynamics::FirstOrder { time_constant })
                .or(
                    second_order.map(|(natural_frequency, damping)| HeadingDynamics::SecondOrder {
                        natural_frequency,
                        damping,
                    }),
                ),
            heading_delay: known(Quantity::HeadingDelay),
            heading_rate_max: known(Quantity::HeadingRateMax),
            surge_time_constant: known(Quantity::SurgeTimeConstant),
            surge_delay: known(Quantity::SurgeDelay),
            acceleration_max: known(Quantity::AccelerationMax),
            deceleration_max: known(Quantity::DecelerationMax),
            // Infinite: shown to be too slow to be noticed.
            integrator: known(Quantity::IntegralTime)
                .map(|time| Integrator::from(Some(time).filter(|time| time.is_finite()))),
            sway_per_yaw_rate: known(Quantity::SwayPerYawRate),
            power: power.map(|(linear, cubic)| PropulsionPower { linear, cubic }),
            speed_held: self.speed_held,
            heading_held: self.heading_held,
            relative_uncertainty: self.relative_uncertainty(),
        }
    }

    /// What the log does not show, with the manoeuvre that would, each once.
    #[must_use]
    pub fn missing(&self) -> Vec<Quantity> {
        let parameters = self.parameters.iter().filter(|parameter| !parameter.identified);
        let mut missing: Vec<_> = parameters.map(|parameter| parameter.quantity).collect();
        if self.speed_held.is_none() {
            missing.push(Quantity::SpeedHeld);
        }
        if self.heading_held.is_none() {
            missing.push(Quantity::HeadingHeld);
        }
        missing
    }

    /// The largest relative standard deviation of what was identified and cannot be 0.
    fn relative_uncertainty(&self) -> Option<f64> {
        let relative = |parameter: &Parameter| match parameter.quantity {
            Quantity::HeadingNaturalFrequency
            | Quantity::HeadingDamping
            | Quantity::HeadingRateMax
            | Quantity::AccelerationMax
            | Quantity::DecelerationMax => {
                Some(0.5 * (parameter.high - parameter.low) / (fit::QUANTILE * parameter.estimate))
            }
            // May be 0 or infinite.
            Quantity::HeadingTimeConstant
            | Quantity::HeadingDelay
            | Quantity::SurgeTimeConstant
            | Quantity::SurgeDelay
            | Quantity::IntegralTime
            | Quantity::SwayPerYawRate
            | Quantity::PowerLinear
            | Quantity::PowerCubic
            | Quantity::SpeedHeld
            | Quantity::HeadingHeld => None,
        };
        let identified = self.parameters.iter().filter(|parameter| parameter.identified);
        identified
            .filter_map(relative)
            .reduce(f64::max)
            .map(|most| most.max(RELATIVE_UNCERTAINTY_MIN))
    }
}

/// Fits a craft to `log`.
#[must_use]
pub fn identify(log: &Log) -> Identification {
    let reference = held::Held::headings(log);
    let by_heading = heading::fit(log, &reference, None);
    let surge = surge::fit(log, &by_heading.simulated);
    // Whether heading or course is held shows in a current only. Held course, the bow turns otherwise than `by_heading` has
    // it, and with it what the surge fit made of that: once more.
    let by_course = surge.water.as_ref().map(|water| {
        let rough = heading::fit(log, &reference, Some(water));
        let surge = surge::fit(log, &rough.simulated);
        heading::fit(log, &reference, surge.water.as_ref())
    });
    let heading_held = by_course
        .as_ref()
        .and_then(|by_course| fit::better(&by_heading.fit, &by_course.fit))
        .map(|heading| {
            if heading {
                HeadingHeld::Heading
            } else {
                HeadingHeld::Course
            }
        });
    let (heading, surge) = match (heading_held, by_course) {
        (Some(HeadingHeld::Course), Some(by_course)) => {
            let surge = surge::fit(log, &by_course.simulated);
            (by_course, surge)
        }
        _ => (by_heading, surge),
    };
    let mut parameters = heading.parameters();
    parameters.extend(surge.parameters());
    parameters.extend(power::fit(log, &surge.simulated));
    Identification {
        parameters,
        speed_held: surge.speed_held,
        heading_held,
        current: surge.current(),
        compass_bias: surge.compass_bias(),
        heading_residual: heading.fit.rms(),
        surge_residual: surge.rms,
        traces: traces(log, &reference, &heading, &surge),
    }
}

fn traces(
    log: &Log,
    reference: &held::Held,
    heading: &heading::HeadingFit,
    surge: &surge::SurgeFit,
) -> Traces {
    Traces {
        time: log.rows().iter().map(|row| row.time).collect(),
        heading_reference: reference.values().to_vec(),
        heading: log.headings().to_vec(),
        heading_model: heading.predicted.clone(),
        speed_reference: log.rows().iter().map(|row| row.speed_reference).collect(),
        surge: surge.measured_surge.clone(),
        surge_model: surge.simulated.iter().map(|motion| motion.surge).collect(),
        sway: surge.measured_sway.clone(),
        sway_model: surge.simulated.iter().map(|motion| motion.sway).collect(),
    }
}

/// A parameter that was estimated by its logarithm.
fn positive(quantity: Quantity, logarithm: Estimate) -> Parameter {
    let half = fit::QUANTILE * logarithm.sigma;
    let (estimate, low, high) = (
        logarithm.value.exp(),
        (logarithm.value - half).exp(),
        (logarithm.value + half).exp(),
    );
    let wide = RELATIVE_WIDTH_MAX * estimate;
    Parameter {
        quantity,
        estimate,
        low,
        high,
        identified: high - estimate <= wide && estimate - low <= wide,
    }
}

/// A time constant that was estimated by its logarithm. One that is almost 0 is known well enough in seconds, while its
/// logarithm may be anything.
fn time_constant(quantity: Quantity, logarithm: Estimate) -> Parameter {
    let value = logarithm.value.exp();
    let half = fit::QUANTILE * value * logarithm.sigma;
    if half.is_finite() && half <= ABSOLUTE_WIDTH_MAX {
        return Parameter {
            quantity,
            estimate: value,
            low: (value - half).max(0.0),
            high: value + half,
            identified: true,
        };
    }
    positive(quantity, logarithm)
}

/// A parameter that may be 0; a `least` of 0 says that it is never below.
fn signed(quantity: Quantity, given: Estimate, least: f64) -> Parameter {
    let half = fit::QUANTILE * given.sigma;
    Parameter {
        quantity,
        estimate: given.value.max(least),
        low: (given.value - half).max(least),
        high: (given.value + half).max(least),
        identified: half <= ABSOLUTE_WIDTH_MAX.max(RELATIVE_WIDTH_MAX * given.value.abs()),
    }
}
