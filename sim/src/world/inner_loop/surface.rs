//! The surface craft's loops: speed and heading to thrust.

use nalgebra::Vector2;
use planner::{
    angle::{Heading, direction, ned_from_body},
    craft::{HeadingReference, SpeedReference},
    los::Reference,
};

use super::{AntiWindup, DragFeedForward, PERIOD, SurgeGains, SurgeLoop};
use crate::world::hull::{Drag, SurfaceHull, SurfaceInput, SurfaceState, Thrust};

mod delay;
mod heading;

use delay::CommandDelay;
pub use delay::DELAY_PERIODS_MAX;
pub use heading::HeadingLoop;
use heading::HeadingMemory;

/// Speed over ground below which a course is noise, m/s. Assumption: twice the error of GNSS.
const COURSE_SPEED_MIN: f64 = 0.1;

/// A surface craft's inner loops as data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAutopilot {
    /// The heading loop.
    pub heading: HeadingLoop,
    /// Angle that the heading loop holds.
    pub heading_held: HeadingReference,
    /// Gains of the surge loop.
    pub surge: SurgeGains,
    /// Mode of the surge loop.
    pub feed_forward: DragFeedForward,
    /// Speed that the surge loop holds.
    pub speed_held: SpeedReference,
    /// Slew-rate limit of the speed reference; unlimited if none.
    pub speed_slew: Option<SpeedSlew>,
    /// Periods until a reference reaches the loops, at most [`DELAY_PERIODS_MAX`].
    pub delay_periods: usize,
}

/// Slew-rate limit of a speed reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedSlew {
    /// Upwards, m/s².
    pub acceleration: f64,
    /// Downwards, m/s², positive.
    pub deceleration: f64,
}

/// State of the autopilot from one period to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct AutopilotMemory {
    surge: SurgeLoop,
    heading: HeadingMemory,
    delay: CommandDelay,
    /// Speed reference behind the slew-rate limit, m/s.
    speed: f64,
}

impl AutopilotMemory {
    /// State of loops settled at `speed`, m/s, and `heading`, rad, on a hull with this surge drag.
    pub fn settled_at(autopilot: &SurfaceAutopilot, drag_surge: Drag, speed: f64, heading: f64) -> Self {
        Self {
            surge: SurgeLoop::settled_at(speed, autopilot.feed_forward, drag_surge),
            heading: HeadingMemory::settled_at(heading),
            delay: CommandDelay::holding(Reference { speed, heading: Heading::new(heading) }),
            speed,
        }
    }
}

impl SurfaceAutopilot {
    /// The MEDUSA class's, without drag feed-forward. Source: IST Lisbon's vehicles.
    pub const MEDUSA: Self = Self {
        heading: HeadingLoop::ProportionalDerivative { frequency: 1.6, damping: 0.8 },
        heading_held: HeadingReference::Heading,
        surge: SurgeGains { proportional: 26.0, integral: 3.0, error_max: 0.2, anti_windup: AntiWindup::On },
        feed_forward: DragFeedForward::Off,
        speed_held: SpeedReference::ThroughWater,
        speed_slew: None,
        delay_periods: 0,
    };

    /// The Otter's: the MEDUSA's, scaled.
    ///
    /// Surge gains grow with m_u (85.5 to 50 kg), which keeps k_p/m_u = 0.52 rad/s and k_i/k_p. The
    /// error's clamp doubles like the top speed: 18 of 239 N remain for acceleration, 5 of 72 for
    /// the MEDUSA. Yaw moments scale with inertia, so ωn and ζ carry over: the moment saturates
    /// from 40° of error on (74 of 106 N m/rad), the MEDUSA's from 52° on.
    pub const OTTER: Self = Self {
        surge: SurgeGains { proportional: 44.5, integral: 5.1, error_max: 0.4, anti_windup: AntiWindup::On },
        ..Self::MEDUSA
    };

