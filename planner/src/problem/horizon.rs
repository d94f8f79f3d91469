//! The planning problem in the craft's frame, sampled on a grid of times.

use nalgebra::Vector2;

use crate::coast::land::Land;
use crate::craft::model::CraftModel;
use crate::craft::response::{HALF_HOLD, Response, Rollout, Stage, Surge};
use crate::facts::angle::{Course, Heading, wrap};
use crate::facts::asc::AscNow;
use crate::facts::reference::{Reference, TrajectoryPoint};
use crate::los::law::LosTuning;
use crate::los::tracking_law::TrackingLaw;
use crate::predict::goal::GoalForecast;
use crate::predict::motion::{Motion, target_course};
use crate::problem::frame::{Frame, SPEED_WITHOUT_DIRECTION};
use crate::problem::parameters::{Parameters, Weights};
use crate::problem::previous_trajectory::{FollowedHeading, PreviousTrajectory};
use crate::problem::stage_constraints::StageConstraints;
use crate::snapshot::build::Snapshot;

/// Facts of one snapshot in the craft's frame, so that a plan is invariant to north and the datum.
#[derive(Clone, Debug)]
pub(crate) struct Horizon<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) parameters: &'a Parameters,
    pub(crate) forecast: &'a GoalForecast,
    /// The craft as it is planned.
    pub(crate) craft: CraftModel,
    pub(crate) frame: Frame,
    /// Times of the stages after the snapshot, s: 0 first.
    pub(crate) times: Vec<f64>,
    /// Goal at the stages, craft frame.
    pub(crate) goal: Vec<Motion>,
    /// Last course of the moving goal, NED.
    pub(crate) goal_course: Course,
    /// Current, craft frame, m/s.
    pub(crate) current: Vector2<f64>,
    /// The craft now, craft frame.
    pub(crate) start: Stage,
    yaw_rate: f64,
    /// The previous plan's trajectory, if it is usable.
    pub(crate) previous: Option<PreviousTrajectory<'a>>,
    /// The heading that the craft has been following.
    pub(crate) followed: Option<FollowedHeading>,
    /// Weights of the cost, given the goal's uncertainty.
    pub(crate) weights: Weights,
    /// Limits of position at the stages, craft frame.
    pub(crate) constraints: StageConstraints,
    /// `true` if a no-go area is within the craft's reach.
    is_near_land: bool,
}

impl<'a> Horizon<'a> {
    pub(crate) fn new(snapshot: &'a Snapshot, parameters: &'a Parameters, goal: &'a GoalForecast) -> Self {
        let frame = Frame::of(snapshot);
        let times = parameters.times();
        let previous = PreviousTrajectory::of(snapshot, parameters);
        let followed = FollowedHeading::of(snapshot, parameters);
        let yaw_rate = yaw_rate(snapshot, followed);
        let goal_at = |time: &f64| frame.motion(&goal.at(*time));
        let goal_motions: Vec<_> = times.iter().map(goal_at).collect();
        let goal_now = goal_motions[0].position;
        let mut constraints = StageConstraints::new(snapshot, parameters, &frame, &times, &goal_now, goal);
        if goal.is_by_way() {
            constraints.minimax.clear();
        }
        let reach = snapshot.limits().speed_max * times[times.len() - 1];
        let border = snapshot.land().sides.nearest(&snapshot.asc.position(), reach, |_| true);
        Self {
            snapshot,
            parameters,
            forecast: goal,
            craft: parameters.planned(snapshot.craft_model()),
            frame,
            goal: goal_motions,
            goal_course: target_course(&goal.at(0.0), Some(goal.course())),
            current: frame.vector(&snapshot.current()),
            start: Stage { position: Vector2::zeros(), velocity: snapshot.velocity_now(yaw_rate) },
            yaw_rate,
            previous,
            followed,
            weights: parameters.weights_for(snapshot, goal),
            constraints,
            is_near_land: border.is_some(),
            times,
        }
    }

