//! The surface craft with its inner loops closed, as the planner sees it: a first-order surge within
//! its acceleration limits, and a heading that turns no faster than it can.

use nalgebra::Vector2;

use crate::{
    angle::{Heading, wrap},
    los::{AscNow, Reference},
    snapshot::{Limits, Snapshot},
};

/// Longest interval at which a rolled-out law looks again, s: the rate at which plans are asked for.
const LAW_INTERVAL: f64 = 1.0;

/// Time constant of the yaw loop to a step of its reference, s.
///
/// 2 ζ / ωn of the MEDUSA-class loop, ζ = 0.8 and ωn = 1.6 rad/s.
pub(crate) const YAW_LAG: f64 = 1.0;

/// How fast the bias of the surge loop bleeds away while nothing renews it, s.
///
/// m / (k_i τ) of the MEDUSA-class loop, 50 kg, 3 N/m and τ = 2 s, is 8.3 s.
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
        let (memory, then) = (previous.surge_memory?, previous.trajectory.first()?.time);
        let elapsed = snapshot.time - then;
        let (u, u_before) = (snapshot.asc.surge, memory.surge);
        let asked = (memory.reference - 0.5 * (u + u_before)) / limits.surge_lag.max(0.5 * elapsed);
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

/// Where a law leads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rollout {
    /// The craft at the stages 0 … N.
    pub stages: Vec<Stage>,
    /// Where it is after every second at most.
    pub way: Vec<Waypoint>,
}

/// A place on the way between two stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// The stage k that the interval ends with.
    pub stage: usize,
    /// How much of the interval is over, in (0, 1].
    pub share: f64,
    /// Position in the frame of the stages, m.
    pub position: Vector2<f64>,
}

/// A craft that does what a guidance law asks, as far as it can.
#[derive(Clone, Copy, Debug)]
pub struct Response<'a> {
    /// What the craft can do.
    pub limits: &'a Limits,
    /// Current, m/s, in the frame of the stages.
    pub current: Vector2<f64>,
    /// Acceleration that the surge loop gives unasked at the start, m/s²; it bleeds away with [`SURGE_BIAS_DECAY`].
    pub surge_bias: f64,
}

impl Response<'_> {
    /// Stages 0 … N of the craft that starts at `start` on `heading` and follows `law` over `steps`, and where it
    /// is in between, in place of what `rollout` held. The law is asked once a second at most; it is told the time
    /// since the start, s, the craft, and its speed through the water, m/s.
    pub fn roll_out(
        &self,
        start: Stage,
        heading: Heading,
        steps: &[f64],
        mut law: impl FnMut(f64, &AscNow, f64) -> Reference,
        rollout: &mut Rollout,
    ) {
        let mut asc = AscNow {
            position: start.position,
            heading,
            current: self.current,
        };
        let mut speed = start.velocity.dot(&heading.unit());
        let Rollout { stages, way } = rollout;
        stages.clear();
        stages.push(start);
        way.clear();
        let mut time = 0.0;
        for (i, step) in steps.iter().enumerate() {
            let n_parts = (step / LAW_INTERVAL).ceil().max(1.0);
            let dt = step / n_parts;
            let (begin, end) = (time, time + step);
            while time < end - 0.5 * dt {
                let reference = law(time, &asc, speed);
                let bias = self.surge_bias * (-time / SURGE_BIAS_DECAY).exp();
                (asc, speed) = self.after(dt, &asc, speed, &reference, bias);
                time += dt;
                way.push(Waypoint {
                    stage: i + 1,
                    share: ((time - begin) / step).min(1.0),
                    position: asc.position,
                });
            }
            time = end;
            stages.push(Stage {
                position: asc.position,
                velocity: asc.heading.unit() * speed,
            });
        }
    }

    /// The craft and its speed an interval later, midpoint in position.
    fn after(&self, dt: f64, asc: &AscNow, speed: f64, reference: &Reference, bias: f64) -> (AscNow, f64) {
        let limits = self.limits;
        // (u_ref − (u + u′)/2)/τ with u′ = u + a dt, solved for a.
        let asked = (reference.speed - speed) / (limits.surge_lag.max(0.5 * dt) + 0.5 * dt);
        let acceleration = asked.clamp(-limits.deceleration_max, limits.acceleration_max) + bias;
        let (psi, psi_ref) = (asc.heading.radians(), reference.heading.radians());
        let turn_rate =
            (wrap(psi_ref - psi) / YAW_LAG.max(dt)).clamp(-limits.turn_rate_max, limits.turn_rate_max);
        let middle = Heading::new(psi + 0.5 * dt * turn_rate).unit();
        let velocity = middle * (speed + 0.5 * dt * acceleration) + self.current;
        let heading = Heading::new(psi + dt * turn_rate);
        let asc = AscNow {
            position: asc.position + velocity * dt,
            heading,
            ..*asc
        };
        (asc, speed + dt * acceleration)
    }
}