    /// The commands to the thrusters for one period in a `current` (north, east), m/s.
    ///
    /// ```text
    /// τ_u = k_p ε + k_i ∫ε dt (+ D_u(u))      τ_r by the heading loop
    /// ```
    /// u is the speed that the loop holds, also in the drag: a craft that only measures its
    /// speed over ground feeds forward the drag in still water.
    pub fn command(
        &self,
        hull: &SurfaceHull,
        memory: &mut AutopilotMemory,
        state: &SurfaceState,
        current: &Vector2<f64>,
        reference: &Reference,
    ) -> Thrust {
        let reference = memory.delay.pass(*reference, self.delay_periods);
        let over_ground = ned_from_body(state[2]) * Vector2::new(state[3], state[4]) + current;
        let (u, psi) = self.held(state, &over_ground);
        memory.speed = self.slewed(memory.speed, reference.speed);
        let wanted = SurfaceInput {
            surge_force: memory.surge.force(&self.surge, memory.speed, u)
                + self.feed_forward.force(u, &hull.drag_surge),
            yaw_moment: self.heading.moment(hull, &mut memory.heading, psi, state[5], reference.heading),
        };
        let command = hull.thrusters.allocate(wanted);
        let given = hull.thrusters.force(command);
        memory.surge.integrate(&self.surge, memory.speed, u, wanted.surge_force, given.surge_force);
        memory.heading.integrate(wanted.yaw_moment, given.yaw_moment);
        command
    }

    /// The speed, m/s, and the angle, rad, that the loops hold.
    fn held(&self, state: &SurfaceState, over_ground: &Vector2<f64>) -> (f64, f64) {
        let speed = match self.speed_held {
            SpeedReference::ThroughWater => state[3],
            SpeedReference::OverGround => over_ground.dot(&direction(state[2])),
        };
        let angle = match self.heading_held {
            HeadingReference::Course if COURSE_SPEED_MIN <= over_ground.norm() => {
                over_ground.y.atan2(over_ground.x)
            }
            HeadingReference::Course | HeadingReference::Heading => state[2],
        };
        (speed, angle)
    }

    fn slewed(&self, before: f64, asked: f64) -> f64 {
        match self.speed_slew {
            None => asked,
            Some(slew) => {
                asked.clamp(before - slew.deceleration * PERIOD, before + slew.acceleration * PERIOD)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

    fn at(u: f64, r: f64) -> SurfaceState {
        SurfaceState::from([0.0, 0.0, 0.0, u, 0.0, r, 0.0, 0.0])
    }

    #[test]
    fn a_moment_with_enough_thrust_left_never_stops_the_surge_loop() {
        // The moment is split over both thrusters and the force added up again: the rounding error
        // of that is no saturation.
        let (autopilot, hull) = (SurfaceAutopilot::MEDUSA, SurfaceHull::MEDUSA);
        for k in 0..1000 {
            let reference = Reference {
                speed: 0.3 + 0.0001 * f64::from(k % 7 - 3),
                heading: Heading::new(0.001 * f64::from(k % 100)),
            };
            let settled = AutopilotMemory::settled_at(&autopilot, hull.drag_surge, 0.3, 0.0);
            let mut memory = settled.clone();
            let state = at(0.3, 0.0007 * f64::from(k));
            let _ = autopilot.command(&hull, &mut memory, &state, &STILL, &reference);
            assert!(reference.speed == 0.3 || memory.surge != settled.surge, "period {k}");
        }
    }

    #[test]
    fn a_delayed_reference_acts_after_its_delay() {
        let hull = SurfaceHull::MEDUSA;
        let asked = Reference { speed: 0.5, heading: Heading::new(0.2) };
        for delay_periods in [0, 1, 7, DELAY_PERIODS_MAX] {
            let autopilot = SurfaceAutopilot { delay_periods, ..SurfaceAutopilot::MEDUSA };
            let mut memory = AutopilotMemory::settled_at(&autopilot, hull.drag_surge, 0.3, 0.0);
            let mut turns = || autopilot.command(&hull, &mut memory, &at(0.3, 0.0), &STILL, &asked);
            let waited = (0..).take_while(|_| {
                let thrust = turns();
                (thrust.port - thrust.starboard).abs() < 1e-9
            });
            assert_eq!(waited.count(), delay_periods);
        }
    }

    #[test]
    fn an_over_ground_loop_compensates_an_unknown_current() {
        let autopilot = SurfaceAutopilot {
            speed_held: SpeedReference::OverGround,
            heading_held: HeadingReference::Course,
            ..SurfaceAutopilot::MEDUSA
        };
        // By hand: 0.3 m/s to the north through water that flows east at 0.4 m/s.
        let (speed, angle) = autopilot.held(&at(0.3, 0.0), &Vector2::new(0.3, 0.4));
        assert!((speed - 0.3).abs() < 1e-12);
        assert!((angle - (4.0_f64 / 3.0).atan()).abs() < 1e-12);
        let (_, adrift) = autopilot.held(&at(0.3, 0.0), &Vector2::new(0.05, 0.05));
        assert_eq!(adrift, 0.0);
    }
}
