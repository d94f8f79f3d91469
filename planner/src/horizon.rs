//! The planning problem in the craft's own frame, sampled on the policy's grid.

use nalgebra::{Matrix2, Vector2};

use crate::{
    angle::{Course, Heading, angle_of, ned_from_body, wrap},
    craft::{CraftModel, PropulsionPower},
    forecast::{AuvForecast, Motion},
    goal::GoalForecast,
    los::{AscNow, LosTuning, Reference, TrackingLaw, target_course},
    policy::{Policy, Weights},
    refilled::refilled,
    response::{HALF_HOLD, Response, Rollout, Stage, Surge, velocity_now},
    snapshot::{Snapshot, TrajectoryPoint},
    surroundings::Surroundings,
};

/// Slower than this, a velocity has no direction worth following, m/s.
pub(crate) const SPEED_WITHOUT_DIRECTION: f64 = 0.02;

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
    /// Yaw rate that the craft has now, rad/s.
    pub(crate) yaw_rate: f64,
    /// Heading reference that the craft follows now, as an angle from the bow, where one is known.
    pub(crate) heading_reference: Option<Heading>,
    /// Propulsion power of the craft.
    pub(crate) power: PropulsionPower,
    /// Weights of the cost, as the goal is known.
    pub(crate) weights: Weights,
    /// What is around the craft, craft frame.
    pub(crate) surroundings: Surroundings,
}

impl Horizon {
    /// The horizon of `snapshot`, in the memory of an earlier one.
    pub(crate) fn in_memory(
        memory: Option<Self>,
        snapshot: &Snapshot,
        policy: &Policy,
        goal: &GoalForecast,
    ) -> Self {
        let (times, motions, mut surroundings) =
            memory.map_or_else(Default::default, |old| (old.times, old.goal, old.surroundings));
        let ned_from_craft = ned_from_body(snapshot.asc.heading.radians());
        let later = policy.steps.iter().scan(0.0, |time, step| {
            *time += step;
            Some(*time)
        });
        let times = refilled(times, std::iter::once(0.0).chain(later));
        let yaw_rate = yaw_rate(snapshot, policy);
        let mut horizon = Self {
            yaw_rate,
            heading_reference: heading_reference(snapshot, policy)
                .map(|reference| Heading::new(reference.radians() - snapshot.asc.heading.radians())),
            now: snapshot.time,
            origin: snapshot.asc.position,
            ned_from_craft,
            heading: snapshot.asc.heading,
            goal: Vec::new(),
            goal_course: target_course(&goal.at(0.0), Some(goal.course())),
            current: ned_from_craft.transpose() * snapshot.current(),
            start: Stage {
                position: Vector2::zeros(),
                velocity: velocity_now(snapshot, yaw_rate),
            },
            power: snapshot.craft_model().power,
            weights: policy.weights_for(snapshot, goal),
            surroundings: Surroundings::default(),
            times,
        };
        let local_goal = |time: &f64| horizon.local(&goal.at(*time));
        horizon.goal = refilled(motions, horizon.times.iter().map(local_goal));
        surroundings.restate(snapshot, policy, &horizon, goal.auvs());
        horizon.surroundings = surroundings;
        horizon
    }

    /// A line-of-sight law from a start without memory, rolled out on the response model.
    pub(crate) fn line_of_sight(
        &self,
        snapshot: &Snapshot,
        policy: &Policy,
        goal: &GoalForecast,
        tuning: LosTuning,
        rollout: &mut Rollout,
    ) {
        let mut tracking = TrackingLaw::new(tuning, Some(self.local_goal_course()));
        let law = |time, asc: &_, _| tracking.steer(time, asc, &self.local(&goal.at(time)), &snapshot.limits);
        self.roll_out(snapshot.craft_model(), policy, law, rollout);
    }

    /// Acceleration through the water until now, craft frame, m/s²: across the direction of travel, what the yaw rate makes.
    pub(crate) fn acceleration(&self) -> Vector2<f64> {
        let velocity = self.start.velocity;
        Vector2::new(-velocity.y, velocity.x) * self.yaw_rate
    }

    /// A law that is asked in the craft's frame, rolled out on the response model.
    pub(crate) fn roll_out(
        &self,
        craft: &CraftModel,
        policy: &Policy,
        law: impl FnMut(f64, &AscNow, Surge) -> Reference,
        rollout: &mut Rollout,
    ) {
        let response = Response {
            craft,
            current: self.current,
            heading_reference: self.heading_reference,
        };
        response.roll_out(self.start, Heading::new(0.0), &policy.steps, law, rollout);
    }

