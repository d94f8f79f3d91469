//! The response model as it is learnt: from what was declared of the craft, and from how it answered.

use nalgebra::Vector2;

use crate::{
    craft::{closed_loop::HeadingHeld, estimate::CraftEstimate, model::CraftModel, prior::Prior},
    facts::asc::Limits,
};

/// Least speed of a craft that holds a course, as a multiple of the current.
const COURSE_SPEED_RATIO: f64 = 1.4;

/// The most of its fastest speed that this may be.
const COURSE_SPEED_SHARE: f64 = 0.6;

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
        if estimate.monitor.alarm {
            learnt.cautious()
        } else {
            learnt
        }
        .with_bounded_disturbance()
    }

    /// A craft whose loop holds a course has none where the current is faster than itself: its least speed is above that.
    fn steerable(self, prior: &Prior, estimate: &CraftEstimate, current: &Vector2<f64>) -> Self {
        let (HeadingHeld::Course, _) = estimate.modes(prior) else {
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
