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

/// Time constant with which what the surge loop gives unasked follows what the craft does, s.
///
/// k_p / k_i of the MEDUSA-class loop, 26 N/(m/s) and 3 N/m; the Otter-class loop has nearly the same.
pub const SURGE_BIAS_TIME: f64 = 26.0 / 3.0;

/// Largest bias, as a multiple of the weaker acceleration limit: beyond it an estimate is taken for an error.
const SURGE_BIAS_MOST: f64 = 1.5;

/// Part of what a measured bias differs from the expected one that is believed. Waves and a log's noise make
/// accelerations that are no bias: measured in rough water and with an unknown current, the craft spends a tenth and a
/// fifth less energy than with the whole.
const SURGE_BIAS_TRUST: f64 = 0.1;

/// Part of the velocity that the plan before foresaw in the one that is believed.
const PLANNED_SHARE: f64 = 0.8;

/// A velocity farther than this from the planned one is no noise, m/s: three standard deviations of waves and log
/// together, 0.1 m/s in a rough sea.
const UNFORESEEN_MAX: f64 = 0.3;

/// Ages of a previous plan from which the acceleration since then can be told, s.
const SURGE_BIAS_INTERVAL: std::ops::RangeInclusive<f64> = 0.2..=2.0;

/// Acceleration that the surge loop gives unasked, m/s²: its integrator less the drag. It is what the
/// craft did since the previous plan beyond what that plan's speed reference explains, averaged with what that plan
/// makes expect; 0 where there is no such plan.
///
/// ```text
/// b  = b⁺ + 0.1 (b_m − b⁺),      b⁺ after b⁻ as in `bias_after`, with the measured acceleration
/// b_m = (u − u⁻)/Δ − clamp((u_ref⁻ − (u + u⁻)/2)/τ, −a_dec, a_acc)
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
        let (least, most) = SURGE_BIAS_INTERVAL.into_inner();
        if elapsed < least {
            return memory.bias.filter(|_| 0.0 <= elapsed);
        }
        let (u, u_before) = (snapshot.asc.surge, memory.surge);
        let asked = (memory.reference - 0.5 * (u + u_before)) / limits.surge_lag.max(0.5 * elapsed);
        let explained = asked.clamp(-limits.deceleration_max, limits.acceleration_max);
        let acceleration = (u - u_before) / elapsed;
        let measured = acceleration - explained;
        let expected = |bias| bias_after(elapsed, within(bias, limits), acceleration, limits);
        match memory.bias.map(expected) {
            // One speed reference explains no more than a second or two.
            Some(expected) if most < elapsed => (elapsed < SURGE_BIAS_TIME).then_some(expected),
            Some(expected) => Some(expected + SURGE_BIAS_TRUST * (measured - expected)),
            None => (elapsed <= most).then_some(measured),
        }
    };
    within(estimate().unwrap_or(0.0), limits)
}

/// The bias an interval later, m/s²: the loop's integral part gathers what its proportional part, `acceleration − bias`,
/// asks for.
///
/// ```text
/// ḃ = (a − b) / T
/// ```
fn bias_after(dt: f64, bias: f64, acceleration: f64, limits: &Limits) -> f64 {
    let asked = (acceleration - bias).clamp(-limits.deceleration_max, limits.acceleration_max);
    within(bias + asked * (1.0 - (-dt / SURGE_BIAS_TIME).exp()), limits)
}

/// A bias that a loop may have.
fn within(bias: f64, limits: &Limits) -> f64 {
    let most = SURGE_BIAS_MOST * limits.acceleration_max.min(limits.deceleration_max);
    bias.clamp(-most, most)
}

/// The bias at the stages of a way, m/s²: `bias` first, then what the way's own accelerations make of it.
pub(crate) fn surge_biases(
    bias: f64,
    stages: &[Stage],
    steps: &[f64],
    limits: &Limits,
) -> impl Iterator<Item = f64> {
    let later = stages.windows(2).zip(steps).scan(bias, |bias, (pair, dt)| {
        let acceleration = (pair[1].velocity.norm() - pair[0].velocity.norm()) / dt;
        *bias = bias_after(*dt, *bias, acceleration, limits);
        Some(*bias)
    });
    std::iter::once(bias).chain(later)
}

/// Velocity through the water (ahead, starboard) that a plan starts from, m/s: between what the craft measures
/// and what the plan before has it at now, where that plan is a second old and the two are not far apart.
///
/// Waves, a log's noise and the swing of the bow in them are over before a plan could answer them; what a plan made of
/// them asks for is noise. What the plan before did not foresee is believed by a fifth, and by two thirds 4 s later.
/// Measured with an unknown current and noisy sensors, the heading travels 0.65 times as far with a half, and 0.87 times
/// as far again with a fifth.
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

/// A craft's surge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surge {
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Acceleration that the surge loop gives unasked, m/s².
    pub bias: f64,
}

/// A craft that does what a guidance law asks, as far as it can.
#[derive(Clone, Copy, Debug)]
pub struct Response<'a> {
    /// What the craft can do.
    pub limits: &'a Limits,
    /// Current, m/s, in the frame of the stages.
    pub current: Vector2<f64>,
    /// Acceleration that the surge loop gives unasked at the start, m/s².
    pub surge_bias: f64,
}

impl Response<'_> {
    /// Stages 0 … N of the craft that starts at `start` on `heading` and follows `law` over `steps`, and where it
    /// is in between, in place of what `rollout` held. The law is asked once a second at most; it is told the time
    /// since the start, s, the craft, and its surge.
    pub fn roll_out(
        &self,
        start: Stage,
        heading: Heading,
        steps: &[f64],
        mut law: impl FnMut(f64, &AscNow, Surge) -> Reference,
        rollout: &mut Rollout,
    ) {
        let mut asc = AscNow {
            position: start.position,
            heading,
            current: self.current,
        };
        let mut surge = Surge {
            speed: start.velocity.dot(&heading.unit()),
            bias: self.surge_bias,
        };
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
                let reference = law(time, &asc, surge);
                (asc, surge) = self.after(dt, &asc, surge, &reference);
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
                velocity: asc.heading.unit() * surge.speed,
            });
        }
    }

    /// The craft and its speed an interval later, midpoint in position.
    fn after(&self, dt: f64, asc: &AscNow, surge: Surge, reference: &Reference) -> (AscNow, Surge) {
        let limits = self.limits;
        let Surge { speed, bias } = surge;
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
        let surge = Surge {
            speed: speed + dt * acceleration,
            bias: bias_after(dt, bias, acceleration, limits),
        };
        (asc, surge)
    }
}
