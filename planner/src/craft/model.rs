//! The planner's response model of the surface craft.

use crate::craft::closed_loop::{Craft, Power};
use crate::facts::asc::Limits;
use crate::tuned::CraftNumbers;

/// Largest surge disturbance, as a multiple of the weaker acceleration limit.
const SURGE_DISTURBANCE_MOST: f64 = 1.5;

/// Closed-loop response as the planner predicts it: the craft's, within the operator's limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraftModel {
    /// The tighter of the operator's limits and the craft's.
    pub limits: Limits,
    /// Time constant of the heading loop, s.
    pub heading_time: f64,
    /// Further delay of the heading loop, s.
    pub heading_delay: f64,
    /// Offset of the heading from its reference, rad.
    pub heading_offset: f64,
    /// Time constant of the speed loop, s.
    pub surge_time: f64,
    /// Further delay of the speed loop, s.
    pub surge_delay: f64,
    /// Present acceleration disturbance of the speed loop, m/s².
    pub surge_disturbance: f64,
    /// Integral time of the speed loop, s: the integrator then equals the proportional part.
    pub integral_time: Option<f64>,
    /// Sway per surge and yaw rate k_β, s.
    pub sway_per_yaw_rate: f64,
    /// Propulsion power.
    pub power: Power,
}

impl CraftModel {
    /// `craft` within `limits`.
    pub fn new(craft: &Craft, limits: &Limits) -> Self {
        Self {
            limits: Limits {
                turn_rate_max: limits.turn_rate_max.min(craft.heading.rate_max),
                acceleration_max: limits.acceleration_max.min(craft.surge.acceleration_max),
                deceleration_max: limits.deceleration_max.min(craft.surge.deceleration_max),
                ..*limits
            },
            heading_time: craft.heading.time_constant(),
            heading_delay: craft.heading.effective_delay(),
            heading_offset: 0.0,
            surge_time: craft.surge.time_constant,
            surge_delay: craft.surge.delay,
            surge_disturbance: 0.0,
            integral_time: craft.surge.integral_time,
            sway_per_yaw_rate: craft.sway_per_yaw_rate,
            power: craft.power,
        }
    }

    /// The same craft with some acceleration and deceleration left by its disturbance. A plan for a
    /// craft pushed beyond its limits stays in place.
    pub(super) fn with_bounded_disturbance(self, tuned: &CraftNumbers) -> Self {
        let share = match self.integral_time {
            Some(_) => tuned.disturbance_share_of_an_integrator,
            None => tuned.disturbance_share,
        };
        let most = share * self.limits.acceleration_max.min(self.limits.deceleration_max);
        Self { surge_disturbance: self.surge_disturbance.clamp(-most, most), ..self }
    }

    pub(super) fn cautious(self, tuned: &CraftNumbers) -> Self {
        let limits = self.limits;
        Self {
            limits: Limits {
                turn_rate_max: tuned.cautious_rate * limits.turn_rate_max,
                acceleration_max: tuned.cautious_rate * limits.acceleration_max,
                deceleration_max: tuned.cautious_rate * limits.deceleration_max,
                ..limits
            },
            heading_time: tuned.cautious_lag * self.heading_time,
            surge_time: tuned.cautious_lag * self.surge_time,
            ..self
        }
    }

    /// Largest disturbance of the speed loop, m/s²; larger estimates are errors.
    pub(crate) fn surge_disturbance_max(&self) -> f64 {
        SURGE_DISTURBANCE_MOST * self.limits.acceleration_max.min(self.limits.deceleration_max)
    }

    /// Lag of the direction of travel behind a turning reference, s, with the outward drift.
    pub fn course_lag(&self) -> f64 {
        (self.heading_lag() + self.sway_per_yaw_rate).max(0.0)
    }

    /// Lag of the heading behind a reference that turns steadily, s.
    pub fn heading_lag(&self) -> f64 {
        self.heading_time + self.heading_delay
    }

    /// Lag of the speed behind a reference that rises steadily, s.
    pub fn surge_lag(&self) -> f64 {
        self.surge_time + self.surge_delay
    }
}
