//! The planning problem in the craft's own frame, sampled on the policy's grid.

use nalgebra::{Matrix2, Vector2};

use crate::{
    angle::{Course, Heading, angle_of, ned_from_body},
    answer::Predicted,
    forecast::Motion,
    goal::GoalForecast,
    los::{AscNow, LosGains, Reference, saturated_los, target_course},
    policy::{Policy, Weights},
    response::{Response, SURGE_BIAS_DECAY, Stage, surge_bias},
    snapshot::{Snapshot, TrajectoryPoint},
};

/// Slower than this, a velocity has no direction worth following, m/s.
const SPEED_WITHOUT_DIRECTION: f64 = 0.02;

/// Quadratic surge drag by which propulsion energy is predicted, N/(m/s)²: the MEDUSA class's.
///
/// Source: public parameters of the craft of the Institute for Systems and Robotics, Lisbon.
pub(crate) const SURGE_DRAG: f64 = 27.5;

/// Facts of one snapshot in the frame of the craft: origin at its position, first axis along its bow.
/// A plan made of them cannot depend on where north or the datum is.
#[derive(Clone, Debug)]
pub(crate) struct Horizon {
    /// Snapshot time, s.
    now: f64,
    origin: Vector2<f64>,
    ned_from_craft: Matrix2<f64>,
    heading: Heading,
    /// Times of the stages after the snapshot, s: 0 first.
    pub(crate) times: Vec<f64>,
    /// Goal at the stages, craft frame.
    pub(crate) goal: Vec<Motion>,
    /// Goal's course when it last moved, NED.
    pub(crate) goal_course: Course,
    /// Current, craft frame, m/s.
    pub(crate) current: Vector2<f64>,
    /// The craft now, craft frame.
    pub(crate) start: Stage,
    /// What the surge loop gives unasked at the stages, m/s².
    pub(crate) surge_bias: Vec<f64>,
}

impl Horizon {
    pub(crate) fn new(snapshot: &Snapshot, policy: &Policy, goal: &GoalForecast) -> Self {
        let ned_from_craft = ned_from_body(snapshot.asc.heading.radians());
        let mut times = vec![0.0];
        times.extend(policy.steps.iter().scan(0.0, |time, step| {
            *time += step;
            Some(*time)
        }));
        let held = snapshot
            .previous_plan
            .as_ref()
            .and_then(|previous| previous.goal_course);
        let bias = surge_bias(snapshot);
        let mut horizon = Self {
            surge_bias: times
                .iter()
                .map(|time| bias * (-time / SURGE_BIAS_DECAY).exp())
                .collect(),
            now: snapshot.time,
            origin: snapshot.asc.position,
            ned_from_craft,
            heading: snapshot.asc.heading,
            goal: Vec::new(),
            goal_course: target_course(&goal.at(0.0), held),
            current: ned_from_craft.transpose() * snapshot.current(),
            start: Stage {
                position: Vector2::zeros(),
                velocity: Vector2::new(snapshot.asc.surge, snapshot.asc.sway),
            },
            times,
        };
        horizon.goal = horizon
            .times
            .iter()
            .map(|time| horizon.local(&goal.at(*time)))
            .collect();
        horizon
    }

    /// Stages of the line-of-sight law, rolled out on the response model.
    pub(crate) fn los_stages(
        &self,
        snapshot: &Snapshot,
        policy: &Policy,
        goal: &GoalForecast,
        gains: LosGains,
    ) -> Vec<Stage> {
        let mut held = Course::new(self.goal_course.radians() - self.heading.radians());
        self.rollout(snapshot, policy, |time, asc| {
            let target = self.local(&goal.at(time));
            held = target_course(&target, Some(held));
            saturated_los(asc, &target, held, gains, &snapshot.limits)
        })
    }

    /// Stages of a law that is asked in the craft's frame, rolled out on the response model.
    pub(crate) fn rollout(
        &self,
        snapshot: &Snapshot,
        policy: &Policy,
        law: impl FnMut(f64, &AscNow) -> Reference,
    ) -> Vec<Stage> {
        let response = Response {
            limits: &snapshot.limits,
            current: self.current,
        };
        response.rollout(self.start, Heading::new(0.0), &policy.steps, law)
    }

    /// Directions of travel, craft frame: the bow first, then those of `stages`; where these are too
    /// slow to have one, the direction before.
    pub(crate) fn directions_of(stages: &[Stage]) -> Vec<Vector2<f64>> {
        let ahead = Vector2::new(1.0, 0.0);
        let later = stages[1..].iter().scan(ahead, |last, stage| {
            *last = stage
                .velocity
                .try_normalize(SPEED_WITHOUT_DIRECTION)
                .unwrap_or(*last);
            Some(*last)
        });
        std::iter::once(ahead).chain(later).collect()
    }

