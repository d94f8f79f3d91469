//! A plan of the mission, on the bridge's clock.

use ::wire::{Learnt, mission::CurrentReference};
use nalgebra::Vector2;
use planner::{angle::angle_of, craft::SpeedReference};
use serde::Serialize;

use crate::reference::{PlannedReference, Reference, Stage};

#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// The service's answer, on the mission's clock.
    pub(crate) answer: CurrentReference,
    /// The reference and the planned motion, on the bridge's clock.
    pub(crate) planned: PlannedReference,
    /// The reference of line of sight for the same craft.
    pub(crate) line_of_sight: Reference,
    /// Time of its first arrival, s of the bridge's clock.
    pub(crate) arrived_s: f64,
    /// From the craft to the goal, m.
    pub(crate) distance_m: f64,
}

impl Plan {
    /// The plan in an answer of `now_s`, which first arrived at `arrived_s`, both s of the bridge's
    /// clock; `None` without a trajectory.
    pub(crate) fn new(answer: CurrentReference, arrived_s: f64, now_s: f64) -> Option<Self> {
        let plan = &answer.plan;
        let reference = |speed, heading| Reference { speed, heading };
        // From the mission's clock to the bridge's.
        let shift = now_s - answer.age_s - answer.t_s;
        let stages = plan.trajectory.iter().map(|point| Stage {
            t_s: point.t_s + shift,
            reference: reference(point.speed_mps, point.heading_rad),
        });
        let goal = plan.goal.trajectory.first()?;
        let from_goal = plan.trajectory.first()?.position() - Vector2::new(goal.north_m, goal.east_m);
        let craft = &plan.craft_estimate;
        let is_over_ground = craft.speed_held == SpeedReference::OverGround;
        let current = plan.current.filter(|_| is_over_ground);
        Some(Self {
            arrived_s,
            planned: PlannedReference {
                planned_s: answer.t_s + shift,
                first: reference(plan.reference.speed_mps, plan.reference.heading_rad),
                lags: [&craft.heading_lag_s, &craft.surge_lag_s].map(|lag| lag.value.max(0.0)),
                current: current.map_or_else(Vector2::zeros, Vector2::from),
                valid_until_s: plan.reference.valid_until_s + shift,
                stages: stages.collect(),
            },
            line_of_sight: reference(plan.baseline.speed_mps, plan.baseline.heading_rad),
            distance_m: from_goal.norm(),
            answer,
        })
    }

    /// Method and outcome, such as `mpc ok`.
    pub(crate) fn method(&self) -> String {
        let plan = &self.answer.plan;
        format!("{} {}", name(&plan.method), name(&plan.outcome))
    }

    /// From the craft to an AUV, horizontally, m; `None` if the plan does not tell of it.
    pub(crate) fn distance_to(&self, auv: &str) -> Option<f64> {
        let plan = &self.answer.plan;
        let target = plan.targets.iter().find(|target| target.id.0 == auv)?.trajectory.first()?;
        let place = Vector2::new(target.north_m, target.east_m);
        Some((plan.trajectory.first()?.position() - place).norm())
    }

    /// The planner's estimate of the craft's lags.
    pub(crate) fn lags(&self) -> String {
        let craft = &self.answer.plan.craft_estimate;
        let text = |lag: &Learnt| format!("{:.1}±{:.1} s", lag.value, lag.sigma);
        let (heading, speed) = (text(&craft.heading_lag_s), text(&craft.surge_lag_s));
        format!("heading lag {heading}, speed lag {speed}")
    }

    pub(crate) fn current(&self) -> String {
        let current = self.answer.plan.current.map_or_else(Vector2::zeros, Vector2::from);
        format!("current {}", speed_to(&current))
    }

    pub(crate) fn warnings(&self) -> impl Iterator<Item = &str> {
        self.answer.plan.warnings.iter().map(|warning| &*warning.code)
    }
}

/// Speed and direction of a current, for people.
pub(crate) fn speed_to(current: &Vector2<f64>) -> String {
    let towards = angle_of(current).to_degrees().rem_euclid(360.0);
    format!("{:.2} m/s to {towards:03.0}°", current.norm())
}

/// A name in the API.
pub(crate) fn name(of: &impl Serialize) -> String {
    let name = serde_json::to_value(of).ok();
    let name = name.as_ref().and_then(|name| name.as_str());
    name.expect("names are texts in JSON").to_owned()
}