    /// The no-go areas, if the craft can reach one.
    pub(crate) fn land_near(&self) -> Option<&'a Land> {
        self.is_near_land.then(|| self.snapshot.land())
    }

    /// Rollout of a line-of-sight law without memory on the response model.
    pub(crate) fn line_of_sight(&self, tuning: LosTuning) -> Rollout {
        let mut tracking = TrackingLaw::new(tuning, Some(self.local_goal_course()));
        let law = |time, asc: &_, _| {
            let target = self.frame.motion(&self.forecast.at(time));
            tracking.steer(time, asc, &target, self.snapshot.limits())
        };
        self.roll_out(self.snapshot.craft_model(), law)
    }

    /// Rollout of a line-of-sight law with its memory in NED and on the snapshot's clock.
    pub(crate) fn line_of_sight_with_memory(&self, mut tracking: TrackingLaw) -> Rollout {
        let law = |time, asc: &_, _| {
            let (now, asc) = (self.frame.time(time), self.frame.asc_in_ned(asc));
            let asked = tracking.steer(now, &asc, &self.forecast.at(time), self.snapshot.limits());
            Reference { heading: Heading::new(self.frame.angle(asked.heading.radians())), ..asked }
        };
        self.roll_out(self.snapshot.craft_model(), law)
    }

    /// Acceleration through the water now, craft frame, m/s²: that of the yaw rate.
    pub(crate) fn acceleration(&self) -> Vector2<f64> {
        let velocity = self.start.velocity;
        Vector2::new(-velocity.y, velocity.x) * self.yaw_rate
    }

    /// Rollout of a `law` in the craft's frame on the response model.
    pub(crate) fn roll_out(
        &self,
        craft: &CraftModel,
        law: impl FnMut(f64, &AscNow, Surge) -> Reference,
    ) -> Rollout {
        let heading = |followed: FollowedHeading| Heading::new(self.frame.angle(followed.heading.radians()));
        let response =
            Response { craft, current: self.current, heading_reference: self.followed.map(heading) };
        response.roll_out(self.start, Heading::new(0.0), &self.parameters.steps, law)
    }

    /// Directions of travel, craft frame: the bow's, then those of `stages`; slow ones repeat them.
    pub(crate) fn directions_of(stages: &[Stage]) -> impl Iterator<Item = Vector2<f64>> {
        let ahead = Vector2::new(1.0, 0.0);
        let later = stages[1..].iter().scan(ahead, |last, stage| {
            *last = stage.velocity.try_normalize(SPEED_WITHOUT_DIRECTION).unwrap_or(*last);
            Some(*last)
        });
        std::iter::once(ahead).chain(later)
    }

    /// An earlier trajectory at this horizon's stages, craft frame.
    pub(crate) fn stages_along(&self, previous: &PreviousTrajectory<'_>) -> Vec<Stage> {
        let later = self.times[1..].iter().map(|time| self.frame.stage(&previous.at(self.frame.time(*time))));
        std::iter::once(self.start).chain(later).collect()
    }

    /// The goal's last course in motion, as an angle from the bow.
    pub(crate) fn local_goal_course(&self) -> Course {
        Course::new(self.frame.angle(self.goal_course.radians()))
    }

    /// `stages` at a time in the interval after stage k: a linear velocity and its integral.
    pub(crate) fn between(&self, stages: &[Stage], k: usize, time: f64) -> Stage {
        let (from, to) = (&stages[k], &stages[k + 1]);
        let (dt, since) = (self.times[k + 1] - self.times[k], time - self.times[k]);
        let share = (since / dt).min(1.0);
        let acceleration = (to.velocity - from.velocity) / dt;
        let velocity = from.velocity + acceleration * (share * dt);
        let mean = (from.velocity + velocity) * 0.5 + self.current;
        Stage { position: from.position + mean * since, velocity }
    }

    /// Time of a stage on the snapshot's clock, s.
    pub(crate) fn time(&self, stage: usize) -> f64 {
        self.frame.time(self.times[stage])
    }

    /// Stages as a trajectory in NED.
    pub(crate) fn trajectory(&self, stages: &[Stage]) -> impl Iterator<Item = TrajectoryPoint> {
        self.frame.trajectory(stages, &self.times)
    }
}

/// Yaw rate now, rad/s, limited: the response model's, free of noise, else the measured one.
fn yaw_rate(snapshot: &Snapshot, followed: Option<FollowedHeading>) -> f64 {
    let craft = snapshot.craft_model();
    let followed = followed.map(|followed| {
        wrap(followed.heading.radians() - snapshot.asc.heading().radians())
            / craft.heading_lag().max(HALF_HOLD)
    });
    let most = craft.limits.turn_rate_max;
    followed.unwrap_or(snapshot.asc.yaw_rate_radps).clamp(-most, most)
}
