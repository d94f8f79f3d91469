//! The reference between two plans.

use nalgebra::Vector2;
use planner::angle::{direction, wrap};

/// Speed and heading for the autopilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Speed ahead, m/s, never negative, as the craft's speed loop measures it.
    pub speed: f64,
    /// Heading, rad, true, in [−π, π].
    pub heading: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stage {
    pub(crate) t_s: f64,
    /// The planned speed through the water and heading.
    pub(crate) reference: Reference,
}

/// A plan for the craft. All times are on one clock.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlannedReference {
    pub(crate) planned_s: f64,
    /// The plan's reference at that time.
    pub(crate) first: Reference,
    /// The planned motion, in order of time.
    pub(crate) stages: Vec<Stage>,
    /// Lead of references over the planned motion: lags of the heading and speed loops, s.
    pub(crate) lags: [f64; 2],
    /// Current (north, east), m/s, in a speed over ground; zero with speed through the water.
    pub(crate) current: Vector2<f64>,
    pub(crate) valid_until_s: f64,
}

impl PlannedReference {
    /// The plan's reference at `t_s`, changed by the planned motion; `None` after its validity.
    ///
    /// ```text
    /// ψ_ref(t) = ψ_ref(t₀) + ψ(t + T_ψ) − ψ(t₀ + T_ψ)    u_ref(t): T_u, and current along the bow
    /// ```
    /// Loops that get this reference are on the planned motion one lag later.
    pub(crate) fn at(&self, t_s: f64) -> Option<Reference> {
        let is_valid = t_s <= self.valid_until_s;
        if !is_valid {
            return None;
        }
        let [heading_lag, speed_lag] = self.lags;
        let since = t_s.max(self.planned_s);
        let both = |lag: f64| [since, self.planned_s].map(|t_s| self.motion(t_s + lag));
        let ([now, then], [faster, before]) = (both(heading_lag), both(speed_lag));
        let heading = wrap(self.first.heading + wrap(now.heading - then.heading));
        let faster = faster.speed - before.speed;
        let bows = direction(heading) - direction(self.first.heading);
        let carried = self.current.dot(&bows);
        Some(Reference { speed: (self.first.speed + faster + carried).max(0.0), heading })
    }

    /// The planned speed through the water and heading, interpolated between the stages.
    fn motion(&self, t_s: f64) -> Reference {
        let next = self.stages.iter().position(|stage| t_s < stage.t_s).unwrap_or(self.stages.len());
        let before = next.checked_sub(1).map(|last| &self.stages[last]);
        match (before, self.stages.get(next)) {
            (Some(before), Some(after)) => between(before, after, t_s),
            (Some(only), None) | (None, Some(only)) => only.reference,
            (None, None) => self.first,
        }
    }
}

/// Interpolates between two stages, the heading by the shorter turn.
fn between(from: &Stage, to: &Stage, t_s: f64) -> Reference {
    let span = to.t_s - from.t_s;
    let part = if span > 0.0 { ((t_s - from.t_s) / span).clamp(0.0, 1.0) } else { 1.0 };
    let (before, after) = (from.reference, to.reference);
    Reference {
        speed: before.speed + part * (after.speed - before.speed),
        heading: wrap(before.heading + part * wrap(after.heading - before.heading)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A craft that goes at 1 m/s and turns 0.1 rad/s to starboard, planned at 100 s on a clock.
    fn turning(lags: [f64; 2], current: Vector2<f64>) -> PlannedReference {
        let stages = (0..30_u8).map(|k| {
            let after = f64::from(k);
            let heading = wrap(3.0 + 0.1 * after);
            Stage { t_s: 100.0 + after, reference: Reference { speed: 1.0 + 0.01 * after, heading } }
        });
        PlannedReference {
            planned_s: 100.0,
            first: Reference { speed: 1.2, heading: 3.0 + 0.1 * lags[0] },
            stages: stages.collect(),
            lags,
            current,
            valid_until_s: 110.0,
        }
    }

    #[test]
    fn between_two_plans_the_reference_turns_with_the_planned_motion() {
        let plan = turning([2.0, 1.5], Vector2::zeros());
        for tenths in 0..=100_u8 {
            let after = 0.1 * f64::from(tenths);
            let reference = plan.at(100.0 + after).expect("the plan is valid");
            assert!(wrap(reference.heading - (3.2 + 0.1 * after)).abs() < 1e-12);
            assert!((reference.speed - (1.2 + 0.01 * after)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_speed_over_ground_includes_the_current_along_the_bow_in_turns() {
        let current = Vector2::new(0.3, 0.0);
        let reference = turning([0.0, 0.0], current).at(105.0).expect("the plan is valid");
        // The first reference includes 0.3 cos ψ.
        let carried = 0.3 * (3.5_f64.cos() - 3.0_f64.cos());
        assert!((reference.speed - (1.2 + 0.05 + carried)).abs() < 1e-12);
    }

    #[test]
    fn a_plan_that_is_too_old_is_not_followed() {
        let plan = turning([1.0, 1.0], Vector2::zeros());
        assert!(plan.at(110.0).is_some());
        assert!(plan.at(110.001).is_none());
        assert!(plan.at(f64::NAN).is_none());
    }
}
