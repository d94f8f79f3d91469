//! Identification of a craft from a log of references and motion.
//!
//! Output-error identification: the craft's response model of [`planner::craft`] is simulated from
//! the logged references alone. Its parameters minimise the squared differences from the measured
//! motion. Source: L. Ljung, *System Identification: Theory for the User* (1999), chapters 7 and 9.
//!
//! ```text
//! heading   ψ_m = ψ(ψ_ref; T or ω, ζ, t_d, r_max) + compass bias
//! surge     log: u                          sway log: v = −k_β u r
//! ground    along the bow: u + v_c · bow    to starboard: v + v_c · starboard − compass bias · u
//! ```
//! The current v_c is constant; it and the compass bias are nuisance parameters. The better fit
//! decides if the craft controls speed through the water or over ground, and heading or course.
//!
//! [`Log`] checks the rows, [`identify`] fits, and [`Identification`] holds the parameters with
//! their intervals and the missing ones. No function here reads files.

use planner::craft::{CraftDescription, HeadingLoop, HeadingReference, Power, SpeedReference, SurgeLoop};
use sim::metrics::rms;

mod fit;
mod heading;
mod log;
mod page;
mod parameter;
mod power;
mod reference;
mod surge;
#[cfg(test)]
mod tests;

pub use log::{InvalidLog, Log, LogRow};
pub use page::{page, summary};
use parameter::{Parameter, Quantity};

/// Least relative uncertainty of a craft file. Assumption: no craft fits the models better.
const RELATIVE_UNCERTAINTY_MIN: f64 = 0.02;

/// A motion by sample, for a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trace {
    /// Names of the motion and of its residual, with the unit.
    names: [&'static str; 2],
    /// `None` where nothing was measured.
    measured: Vec<Option<f64>>,
    simulated: Vec<f64>,
    reference: Option<Vec<f64>>,
}

/// A craft as identified from a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// Every parameter, identified or not.
    pub(crate) parameters: Vec<Parameter>,
    /// Speed through the water or over ground, if the log shows it.
    pub speed_held: Option<SpeedReference>,
    /// Reference of heading or of course, if the log shows it.
    pub heading_held: Option<HeadingReference>,
    /// Mean current (north, east) and standard deviations, m/s; needs velocity over ground.
    pub current: Option<[(f64, f64); 2]>,
    /// Compass bias against the satellite track, rad, with its standard deviation.
    pub compass_bias: Option<(f64, f64)>,
    /// Root mean square of measured less simulated heading, rad.
    pub heading_residual: f64,
    /// Root mean square of measured less simulated surge on straight courses, m/s.
    pub surge_residual: f64,
    /// Time of the log that is left out, since a gap divides it, s.
    pub(crate) left_out: f64,
    /// Time of each sample, s.
    pub(crate) time: Vec<f64>,
    /// Motion, measured and simulated: heading with the compass bias, then through the water.
    pub(crate) traces: [Trace; 3],
}

impl Identification {
    /// The craft, with the identified parameters.
    pub fn description(&self) -> CraftDescription {
        let known = |quantity| {
            let is = |parameter: &&Parameter| parameter.quantity == quantity && parameter.identified;
            Some(self.parameters.iter().find(is)?.estimate)
        };
        let second_order = known(Quantity::HeadingNaturalFrequency).zip(known(Quantity::HeadingDamping));
        let power = known(Quantity::PowerLinear).zip(known(Quantity::PowerCubic));
        let integral_time = known(Quantity::IntegralTime);
        CraftDescription {
            preset: None,
            heading_loop: HeadingLoop {
                time_constant_s: known(Quantity::HeadingTimeConstant),
                natural_frequency_radps: second_order.map(|(natural_frequency, _)| natural_frequency),
                damping: second_order.map(|(_, damping)| damping),
                delay_s: known(Quantity::HeadingDelay),
                rate_max_radps: known(Quantity::HeadingRateMax),
            },
            surge_loop: SurgeLoop {
                time_constant_s: known(Quantity::SurgeTimeConstant),
                delay_s: known(Quantity::SurgeDelay),
                acceleration_max_mps2: known(Quantity::AccelerationMax),
                deceleration_max_mps2: known(Quantity::DecelerationMax),
                // Infinite: the log shows that it has no effect.
                integrates: integral_time.is_some_and(|time| !time.is_finite()).then_some(false),
                integral_time_s: integral_time.filter(|time| time.is_finite()),
            },
            sway_per_yaw_rate_s: known(Quantity::SwayPerYawRate),
            power: power
                .map(|(linear_w_per_mps, cubic_w_per_mps3)| Power { linear_w_per_mps, cubic_w_per_mps3 }),
            speed_held: self.speed_held,
            heading_held: self.heading_held,
            relative_uncertainty: self.relative_uncertainty(),
        }
    }

