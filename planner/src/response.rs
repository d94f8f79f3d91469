//! The surface craft with its inner loops closed, as the planner sees it: a first-order surge within
//! its acceleration limits, and a heading that turns no faster than it can.

use nalgebra::Vector2;

use crate::{
    angle::{Heading, ned_from_body, wrap},
    horizon::{point_at, previous_points},
    los::{AscNow, Reference},
    policy::Policy,
    snapshot::{Limits, Snapshot},
};

/// Longest interval at which a rolled-out law looks again, s: the rate at which plans are asked for.
const LAW_INTERVAL: f64 = 1.0;

/// Time constant of the yaw loop to a step of its reference, s, as a rollout has it: a follower that leads by as much
/// goes where the plan goes, as the craft does that is given [`COURSE_LAG`].
///
/// 2 ζ / ωn of the MEDUSA-class loop, ζ = 0.8 and ωn = 1.6 rad/s.
pub(crate) const YAW_LAG: f64 = 1.0;

/// By how much the bow is behind a heading reference that turns, s: [`YAW_LAG`], and half of the second for which a
/// reference is held.
pub(crate) const HEADING_LAG: f64 = YAW_LAG + 0.5;

/// By how much the direction of travel is behind a heading reference that turns, s: [`HEADING_LAG`], and by how much the
/// direction of travel is behind the bow, m_u / d_v of the MEDUSA class, 50 kg and 55.1 kg/s.
///
/// ```text
/// d_v v = −m_u u r, and so β = v/u = −(m_u / d_v) r
/// ```
/// With 1 s in its place, a craft that follows a lawn-mower turns later than planned: measured, its settled distance
/// from the AUV is 1.6 to 2.3 times as large.
pub(crate) const COURSE_LAG: f64 = HEADING_LAG + 0.9;

/// How fast the bias of the surge loop bleeds away while nothing renews it, s.
///
/// m / (k_i τ) of the MEDUSA-class loop, 50 kg, 3 N/m and τ = 2 s, is 8.3 s.
pub const SURGE_BIAS_DECAY: f64 = 8.0;

/// Largest part of the acceleration limits that a bias may take: the rest keeps the program feasible.
const SURGE_BIAS_SHARE: f64 = 0.8;

/// Part of the velocity that the plan before foresaw in the one that is believed.
const PLANNED_SHARE: f64 = 0.5;

/// A velocity farther than this from the planned one is no noise, m/s: three standard deviations of waves and log
/// together, 0.1 m/s in a rough sea.
const UNFORESEEN_MAX: f64 = 0.3;

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

/// Velocity through the water (ahead, starboard) that a plan starts from, m/s: halfway between what the craft measures
/// and what the plan before has it at now, where that plan is a second old and the two are not far apart.
///
/// Waves, a log's noise and the swing of the bow in them are over before a plan could answer them; what a plan made of
/// them asks for is noise. What the plan before did not foresee is believed by half, and by three quarters a second later.
/// Measured with an unknown current and noisy sensors, the heading travels 0.65 times as far.
#[must_use]
pub fn believed_velocity(snapshot: &Snapshot, policy: &Policy) -> Vector2<f64> {
    let measured = Vector2::new(snapshot.asc.surge, snapshot.asc.sway);
    let planned = || {
        let points = previous_points(snapshot, policy)?;
        let now = point_at(points, snapshot.time);
        let body_from_ned = ned_from_body(snapshot.asc.heading.radians()).transpose();
        SURGE_BIAS_INTERVAL
            .contains(&(snapshot.time - points[0].time))
            .then(|| body_from_ned * now.heading.unit() * now.speed)
    };
    match planned() {
        Some(planned) if (planned - measured).norm() < UNFORESEEN_MAX => {
            measured.lerp(&planned, PLANNED_SHARE)
        }
        Some(_) | None => measured,
    }
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
