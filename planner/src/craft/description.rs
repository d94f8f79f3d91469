//! What a client says of its craft, and the one place where that is checked.

use std::ops::RangeInclusive;

use crate::{
    craft::{
        closed_loop::{
            Craft, HeadingDynamics, HeadingHeld, HeadingResponse, PropulsionPower, SpeedHeld, SurgeResponse,
        },
        presets::Preset,
    },
    facts::invalid_field::{InvalidField, InvalidReason},
};

/// Time constant of a loop, s: 0 answers at once, beyond a minute no loop is closed.
pub const TIME_CONSTANT: RangeInclusive<f64> = 0.0..=60.0;

/// Natural frequency of a heading loop, rad/s.
pub const NATURAL_FREQUENCY: RangeInclusive<f64> = 0.02..=20.0;

/// Damping ratio of a heading loop.
pub const DAMPING: RangeInclusive<f64> = 0.1..=5.0;

/// Delay of a loop, s.
pub const DELAY: RangeInclusive<f64> = 0.0..=10.0;

/// Fastest turn, rad/s.
pub const RATE_MAX: RangeInclusive<f64> = 0.001..=3.0;

/// Largest acceleration and deceleration, m/s².
pub const ACCELERATION: RangeInclusive<f64> = 0.001..=10.0;

/// Time in which a speed loop's integrator gathers what its proportional part asks for, s.
pub const INTEGRAL_TIME: RangeInclusive<f64> = 0.5..=600.0;

/// Sway per surge and yaw rate, s.
pub const SWAY_PER_YAW_RATE: RangeInclusive<f64> = -5.0..=20.0;

/// Coefficients of propulsion power, W/(m/s) and W/(m/s)³.
pub const POWER_COEFFICIENT: RangeInclusive<f64> = 0.0..=1.0e6;

/// Relative uncertainty of all that is said: from certain to hardly more than an order of magnitude.
pub const RELATIVE_UNCERTAINTY: RangeInclusive<f64> = 0.0..=2.0;

/// What a client says of its craft; what it does not say is the preset's or, without one, learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CraftDescription {
    /// The craft of which everything is taken that is not said here.
    pub preset: Option<&'static Preset>,
    /// Dynamics of the heading loop.
    pub heading_dynamics: Option<HeadingDynamics>,
    /// Time until a heading reference begins to act, s.
    pub heading_delay: Option<f64>,
    /// Fastest turn that the heading loop makes, rad/s.
    pub heading_rate_max: Option<f64>,
    /// Time constant of the answer to a small step of the speed reference, s.
    pub surge_time_constant: Option<f64>,
    /// Time until a speed reference begins to act, s.
    pub surge_delay: Option<f64>,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: Option<f64>,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: Option<f64>,
    /// Whether the speed loop integrates, and how fast.
    pub integrator: Option<Integrator>,
    /// Sway per surge and yaw rate k_β, s.
    #[doc(alias = "k_beta")]
    pub sway_per_yaw_rate: Option<f64>,
    /// Power that propulsion draws at a steady speed.
    pub power: Option<PropulsionPower>,
    /// What the speed reference is held against.
    pub speed_held: Option<SpeedHeld>,
    /// What the heading reference is held against.
    pub heading_held: Option<HeadingHeld>,
    /// Standard deviation of every number said, as a part of it.
    pub relative_uncertainty: Option<f64>,
}

/// What is known of a speed loop's integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// There is none.
    Absent,
    /// It gathers in this time what the proportional part asks for, s.
    Gathers {
        /// Time T_i, s.
        time: f64,
    },
}

impl Integrator {
    /// Its time T_i, s; none where there is no integrator.
    #[must_use]
    pub fn time(self) -> Option<f64> {
        match self {
            Self::Absent => None,
            Self::Gathers { time } => Some(time),
        }
    }
}

impl From<Option<f64>> for Integrator {
    fn from(time: Option<f64>) -> Self {
        time.map_or(Self::Absent, |time| Self::Gathers { time })
    }
}

impl From<&Craft> for CraftDescription {
    /// Everything said, and nothing of how surely.
    fn from(craft: &Craft) -> Self {
        Self {
            preset: None,
            heading_dynamics: Some(craft.heading.dynamics),
            heading_delay: Some(craft.heading.delay),
            heading_rate_max: Some(craft.heading.rate_max),
            surge_time_constant: Some(craft.surge.time_constant),
            surge_delay: Some(craft.surge.delay),
            acceleration_max: Some(craft.surge.acceleration_max),
            deceleration_max: Some(craft.surge.deceleration_max),
            integrator: Some(Integrator::from(craft.surge.integral_time)),
            sway_per_yaw_rate: Some(craft.sway_per_yaw_rate),
            power: Some(craft.power),
            speed_held: Some(craft.speed_held),
            heading_held: Some(craft.heading_held),
            relative_uncertainty: None,
        }
    }
}

