//! The craft with closed inner loops: a first-order surge and a heading, both limited in rate.

use nalgebra::Vector2;

use crate::craft::model::CraftModel;
use crate::facts::angle::{Heading, wrap};
use crate::facts::asc::AscNow;
use crate::facts::reference::Reference;

/// Longest interval between two steps of a rolled-out law, s: the period of plans.
const LAW_INTERVAL: f64 = 1.0;

/// Half of the time for which a reference is held, s: the period of plans is a second.
pub(crate) const HALF_HOLD: f64 = 0.5;

/// The surge disturbance an interval later, m/s²: without an integrator it is constant.
///
/// ```text
/// ḃ = (a − b) / T_i
/// ```
fn disturbance_after(dt: f64, bias: f64, acceleration: f64, craft: &CraftModel) -> f64 {
    let (limits, most) = (&craft.limits, craft.surge_disturbance_max());
    let Some(integral_time) = craft.integral_time else {
        return bias;
    };
    let asked = (acceleration - bias).clamp(-limits.deceleration_max, limits.acceleration_max);
    (bias + asked * (1.0 - (-dt / integral_time).exp())).clamp(-most, most)
}

/// The surge disturbance at a trajectory's stages, m/s²: the craft's, then integrated.
pub(crate) fn surge_disturbances(
    stages: &[Stage],
    steps: &[f64],
    craft: &CraftModel,
) -> impl Iterator<Item = f64> {
    let later = stages.windows(2).zip(steps).scan(craft.surge_disturbance, |bias, (pair, dt)| {
        let acceleration = (pair[1].velocity.norm() - pair[0].velocity.norm()) / dt;
        *bias = disturbance_after(*dt, *bias, acceleration, craft);
        Some(*bias)
    });
    std::iter::once(craft.surge_disturbance).chain(later)
}

/// Position and velocity through the water at one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stage {
    /// Position (north, east) or (ahead, starboard), m.
    pub(crate) position: Vector2<f64>,
    /// Velocity through the water in the same frame, m/s.
    pub(crate) velocity: Vector2<f64>,
}

/// Trajectory of a law.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Rollout {
    /// The craft at the stages 0 … N.
    pub(crate) stages: Vec<Stage>,
    /// Positions at intervals of at most a second.
    pub(crate) waypoints: Vec<Waypoint>,
}

/// A position between two stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Waypoint {
    /// The stage k at the end of the interval.
    pub(crate) stage: usize,
    /// Elapsed share of the interval, in (0, 1].
    pub(crate) share: f64,
    pub(crate) position: Vector2<f64>,
}

/// Surge of a craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surge {
    pub(crate) speed: f64,
    /// Acceleration disturbance of the surge loop, m/s².
    pub(crate) bias: f64,
}

/// A craft that follows a guidance law within its limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response<'a> {
    pub(crate) craft: &'a CraftModel,
    /// Current, m/s, in the frame of the stages.
    pub(crate) current: Vector2<f64>,
    /// Heading reference followed at the start, in the frame of the stages, if known.
    pub(crate) heading_reference: Option<Heading>,
}

