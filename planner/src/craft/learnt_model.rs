//! The learnt response model, from declaration and responses.

use nalgebra::Vector2;

use crate::{
    craft::{closed_loop::HeadingReference, estimate::CraftEstimate, model::CraftModel, prior::Prior},
    facts::asc::Limits,
    tuned::CraftNumbers,
};

impl CraftModel {
    /// The learnt craft; a slower one if it does not follow.
    pub(crate) fn learnt(
        prior: &Prior,
        estimate: &CraftEstimate,
        limits: &Limits,
        current: &Vector2<f64>,
        tuned: &CraftNumbers,
    ) -> Self {
        let declared = Self::new(&prior.craft, limits).steerable(prior, estimate, current, tuned);
        let learnt = Self {
            heading_time: estimate.heading_time().0,
            heading_offset: estimate.heading.z,
            surge_time: estimate.surge_time().0,
            sway_per_yaw_rate: estimate.drift.mean,
            surge_disturbance: estimate.surge.z,
            ..declared
        };
        let mut model = if estimate.monitor.alarm { learnt.cautious(tuned) } else { learnt };
        if estimate.heading_effect.is_missing() {
            model.limits.turn_rate_max = tuned.effect_left * learnt.limits.turn_rate_max;
        }
        if estimate.speed_effect.is_missing() {
            model.limits.acceleration_max = tuned.effect_left * learnt.limits.acceleration_max;
            model.limits.deceleration_max = tuned.effect_left * learnt.limits.deceleration_max;
        }
        model.with_bounded_disturbance(tuned)
    }

    /// A course loop fails in a current faster than the craft: raises the least speed above it.
    fn steerable(
        self,
        prior: &Prior,
        estimate: &CraftEstimate,
        current: &Vector2<f64>,
        tuned: &CraftNumbers,
    ) -> Self {
        let (HeadingReference::Course, _) = estimate.modes(prior) else {
            return self;
        };
        let limits = self.limits;
        let least =
            (tuned.course_speed_ratio * current.norm()).min(tuned.course_speed_share * limits.speed_max);
        Self { limits: Limits { speed_min: limits.speed_min.max(least), ..limits }, ..self }
    }
}