impl CraftDescription {
    /// The craft that is described: what is not said is the preset's, or the generic craft's.
    #[must_use]
    pub fn craft(&self) -> Craft {
        let base = self.preset.map_or(Craft::GENERIC, |preset| preset.craft);
        let (heading, surge) = (base.heading, base.surge);
        Craft {
            heading: HeadingResponse {
                dynamics: self.heading_dynamics.unwrap_or(heading.dynamics),
                delay: self.heading_delay.unwrap_or(heading.delay),
                rate_max: self.heading_rate_max.unwrap_or(heading.rate_max),
            },
            surge: SurgeResponse {
                time_constant: self.surge_time_constant.unwrap_or(surge.time_constant),
                delay: self.surge_delay.unwrap_or(surge.delay),
                acceleration_max: self.acceleration_max.unwrap_or(surge.acceleration_max),
                deceleration_max: self.deceleration_max.unwrap_or(surge.deceleration_max),
                integral_time: self.integrator.map_or(surge.integral_time, Integrator::time),
            },
            sway_per_yaw_rate: self.sway_per_yaw_rate.unwrap_or(base.sway_per_yaw_rate),
            power: self.power.unwrap_or(base.power),
            speed_held: self.speed_held.unwrap_or(base.speed_held),
            heading_held: self.heading_held.unwrap_or(base.heading_held),
        }
    }

    /// Every number that is outside its range, by the names that the JSON has: `craft/heading_loop/delay_s`.
    #[must_use]
    pub fn faults(&self) -> Vec<InvalidField> {
        let (time_constant, natural_frequency, damping) = match self.heading_dynamics {
            Some(HeadingDynamics::FirstOrder { time_constant }) => (Some(time_constant), None, None),
            Some(HeadingDynamics::SecondOrder {
                natural_frequency,
                damping,
            }) => (None, Some(natural_frequency), Some(damping)),
            None => (None, None, None),
        };
        let numbers = [
            ("heading_loop/time_constant_s", time_constant, TIME_CONSTANT),
            (
                "heading_loop/natural_frequency_radps",
                natural_frequency,
                NATURAL_FREQUENCY,
            ),
            ("heading_loop/damping", damping, DAMPING),
            ("heading_loop/delay_s", self.heading_delay, DELAY),
            ("heading_loop/rate_max_radps", self.heading_rate_max, RATE_MAX),
            (
                "surge_loop/time_constant_s",
                self.surge_time_constant,
                TIME_CONSTANT,
            ),
            ("surge_loop/delay_s", self.surge_delay, DELAY),
            (
                "surge_loop/acceleration_max_mps2",
                self.acceleration_max,
                ACCELERATION,
            ),
            (
                "surge_loop/deceleration_max_mps2",
                self.deceleration_max,
                ACCELERATION,
            ),
            (
                "surge_loop/integral_time_s",
                self.integrator.and_then(Integrator::time),
                INTEGRAL_TIME,
            ),
            ("sway_per_yaw_rate_s", self.sway_per_yaw_rate, SWAY_PER_YAW_RATE),
            (
                "power/linear_w_per_mps",
                self.power.map(|power| power.linear),
                POWER_COEFFICIENT,
            ),
            (
                "power/cubic_w_per_mps3",
                self.power.map(|power| power.cubic),
                POWER_COEFFICIENT,
            ),
            (
                "relative_uncertainty",
                self.relative_uncertainty,
                RELATIVE_UNCERTAINTY,
            ),
        ];
        let outside = |(name, given, range): (&str, Option<f64>, RangeInclusive<f64>)| {
            let given = given.filter(|given| !range.contains(given))?;
            let (least, most) = range.into_inner();
            Some(InvalidField {
                field: format!("craft/{name}"),
                reason: InvalidReason::OutOfRange { given, least, most },
            })
        };
        numbers.into_iter().filter_map(outside).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_craft_that_a_client_may_describe() {
        for preset in crate::craft::presets::PRESETS {
            assert_eq!(
                CraftDescription::from(&preset.craft).faults(),
                [],
                "{}",
                preset.name
            );
        }
    }

    #[test]
    fn what_is_not_said_is_not_at_fault() {
        assert_eq!(CraftDescription::default().faults(), []);
    }

    #[test]
    fn every_number_beyond_its_range_is_named_with_the_range() {
        let wrong = CraftDescription {
            heading_dynamics: Some(HeadingDynamics::FirstOrder { time_constant: -0.1 }),
            heading_delay: Some(10.5),
            surge_time_constant: Some(f64::NAN),
            integrator: Some(Integrator::Gathers { time: 0.4 }),
            power: Some(PropulsionPower {
                linear: -1.0,
                cubic: 30.0,
            }),
            ..CraftDescription::default()
        };
        let faults = wrong.faults();
        let fields: Vec<_> = faults.iter().map(|fault| fault.field.as_str()).collect();
        let expected = [
            "craft/heading_loop/time_constant_s",
            "craft/heading_loop/delay_s",
            "craft/surge_loop/time_constant_s",
            "craft/surge_loop/integral_time_s",
            "craft/power/linear_w_per_mps",
        ];
        assert_eq!(fields, expected);
        assert_eq!(
            faults[0].reason,
            InvalidReason::OutOfRange {
                given: -0.1,
                least: 0.0,
                most: 60.0
            }
        );
    }
}