impl Response<'_> {
    /// Stages 0 … N, and positions between, of a craft from `start` on `heading` that follows `law`
    /// over `steps`. The law runs at most once a second, with the time since the start, s, the
    /// craft, and its surge. Its heading reference passes the slew limiter of every answer.
    pub(crate) fn roll_out(
        &self,
        start: Stage,
        heading: Heading,
        steps: &[f64],
        mut law: impl FnMut(f64, &AscNow, Surge) -> Reference,
    ) -> Rollout {
        let mut asc = AscNow { position: start.position, heading, current: self.current };
        let mut surge =
            Surge { speed: start.velocity.dot(&heading.unit()), bias: self.craft.surge_disturbance };
        let mut followed = self.heading_reference;
        let (mut stages, mut waypoints) = (vec![start], Vec::new());
        let mut time = 0.0;
        for (i, step) in steps.iter().enumerate() {
            let n_parts = (step / LAW_INTERVAL).ceil().max(1.0);
            let dt = step / n_parts;
            let (begin, end) = (time, time + step);
            while time < end - 0.5 * dt {
                let asked = law(time, &asc, surge);
                let slew = Slew::of(self.craft, self.craft.limits.turn_rate_max, dt);
                let reference = Reference {
                    heading: followed.map_or(asked.heading, |from| {
                        limited_heading(asked.heading, from, asc.heading, slew)
                    }),
                    ..asked
                };
                followed = Some(reference.heading);
                (asc, surge) = self.after(dt, &asc, surge, &reference);
                time += dt;
                waypoints.push(Waypoint {
                    stage: i + 1,
                    share: ((time - begin) / step).min(1.0),
                    position: asc.position,
                });
            }
            time = end;
            stages.push(Stage { position: asc.position, velocity: asc.heading.unit() * surge.speed });
        }
        Rollout { stages, waypoints }
    }

    /// The craft and its surge an interval later; the position by the midpoint rule.
    pub(crate) fn after(
        &self,
        dt: f64,
        asc: &AscNow,
        surge: Surge,
        reference: &Reference,
    ) -> (AscNow, Surge) {
        let (craft, limits) = (self.craft, &self.craft.limits);
        let Surge { speed, bias } = surge;
        // (u_ref − (u + u′)/2)/τ with u′ = u + a dt, solved for a.
        let asked = (reference.speed - speed) / (craft.surge_lag().max(0.5 * dt) + 0.5 * dt);
        let acceleration = asked.clamp(-limits.deceleration_max, limits.acceleration_max) + bias;
        let (psi, psi_ref) = (asc.heading.radians(), reference.heading.radians());
        let turn_rate = (wrap(psi_ref - psi) / craft.heading_lag().max(dt))
            .clamp(-limits.turn_rate_max, limits.turn_rate_max);
        let middle = Heading::new(psi + 0.5 * dt * turn_rate).unit();
        let velocity = middle * (speed + 0.5 * dt * acceleration) + self.current;
        let heading = Heading::new(psi + dt * turn_rate);
        let asc = AscNow { position: asc.position + velocity * dt, heading, ..*asc };
        let surge = Surge {
            speed: speed + dt * acceleration,
            bias: disturbance_after(dt, bias, acceleration, craft),
        };
        (asc, surge)
    }
}

/// Largest angle of a heading reference from the bow, rad; beyond π a loop reverses its turn.
const REFERENCE_AHEAD_MAX: f64 = 2.6;

/// Rate at which the reference of a slow craft takes the lead of a steady turn, rad/s.
const LEADING_RATE: f64 = 0.17;

/// Largest turns of a heading reference in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slew {
    /// Rad, with any lead over the bow.
    pub(crate) step: f64,
    /// Rad, up to the lead of a steady turn.
    pub(crate) leading_step: f64,
    /// That lead, rad.
    pub(crate) lead: f64,
}

impl Slew {
    /// The limits for `dt` s of a `craft` that turns at `rate`, rad/s.
    pub(crate) fn of(craft: &CraftModel, rate: f64, dt: f64) -> Self {
        Self { step: rate * dt, leading_step: LEADING_RATE * dt, lead: rate * craft.heading_lag() }
    }
}

/// The heading reference within `slew` of `from`, towards `asked`, in the bow's sense of turn.
///
/// The limit is relative to the *previous reference*: that of a lagging craft must lead its bow by
/// rate times lag for the largest turn rate. It takes that lead at [`LEADING_RATE`]; at the craft's
/// own rate a turn begins as late as the loop lags, see `docs/rationale.md#references`.
pub(crate) fn limited_heading(asked: Heading, from: Heading, bow: Heading, slew: Slew) -> Heading {
    let psi = bow.radians();
    let ahead = wrap(from.radians() - psi);
    let [most, least] = [1.0, -1.0].map(|side| {
        let leading = (slew.lead - side * ahead).min(slew.leading_step);
        side * leading.max(slew.step)
    });
    let step = (wrap(asked.radians() - psi) - ahead).clamp(least, most);
    Heading::new(psi + (ahead + step).clamp(-REFERENCE_AHEAD_MAX, REFERENCE_AHEAD_MAX))
}
