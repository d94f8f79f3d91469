//! One draw of a random craft: traits, then the hull, then the loops that fit it.

use planner::craft::{HeadingReference, SpeedReference};
use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

use super::{ACCELERATION, CraftConstraints, CraftTraits, DELAY, HeadingLoopKind, LAG, MASS, SurgeLoopKind};
use crate::world::{
    hull::{CoriolisMasses, Drag, SurfaceHull, Thrusters},
    inner_loop::{
        AntiWindup, DELAY_PERIODS_MAX, DragFeedForward, HeadingLoop, PERIOD, SpeedSlew, SurfaceAutopilot,
        SurgeGains,
    },
};

pub(super) struct Draw<'a> {
    pub(super) rng: ChaCha8Rng,
    pub(super) constraints: &'a CraftConstraints,
}

impl Draw<'_> {
    pub(super) fn craft(mut self) -> (SurfaceHull, SurfaceAutopilot, CraftTraits) {
        let traits = self.traits();
        let heading_held = self.constraints.heading_held;
        let drawn = if self.chance(0.2) { HeadingReference::Course } else { HeadingReference::Heading };
        let heading_held = heading_held.unwrap_or(drawn);
        let hull = self.hull(&traits, heading_held);
        let (surge, feed_forward, speed_slew) = self.surge(&hull, &traits);
        let over_ground = self.chance(0.4) && traits.surge_loop != SurgeLoopKind::Proportional;
        let drawn = if over_ground { SpeedReference::OverGround } else { SpeedReference::ThroughWater };
        let autopilot = SurfaceAutopilot {
            heading: self.heading(&hull, &traits),
            heading_held,
            surge,
            feed_forward,
            speed_held: self.constraints.speed_held.unwrap_or(drawn),
            speed_slew,
            delay_periods: periods(traits.delay),
        };
        (hull, autopilot, traits)
    }

    fn traits(&mut self) -> CraftTraits {
        let constraints = self.constraints;
        let mass = self.log_uniform(MASS[0], MASS[1]);
        let slenderness = self.uniform(0.8, 1.5);
        let heading_lag = self.log_uniform(LAG[0], LAG[1]);
        let surge_lag = self.log_uniform(LAG[0], LAG[1]);
        let acceleration = self.log_uniform(ACCELERATION[0], ACCELERATION[1]);
        let delay = self.uniform(DELAY[0], DELAY[1]);
        let heading_loop = self.one_of(&[
            HeadingLoopKind::ProportionalDerivative,
            HeadingLoopKind::ProportionalIntegralDerivative,
            HeadingLoopKind::ReferenceModel,
            HeadingLoopKind::Cascade,
        ]);
        let surge_loop =
            self.one_of(&[SurgeLoopKind::Proportional, SurgeLoopKind::AntiWindup, SurgeLoopKind::Windup]);
        let mass = constraints.mass.unwrap_or(mass);
        // The Otter's 80 kg are 2 m long, the MEDUSA's 30 kg 1 m.
        let length = 0.4 * slenderness * mass.cbrt();
        CraftTraits {
            mass,
            length,
            heading_loop: constraints.heading_loop.unwrap_or(heading_loop),
            heading_lag: constraints.heading_lag.unwrap_or(heading_lag),
            surge_loop: constraints.surge_loop.unwrap_or(surge_loop),
            surge_lag: constraints.surge_lag.unwrap_or(surge_lag),
            acceleration: constraints.acceleration.unwrap_or(acceleration),
            delay: PERIOD * periods(constraints.delay.unwrap_or(delay)) as f64,
        }
    }

    /// A hull whose thrusters can follow the loops, some only just.
    fn hull(&mut self, traits: &CraftTraits, held: HeadingReference) -> SurfaceHull {
        let CraftTraits { mass, length, .. } = *traits;
        let mass_surge = mass * self.uniform(1.05, 1.7);
        let mass_sway = mass_surge * self.uniform(1.05, 1.8);
        let gyration = length * self.uniform(0.22, 0.3);
        let inertia_yaw = mass * gyration * gyration * self.uniform(1.3, 2.5);

        // Bollard pull per mass, from the least for the acceleration to more than the MEDUSA's.
        let least_pull = (traits.acceleration / 0.6).max(0.15);
        let pull = self.log_uniform(least_pull, least_pull.max(2.0) * 1.25);
        let force = mass_surge * pull;
        let speed_top = self.log_uniform(0.9, (1.5 + 2.0 * pull).min(4.0));
        let linear_share = self.uniform(0.0, 1.0);
        let drag_surge = Drag {
            linear: linear_share * force / speed_top,
            quadratic: (1.0 - linear_share) * force / (speed_top * speed_top),
        };

        let ahead_max = 0.5 * force;
        let astern_max = ahead_max * self.uniform(0.5, 1.0);
        let arm = length * self.uniform(0.1, 0.22);
        let moment = arm * (ahead_max + astern_max);
        // Fastest turn that the yaw drag allows, and the time constant of a slow one.
        let rate_full = self.log_uniform(0.2, 0.9);
        let yaw_time = self.log_uniform(0.6, 3.0);
        let drag_yaw_linear = (inertia_yaw / yaw_time).min(0.6 * moment / rate_full);
        let drag_yaw = Drag {
            linear: drag_yaw_linear,
            quadratic: (moment - drag_yaw_linear * rate_full) / (rate_full * rate_full),
        };

        // A course loop must be slower than the hull's drift.
        let drift_max = match held {
            HeadingReference::Heading => 2.0,
            HeadingReference::Course => (0.5 * traits.heading_lag).clamp(0.25, 2.0),
        };
        let drift_time = self.log_uniform(0.2, drift_max);
        let sway_linear = mass_surge / drift_time;
        let drag_sway = Drag { linear: sway_linear, quadratic: sway_linear * self.uniform(0.0, 2.0) };
        // The Munk moment at half the top speed is at most half the yaw drag: the hull steers.
        let half = 0.5 * speed_top;
        let munk_max = (0.5 * drag_yaw_linear / (drift_time * half * half)).min(mass_sway - mass_surge);
        let coriolis =
            CoriolisMasses { surge: mass_surge, sway: mass_surge + munk_max * self.uniform(0.0, 1.0) };

        let slowest = drag_surge.resistance(0.1);
        let thrusters = Thrusters {
            ahead_max,
            astern_max,
            arm,
            dead_zone: (ahead_max * self.uniform(0.0, 0.008)).min(0.2 * slowest),
            lag: self.log_uniform(0.05, (0.3 * traits.heading_lag).clamp(0.06, 0.4)),
        };
        SurfaceHull {
            mass_surge,
            mass_sway,
            inertia_yaw,
            coriolis,
            drag_surge,
            drag_sway,
            drag_yaw,
            thrusters,
        }
    }

    fn heading(&mut self, hull: &SurfaceHull, traits: &CraftTraits) -> HeadingLoop {
        let lag = traits.heading_lag;
        let moment = hull.thrusters.arm * (hull.thrusters.ahead_max + hull.thrusters.astern_max);
        let rate_full = hull.drag_yaw.speed_against(moment);
        let rate_max = self.log_uniform(0.06, (0.8 * rate_full).max(0.07));
        // About ten times slower than the loop itself, like tuned autopilots.
        let integral_time = lag * self.log_uniform(5.0, 12.0);
        // Loops behind a model or a yaw rate are faster than the whole, slower than thrusters.
        let fastest = 0.4 / hull.thrusters.lag;
        match traits.heading_loop {
            HeadingLoopKind::ProportionalDerivative => {
                let (frequency, damping) = self.second_order(hull, lag);
                HeadingLoop::ProportionalDerivative { frequency, damping }
            }
            HeadingLoopKind::ProportionalIntegralDerivative => {
                let (frequency, damping) = self.second_order(hull, lag);
                HeadingLoop::ProportionalIntegralDerivative { frequency, damping, integral_time }
            }
            HeadingLoopKind::ReferenceModel => {
                let model_damping = self.uniform(0.7, 1.1);
                let model_frequency = 2.0 * model_damping / lag;
                HeadingLoop::ReferenceModel {
                    model_frequency,
                    model_damping,
                    rate_max,
                    frequency: (model_frequency * self.uniform(2.0, 4.0)).min(fastest),
                    integral_time,
                }
            }
            HeadingLoopKind::Cascade => {
                let rate_time_constant = (lag * self.uniform(0.1, 0.3)).max(1.0 / fastest);
                HeadingLoop::Cascade {
                    time_constant: (lag - rate_time_constant).max(0.5 * lag),
                    rate_max,
                    rate_slew: self.log_uniform(0.05, (0.7 * moment / hull.inertia_yaw).clamp(0.06, 1.0)),
                    rate_time_constant,
                    integral_time: rate_time_constant * self.uniform(2.0, 6.0),
                }
            }
        }
    }

    /// Frequency and damping of a proportional-derivative loop that lags a slow turn by `lag`,
    /// 2ζ/ω, and leaves at least the damping of the hull.
    fn second_order(&mut self, hull: &SurfaceHull, lag: f64) -> (f64, f64) {
        let damping = self.uniform(0.6, 1.1);
        let hull_damping = hull.drag_yaw.linear / hull.inertia_yaw;
        let frequency = 2.0 * damping / lag;
        if hull_damping <= 2.0 * damping * frequency {
            return (frequency, damping);
        }
        let frequency = (hull_damping / lag).sqrt();
        (frequency, 0.5 * hull_damping / frequency)
    }

    fn surge(
        &mut self,
        hull: &SurfaceHull,
        traits: &CraftTraits,
    ) -> (SurgeGains, DragFeedForward, Option<SpeedSlew>) {
        let CraftTraits { surge_lag: lag, acceleration, .. } = *traits;
        let proportional = hull.mass_surge / lag;
        let (with_feed_forward, clamped) = (self.chance(0.6), self.chance(0.5));
        let (free_integral, drag_integral) = (self.log_uniform(3.0, 15.0), self.log_uniform(1.5, 6.0));
        let deceleration = acceleration * self.uniform(0.7, 1.4);
        let loop_kind = traits.surge_loop;
        let feed_forward = if loop_kind == SurgeLoopKind::Proportional || with_feed_forward {
            DragFeedForward::On
        } else {
            DragFeedForward::Off
        };
        // Without feed-forward, the integral part compensates the drag: no clamped error.
        let (integral_time, clamped) = match feed_forward {
            DragFeedForward::On => (free_integral, clamped),
            DragFeedForward::Off => (drag_integral, false),
        };
        let integral = match loop_kind {
            SurgeLoopKind::Proportional => 0.0,
            SurgeLoopKind::AntiWindup | SurgeLoopKind::Windup => proportional / integral_time,
        };
        let anti_windup = match loop_kind {
            SurgeLoopKind::Windup => AntiWindup::Off,
            SurgeLoopKind::Proportional | SurgeLoopKind::AntiWindup => AntiWindup::On,
        };
        let gains = |error_max| SurgeGains { proportional, integral, error_max, anti_windup };
        if clamped {
            return (gains(acceleration * lag), feed_forward, None);
        }
        let slew = SpeedSlew { acceleration, deceleration };
        (gains(f64::INFINITY), feed_forward, Some(slew))
    }

    fn uniform(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.rng.random::<f64>()
    }

    fn log_uniform(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.rng.random::<f64>())
    }

    fn chance(&mut self, share: f64) -> bool {
        self.rng.random::<f64>() < share
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        *all.choose(&mut self.rng).expect("never empty")
    }
}

#[expect(clippy::cast_possible_truncation, reason = "rounded and clamped just before")]
fn periods(delay: f64) -> usize {
    (delay / PERIOD).round().clamp(0.0, DELAY_PERIODS_MAX as f64) as usize
}
