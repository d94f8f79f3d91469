//! The response model as it is learnt: from what was declared of the craft, and from how it answered.

use nalgebra::Vector2;

use crate::{
    craft::{closed_loop::HeadingReference, estimate::CraftEstimate, model::CraftModel, prior::Prior},
    facts::asc::Limits,
};

/// Least speed of a craft that holds a course, as a multiple of the current.
const COURSE_SPEED_RATIO: f64 = 1.4;

/// The most of its fastest speed that this may be.
const COURSE_SPEED_SHARE: f64 = 0.6;

/// Part of its rates that a loop is planned with whose references have no effect: what a craft has left that half obeys, and
/// enough to see whether it does again.
const EFFECT_LEFT: f64 = 0.5;

impl CraftModel {
    /// What is known of the craft by now; of one that does not follow, a slower one than that.
    #[must_use]
    pub(crate) fn learnt(
        prior: &Prior,
        estimate: &CraftEstimate,
        limits: &Limits,
        current: &Vector2<f64>,
    ) -> Self {
        let declared = Self::new(&prior.craft, limits).steerable(prior, estimate, current);
        let learnt = Self {
            heading_time: estimate.heading_time().0,
            heading_offset: estimate.heading.z,
            surge_time: estimate.surge_time().0,
            sway_per_yaw_rate: estimate.drift.mean,
            surge_disturbance: estimate.surge.z,
            ..declared
        };
        let mut model = if estimate.monitor.alarm {
            learnt.cautious()
        } else {
            learnt
        };
        if estimate.heading_effect.is_missing() {
            model.limits.turn_rate_max = EFFECT_LEFT * learnt.limits.turn_rate_max;
        }
        if estimate.speed_effect.is_missing() {
            model.limits.acceleration_max = EFFECT_LEFT * learnt.limits.acceleration_max;
            model.limits.deceleration_max = EFFECT_LEFT * learnt.limits.deceleration_max;
        }
        model.with_bounded_disturbance()
    }

    /// A craft whose loop holds a course has none where the current is faster than itself: its least speed is above that.
    fn steerable(self, prior: &Prior, estimate: &CraftEstimate, current: &Vector2<f64>) -> Self {
        let (HeadingReference::Course, _) = estimate.modes(prior) else {
            return self;
        };
        let limits = self.limits;
        let least = (COURSE_SPEED_RATIO * current.norm()).min(COURSE_SPEED_SHARE * limits.speed_max);
        Self {
            limits: Limits {
                speed_min: limits.speed_min.max(least),
                ..limits
            },
            ..self
        }
    }
}