    /// Directions of travel of an earlier plan's points at this horizon's stages, craft frame.
    pub(crate) fn directions_along(&self, points: &[TrajectoryPoint]) -> Vec<Vector2<f64>> {
        let ahead = Vector2::new(1.0, 0.0);
        let craft_from_ned = self.ned_from_craft.transpose();
        let later = self.times[1..]
            .iter()
            .map(|time| craft_from_ned * point_at(points, self.now + time).heading.unit());
        std::iter::once(ahead).chain(later).collect()
    }

    /// Stages as a trajectory in NED.
    pub(crate) fn trajectory(&self, stages: &[Stage]) -> Vec<TrajectoryPoint> {
        let mut heading = self.heading;
        stages
            .iter()
            .zip(&self.times)
            .enumerate()
            .map(|(k, (stage, time))| {
                let velocity = self.ned_from_craft * stage.velocity;
                if k > 0 && velocity.norm() >= SPEED_WITHOUT_DIRECTION {
                    heading = Heading::new(angle_of(&velocity));
                }
                TrajectoryPoint {
                    time: self.now + time,
                    position: self.origin + self.ned_from_craft * stage.position,
                    speed: stage.velocity.norm(),
                    heading,
                }
            })
            .collect()
    }

    /// What `stages` are predicted to lead to.
    ///
    /// The merit is the program's own cost in natural units, without its slacks, its scale, and its cap on
    /// far goals: the same for every candidate.
    pub(crate) fn predict(&self, stages: &[Stage], weights: &Weights) -> Predicted {
        let (mut merit, mut square_error, mut energy) = (0.0, 0.0, 0.0);
        let mut acceleration_before: Option<Vector2<f64>> = None;
        let misses: Vec<_> = stages
            .iter()
            .zip(&self.goal)
            .map(|(stage, goal)| {
                let error = (stage.position - goal.position).norm_squared();
                let relative = (stage.velocity + self.current - goal.velocity).norm_squared();
                (error, relative, SURGE_DRAG * stage.velocity.norm().powi(3))
            })
            .collect();
        for k in 1..stages.len() {
            let dt = self.times[k] - self.times[k - 1];
            let (from, to) = (misses[k - 1], misses[k]);
            square_error += 0.5 * dt * (from.0 + to.0);
            energy += 0.5 * dt * (from.2 + to.2);
            merit += 0.5 * dt * weights.velocity * (from.1 + to.1);
            let acceleration = (stages[k].velocity - stages[k - 1].velocity) / dt;
            merit += dt * weights.acceleration * acceleration.norm_squared();
            if let Some(before) = acceleration_before.replace(acceleration) {
                merit += weights.acceleration_change * (acceleration - before).norm_squared();
            }
        }
        let (last_error, last_relative, _) = misses[misses.len() - 1];
        merit += weights.position * square_error
            + weights.terminal_position * last_error
            + weights.terminal_velocity * last_relative;
        let duration = self.times[self.times.len() - 1];
        Predicted {
            merit,
            rms_error: (square_error / duration).sqrt(),
            energy,
        }
    }

    /// A point of a trajectory as a stage, craft frame.
    pub(crate) fn stage(&self, point: &TrajectoryPoint) -> Stage {
        let craft_from_ned = self.ned_from_craft.transpose();
        Stage {
            position: craft_from_ned * (point.position - self.origin),
            velocity: craft_from_ned * point.heading.unit() * point.speed,
        }
    }

    fn local(&self, motion: &Motion) -> Motion {
        let craft_from_ned = self.ned_from_craft.transpose();
        Motion {
            position: craft_from_ned * (motion.position - self.origin),
            velocity: craft_from_ned * motion.velocity,
        }
    }
}

/// The previous plan's points, where it is young enough, reaches into the future, and leads through
/// where the craft is: the plan of another mission does not.
pub(crate) fn previous_points<'a>(snapshot: &'a Snapshot, policy: &Policy) -> Option<&'a [TrajectoryPoint]> {
    let points = snapshot.previous_plan.as_ref()?.trajectory.as_slice();
    let (first, last, now) = (points.first()?, points.last()?, snapshot.time);
    let young = first.time <= now && now - first.time < policy.previous_plan_age_max && now < last.time;
    let miss = (point_at(points, now).position - snapshot.asc.position).norm();
    (young && miss < policy.previous_plan_miss_max).then_some(points)
}

/// A trajectory at a time between its points, linear in position and speed, along the shorter arc in
/// heading; its ends beyond them.
pub(crate) fn point_at(points: &[TrajectoryPoint], time: f64) -> TrajectoryPoint {
    let after = points.partition_point(|point| point.time <= time);
    if after == 0 {
        return points[0];
    }
    if after == points.len() {
        return points[after - 1];
    }
    let (from, to) = (&points[after - 1], &points[after]);
    let share = (time - from.time) / (to.time - from.time);
    let turn = crate::angle::wrap(to.heading.radians() - from.heading.radians());
    TrajectoryPoint {
        time,
        position: from.position.lerp(&to.position, share),
        speed: from.speed + share * (to.speed - from.speed),
        heading: Heading::new(from.heading.radians() + share * turn),
    }
}
