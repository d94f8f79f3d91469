//! The surface craft with its inner loops closed, as the planner sees it: a first-order surge within
//! its acceleration limits, and a heading that turns no faster than it can.

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading, wrap},
    forecast::Motion,
    los::{AscNow, LosGains, Reference, saturated_los, target_course},
    snapshot::Limits,
};

/// Interval at which the rolled-out law looks again, s: the rate at which plans are asked for.
const LAW_INTERVAL: f64 = 1.0;

/// Time constant of the yaw loop to a step of its reference, s.
///
/// 2 ζ / ωn of the MEDUSA-class loop, ζ = 0.8 and ωn = 1.6 rad/s.
const YAW_LAG: f64 = 1.0;

/// Position and velocity through the water at one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Position (north, east) or (ahead, starboard), m.
    pub position: Vector2<f64>,
    /// Velocity through the water in the same frame, m/s.
    pub velocity: Vector2<f64>,
}

/// The line-of-sight law followed over the whole horizon on the response model.
#[derive(Clone, Copy, Debug)]
pub struct LosRollout<'a> {
    /// The law's gains.
    pub gains: LosGains,
    /// What the craft can do.
    pub limits: &'a Limits,
    /// Current, m/s.
    pub current: Vector2<f64>,
    /// The goal's course while it stands still.
    pub held_course: Option<Course>,
}

impl LosRollout<'_> {
    /// Stages 0 … N of the craft that starts at `start` on `heading`, and follows `goal` over `steps`.
    #[must_use]
    pub fn stages(
        &self,
        start: Stage,
        heading: Heading,
        goal: impl Fn(f64) -> Motion,
        steps: &[f64],
    ) -> Vec<Stage> {
        let mut craft = Craft {
            position: start.position,
            heading: heading.radians(),
            speed: start.velocity.dot(&heading.unit()),
        };
        let mut stages = Vec::with_capacity(steps.len() + 1);
        stages.push(start);
        let (mut time, mut held) = (0.0, self.held_course);
        for step in steps {
            let n_parts = (step / LAW_INTERVAL).ceil().max(1.0);
            let dt = step / n_parts;
            let end = time + step;
            while time < end - 0.5 * dt {
                let target = goal(time);
                held = Some(target_course(&target, held));
                let asc = AscNow {
                    position: craft.position,
                    heading: Heading::new(craft.heading),
                    current: self.current,
                };
                let course = target_course(&target, held);
                craft.follow(
                    &saturated_los(&asc, &target, course, self.gains, self.limits),
                    self,
                    dt,
                );
                time += dt;
            }
            time = end;
            stages.push(Stage {
                position: craft.position,
                velocity: Heading::new(craft.heading).unit() * craft.speed,
            });
        }
        stages
    }
}

struct Craft {
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
}

impl Craft {
    /// One interval, midpoint in position.
    fn follow(&mut self, reference: &Reference, world: &LosRollout<'_>, dt: f64) {
        let limits = world.limits;
        let speed_gap = (reference.speed - self.speed) / limits.surge_lag.max(dt);
        let acceleration = speed_gap.clamp(-limits.deceleration_max, limits.acceleration_max);
        let heading_gap = wrap(reference.heading.radians() - self.heading) / YAW_LAG.max(dt);
        let turn_rate = heading_gap.clamp(-limits.turn_rate_max, limits.turn_rate_max);
        let middle = Heading::new(self.heading + 0.5 * dt * turn_rate).unit();
        self.position += (middle * (self.speed + 0.5 * dt * acceleration) + world.current) * dt;
        self.heading = wrap(self.heading + dt * turn_rate);
        self.speed += dt * acceleration;
    }
}