    /// Directions of travel, craft frame: the bow first, then those of `stages`; where these are too
    /// slow to have one, the direction before.
    pub(crate) fn directions_of(stages: &[Stage]) -> impl Iterator<Item = Vector2<f64>> {
        let ahead = Vector2::new(1.0, 0.0);
        let later = stages[1..].iter().scan(ahead, |last, stage| {
            *last = stage
                .velocity
                .try_normalize(SPEED_WITHOUT_DIRECTION)
                .unwrap_or(*last);
            Some(*last)
        });
        std::iter::once(ahead).chain(later)
    }

    /// An earlier plan's points at this horizon's stages, craft frame.
    pub(crate) fn stages_along(&self, points: &[TrajectoryPoint]) -> impl Iterator<Item = Stage> {
        let later = self.times[1..]
            .iter()
            .map(|time| self.stage(&point_at(points, self.now + time)));
        std::iter::once(self.start).chain(later)
    }

    /// The goal's course when it last moved, as an angle from the bow.
    pub(crate) fn local_goal_course(&self) -> Course {
        Course::new(self.goal_course.radians() - self.heading.radians())
    }

    /// `stages` at a time in the interval that begins with stage k, or just beyond it: a linear velocity, and the
    /// position that it leads to.
    pub(crate) fn between(&self, stages: &[Stage], k: usize, time: f64) -> Stage {
        let (from, to) = (&stages[k], &stages[k + 1]);
        let (dt, since) = (self.times[k + 1] - self.times[k], time - self.times[k]);
        let share = (since / dt).min(1.0);
        let acceleration = (to.velocity - from.velocity) / dt;
        let velocity = from.velocity + acceleration * (share * dt);
        let mean = (from.velocity + velocity) * 0.5 + self.current;
        Stage {
            position: from.position + mean * since,
            velocity,
        }
    }

    /// Time of a stage on the snapshot's clock, s.
    pub(crate) fn time(&self, stage: usize) -> f64 {
        self.now + self.times[stage]
    }

    /// Stages as a trajectory in NED.
    pub(crate) fn trajectory(&self, stages: &[Stage]) -> impl Iterator<Item = TrajectoryPoint> {
        let mut heading = self.heading;
        stages
            .iter()
            .zip(&self.times)
            .enumerate()
            .map(move |(k, (stage, time))| {
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
    }

    /// A point of a trajectory as a stage, craft frame.
    pub(crate) fn stage(&self, point: &TrajectoryPoint) -> Stage {
        let craft_from_ned = self.ned_from_craft.transpose();
        Stage {
            position: craft_from_ned * (point.position - self.origin),
            velocity: craft_from_ned * point.heading.unit() * point.speed,
        }
    }

    /// A position (north, east) in the craft frame, m.
    pub(crate) fn local_position(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.ned_from_craft.transpose() * (position - self.origin)
    }

    /// Where an AUV is forecast at the stages, craft frame.
    pub(crate) fn positions_of(&self, auv: &AuvForecast) -> impl Iterator<Item = Vector2<f64>> {
        let position = |time: &f64| self.local_position(&auv.at(*time).position);
        self.times.iter().map(position)
    }

    /// A direction (north, east) in the craft frame.
    pub(crate) fn local_direction(&self, direction: &Vector2<f64>) -> Vector2<f64> {
        self.ned_from_craft.transpose() * direction
    }

    /// A motion in the craft frame.
    pub(crate) fn local(&self, motion: &Motion) -> Motion {
        let craft_from_ned = self.ned_from_craft.transpose();
        Motion {
            position: craft_from_ned * (motion.position - self.origin),
            velocity: craft_from_ned * motion.velocity,
        }
    }
}

/// Heading that the craft has been turning to since the previous plan: its reference, and what it stays off that.
pub(crate) fn heading_reference(snapshot: &Snapshot, policy: &Policy) -> Option<Heading> {
    previous_points(snapshot, policy)?;
    let reference = snapshot.previous_plan.as_ref()?.reference?.heading;
    Some(Heading::new(
        reference.radians() + snapshot.craft_model().heading_offset,
    ))
}

/// Yaw rate now, rad/s: what the response model makes of the reference that the craft follows, which has no sensor's
/// noise; else as measured. Never faster than the craft can turn.
fn yaw_rate(snapshot: &Snapshot, policy: &Policy) -> f64 {
    let craft = snapshot.craft_model();
    let followed = heading_reference(snapshot, policy).map(|reference| {
        wrap(reference.radians() - snapshot.asc.heading.radians()) / craft.heading_lag().max(HALF_HOLD)
    });
    let most = craft.limits.turn_rate_max;
    followed.unwrap_or(snapshot.asc.yaw_rate).clamp(-most, most)
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
    let turn = wrap(to.heading.radians() - from.heading.radians());
    TrajectoryPoint {
        time,
        position: from.position.lerp(&to.position, share),
        speed: from.speed + share * (to.speed - from.speed),
        heading: Heading::new(from.heading.radians() + share * turn),
    }
}
