//! The surface craft with its inner loops closed, as the planner sees it: a first-order surge within
//! its acceleration limits, and a heading that turns no faster than it can.

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading, wrap},
    forecast::Motion,
    los::{AscNow, LosGains, Reference, saturated_los, target_course},
    snapshot::{Limits, Snapshot},
};

/// Interval at which the rolled-out law looks again, s: the rate at which plans are asked for.
const LAW_INTERVAL: f64 = 1.0;

/// Time constant of the yaw loop to a step of its reference, s.
///
/// 2 ζ / ωn of the MEDUSA-class loop, ζ = 0.8 and ωn = 1.6 rad/s.
const YAW_LAG: f64 = 1.0;

/// How fast the bias of the surge loop bleeds away while nothing renews it, s.
///
/// m / (k_i τ) of the MEDUSA-class loop: 50 kg, 3 N/m, τ = 2 s.
pub const SURGE_BIAS_DECAY: f64 = 8.0;

/// Largest part of the acceleration limits that a bias may take: the rest keeps the program feasible.
const SURGE_BIAS_SHARE: f64 = 0.8;

/// Ages of a previous plan from which the acceleration since then can be told, s.
const SURGE_BIAS_INTERVAL: std::ops::RangeInclusive<f64> = 0.2..=2.0;

/// Acceleration that the surge loop gives unasked, m/s²: its integrator less the drag. It is what the
/// craft did since the previous plan beyond what that plan's speed reference explains; 0 where there
/// is no such plan.
///
/// ```text
/// b = (u − u⁻)/Δ − clamp((u_ref⁻ − (u + u⁻)/2)/τ, −a_dec, a_acc)
/// ```
/// Without it a loop that has wound up over a long acceleration overshoots: measured on the MEDUSA
/// class with drag feed-forward, a catch-up over 14 m passed its target by 6.6 m.
#[must_use]
pub fn surge_bias(snapshot: &Snapshot) -> f64 {
    let limits = &snapshot.limits;
    let estimate = || {
        let previous = snapshot.previous_plan.as_ref()?;
        let (before, reference) = (previous.trajectory.first()?, previous.speed_reference?);
        let elapsed = snapshot.time - before.time;
        let (u, u_before) = (snapshot.asc.surge, before.speed);
        let asked = (reference - 0.5 * (u + u_before)) / limits.surge_lag.max(0.5 * elapsed);
        let explained = asked.clamp(-limits.deceleration_max, limits.acceleration_max);
        SURGE_BIAS_INTERVAL
            .contains(&elapsed)
            .then(|| (u - u_before) / elapsed - explained)
    };
    let most = SURGE_BIAS_SHARE * limits.acceleration_max.min(limits.deceleration_max);
    estimate().unwrap_or(0.0).clamp(-most, most)
}

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