    /// The quantities that the log does not identify.
    pub(crate) fn missing(&self) -> Vec<Quantity> {
        let parameters = self.parameters.iter().filter(|parameter| !parameter.identified);
        let mut missing: Vec<_> = parameters.map(|parameter| parameter.quantity).collect();
        missing.extend(self.speed_held.is_none().then_some(Quantity::SpeedReference));
        missing.extend(self.heading_held.is_none().then_some(Quantity::HeadingReference));
        missing
    }

    /// The largest relative standard deviation of the identified positive parameters.
    fn relative_uncertainty(&self) -> Option<f64> {
        let known = self.parameters.iter().filter(|parameter| parameter.identified);
        let positive = known.filter(|parameter| parameter.quantity.is_positive());
        positive
            .map(|parameter| 0.5 * (parameter.high - parameter.low) / (fit::QUANTILE * parameter.estimate))
            .reduce(f64::max)
            .map(|most| most.max(RELATIVE_UNCERTAINTY_MIN))
    }
}

/// Fits a craft to `log`.
pub fn identify(log: &Log) -> Identification {
    let reference = reference::HeldReference::headings(log);
    let by_heading = heading::fit(log, &reference, None);
    let surge = surge::fit(log, &by_heading.simulated);
    // Heading and course differ only in a current. If the craft controls its course, the bow turns
    // differently from `by_heading`, on which the surge fit depends: fit once more.
    let by_course = surge.water.as_ref().map(|water| {
        let rough = heading::fit(log, &reference, Some(water));
        let surge = surge::fit(log, &rough.simulated);
        heading::fit(log, &reference, surge.water.as_ref())
    });
    let better = |by_course: &heading::HeadingFit| fit::better(&by_heading.fit, &by_course.fit);
    let heading_held = by_course
        .as_ref()
        .and_then(better)
        .map(|heading| if heading { HeadingReference::Heading } else { HeadingReference::Course });
    let (heading, surge) = match (heading_held, by_course) {
        (Some(HeadingReference::Course), Some(by_course)) => {
            let surge = surge::fit(log, &by_course.simulated);
            (by_course, surge)
        }
        _ => (by_heading, surge),
    };
    let mut parameters = heading.parameters();
    parameters.extend(surge.parameters());
    parameters.extend(power::fit(log, &surge.simulated));
    // What no service accepts describes no craft.
    for found in &mut parameters {
        found.identified &= found.is_accepted();
    }
    Identification {
        parameters,
        speed_held: surge.speed_held,
        heading_held,
        current: surge.current(),
        compass_bias: surge.compass_bias(),
        heading_residual: rms(&heading.fit.residuals),
        surge_residual: surge.rms,
        left_out: log.left_out(),
        time: log.rows().iter().map(|row| row.time).collect(),
        traces: traces(log, &reference, &heading, &surge),
    }
}

fn traces(
    log: &Log,
    reference: &reference::HeldReference,
    heading: &heading::HeadingFit,
    surge: &surge::SurgeFit,
) -> [Trace; 3] {
    let degrees = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| value.to_degrees()).collect() };
    let speeds = log.rows().iter().map(|row| row.speed_reference);
    [
        Trace {
            names: ["heading, °", "residual, °"],
            measured: degrees(log.headings()).into_iter().map(Some).collect(),
            simulated: degrees(&heading.predicted),
            reference: Some(degrees(reference.values())),
        },
        Trace {
            names: ["surge, m/s", "residual, m/s"],
            measured: surge.measured_surge.clone(),
            simulated: surge.simulated.iter().map(|motion| motion.surge).collect(),
            reference: Some(speeds.collect()),
        },
        Trace {
            names: ["sway, m/s", "residual, m/s"],
            measured: surge.measured_sway.clone(),
            simulated: surge.simulated.iter().map(|motion| motion.sway).collect(),
            reference: None,
        },
    ]
}
