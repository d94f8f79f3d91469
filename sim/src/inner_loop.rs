//! The vehicles' inner loops: from references to forces and moments, ten times a second.

use planner::angle::wrap;

use crate::{
    surface_craft::{SurfaceHull, SurfaceInput, SurfaceState},
    underwater_vehicle::{UnderwaterHull, UnderwaterInput, UnderwaterState},
};
use planner::los::Reference;

/// Period of every inner loop, s. Also the integration step: inputs are held for exactly one step.
pub const PERIOD: f64 = 0.1;

/// Proportional gain of the surge loop, N/(m/s). Source: the laboratory's vehicles.
const SURGE_PROPORTIONAL: f64 = 26.0;
/// Integral gain of the surge loop, N/m. Source: as above.
const SURGE_INTEGRAL: f64 = 3.0;
/// Largest speed error that the surge loop acts on, m/s. Source: as above.
const SURGE_ERROR_MAX: f64 = 0.2;
/// Natural frequency of the surface craft's yaw loop, rad/s. Source: as above.
const YAW_FREQUENCY: f64 = 1.6;
/// Damping ratio of the surface craft's yaw loop. Source: as above.
const YAW_DAMPING: f64 = 0.8;
/// Natural frequency of the pitch loop, rad/s: a reversal from −50° to +50° comes within 5 % in 4 s.
const PITCH_FREQUENCY: f64 = 1.2;
/// Damping ratio of the pitch loop.
const PITCH_DAMPING: f64 = 0.8;
/// Bandwidth of the underwater yaw-rate loop, rad/s: ten times that of the path following above it,
/// and a third of what a loop of ten hertz allows.
const YAW_RATE_BANDWIDTH: f64 = 3.0;

/// Whether the surge loop adds the drag at the measured speed to its output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragFeedForward {
    /// Proportional and integral part alone, as on the laboratory's vehicles: large steps wait for
    /// the integral part.
    Off,
    /// Drag is made up for at once; the loop sees a free mass.
    On,
}

/// A surge loop's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurgeLoop {
    feed_forward: DragFeedForward,
    /// Integral part, N.
    integral: f64,
}

impl SurgeLoop {
    /// A loop that already holds `speed`, m/s, in steady state on a hull of that drag.
    #[must_use]
    pub fn settled_at(
        speed: f64,
        feed_forward: DragFeedForward,
        hull_drag: crate::surface_craft::Drag,
    ) -> Self {
        let integral = match feed_forward {
            DragFeedForward::Off => hull_drag.resistance(speed),
            DragFeedForward::On => 0.0,
        };
        Self {
            feed_forward,
            integral,
        }
    }

    /// Force wanted, N, for a speed reference and a measured speed, m/s.
    ///
    /// ```text
    /// ε = clamp(u_ref − u, ±0.2)      τ_u = 26 ε + 3 ∫ε dt  (+ D_u(u))
    /// ```
    fn force(&self, reference: f64, measured: f64, drag: crate::surface_craft::Drag) -> f64 {
        let error = clamped_error(reference, measured);
        let feed_forward = match self.feed_forward {
            DragFeedForward::Off => 0.0,
            DragFeedForward::On => drag.resistance(measured),
        };
        SURGE_PROPORTIONAL * error + self.integral + feed_forward
    }

    /// Integrates the error, unless the actuators gave less than was `wanted` in the error's direction.
    fn integrate(&mut self, reference: f64, measured: f64, wanted: f64, given: f64) {
        let error = clamped_error(reference, measured);
        if (wanted - given) * error <= 0.0 {
            self.integral += SURGE_INTEGRAL * error * PERIOD;
        }
    }
}

fn clamped_error(reference: f64, measured: f64) -> f64 {
    (reference - measured).clamp(-SURGE_ERROR_MAX, SURGE_ERROR_MAX)
}

/// One period of the surface craft's loops.
///
/// Yaw is proportional-derivative on the heading error, the hull's linear yaw drag counted as part
/// of the damping.
#[must_use]
pub fn steer_surface_craft(
    hull: &SurfaceHull,
    surge: &mut SurgeLoop,
    state: &SurfaceState,
    reference: &Reference,
) -> SurfaceInput {
    let (psi, u, r) = (state[2], state[3], state[5]);
    let damping = 2.0 * YAW_DAMPING * YAW_FREQUENCY * hull.inertia_yaw - hull.drag_yaw.linear;
    let wanted = SurfaceInput {
        surge_force: surge.force(reference.speed, u, hull.drag_surge),
        yaw_moment: hull.inertia_yaw * YAW_FREQUENCY.powi(2) * wrap(reference.heading.radians() - psi)
            - damping * r,
    };
    let given = hull.saturated(wanted);
    surge.integrate(reference.speed, u, wanted.surge_force, given.surge_force);
    given
}

/// What the path follower and the dive ask of an underwater vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderwaterReference {
    /// Speed along the body, through the water, m/s.
    pub surge: f64,
    /// Pitch θ, rad, positive nose-up.
    pub pitch: f64,
    /// Body yaw rate r, rad/s, positive to starboard. A heading rate ψ̇ asks for r = ψ̇ cosθ.
    pub yaw_rate: f64,
}

/// One period of an underwater vehicle's loops.
///
/// Pitch is proportional-derivative with the restoring moment made up for; yaw rate is proportional
/// with the drag at the reference fed forward, so that a steady turn has no error.
#[must_use]
pub fn steer_underwater_vehicle(
    hull: &UnderwaterHull,
    surge: &mut SurgeLoop,
    state: &UnderwaterState,
    reference: &UnderwaterReference,
) -> UnderwaterInput {
    let (theta, u, q, r) = (state[3], state[5], state[6], state[7]);
    let pitch_damping = 2.0 * PITCH_DAMPING * PITCH_FREQUENCY * hull.inertia_pitch - hull.drag_pitch.linear;
    let wanted = UnderwaterInput {
        surge_force: surge.force(reference.surge, u, hull.drag_surge),
        pitch_moment: hull.inertia_pitch * PITCH_FREQUENCY.powi(2) * (reference.pitch - theta)
            - pitch_damping * q
            + hull.restoring_moment * theta.sin(),
        yaw_moment: hull.inertia_yaw * YAW_RATE_BANDWIDTH * (reference.yaw_rate - r)
            + hull.drag_yaw.resistance(reference.yaw_rate),
    };
    let given = hull.saturated(wanted);
    surge.integrate(reference.surge, u, wanted.surge_force, given.surge_force);
    given
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use planner::angle::Heading;

    use super::*;
    use crate::integrate::rk4;

    const HULL: SurfaceHull = SurfaceHull::MEDUSA;

    /// States at every period for 60 s after `reference` is given to a craft that goes straight north.
    fn response(from: f64, speed: f64, heading: f64, mode: DragFeedForward) -> Vec<SurfaceState> {
        let mut surge = SurgeLoop::settled_at(from, mode, HULL.drag_surge);
        let mut state = SurfaceState::zeros();
        state[3] = from;
        let reference = Reference {
            speed,
            heading: Heading::new(heading),
        };
        (0..1200)
            .map(|_| {
                let input = steer_surface_craft(&HULL, &mut surge, &state, &reference);
                let before = state;
                state = rk4(&state, PERIOD, |x| HULL.derivative(x, input, &Vector2::zeros()));
                before
            })
            .collect()
    }

    fn time_to_63_percent(from: f64, to: f64, mode: DragFeedForward) -> f64 {
        let level = from + 0.632 * (to - from);
        let states = response(from, to, 0.0, mode);
        let i = states
            .iter()
            .position(|state| (state[3] - level) * (to - from).signum() >= 0.0);
        PERIOD * f64::from(u32::try_from(i.expect("the loop gets there")).expect("few"))
    }

    #[test]
    fn surge_is_slow_without_drag_feed_forward_and_fast_with_it() {
        for (from, to, mode, measured_at_sea) in [
            (0.3, 0.7, DragFeedForward::Off, 4.9),
            (0.3, 1.5, DragFeedForward::Off, 39.0),
            (0.3, 0.7, DragFeedForward::On, 2.3),
            (0.3, 1.5, DragFeedForward::On, 5.7),
        ] {
            let time = time_to_63_percent(from, to, mode);
            println!("surge {from} -> {to} {mode:?}: {time:.1} s");
            assert!(
                (time / measured_at_sea - 1.0).abs() < 0.15,
                "{from} to {to} {mode:?}: {time} s"
            );
        }
    }

    #[test]
    fn a_right_angle_of_yaw_settles_in_about_three_seconds() {
        let goal = std::f64::consts::FRAC_PI_2;
        let states = response(0.3, 0.3, goal, DragFeedForward::Off);
        let last_outside = states
            .iter()
            .rposition(|state| (state[2] - goal).abs() > 0.05 * goal);
        let settled =
            PERIOD * f64::from(u32::try_from(last_outside.expect("starts outside") + 1).expect("few"));
        println!("yaw settles in {settled:.1} s");
        assert!((settled / 3.1 - 1.0).abs() < 0.15, "{settled} s");
    }

    #[test]
    fn a_saturated_surge_loop_does_not_wind_up() {
        // 5 m/s is out of reach: two minutes of asking for it must not be stored.
        let states = response(0.3, 5.0, 0.0, DragFeedForward::On);
        let flat_out = states.last().expect("some")[3];
        assert!((flat_out - (72.0_f64 / 27.5).sqrt()).abs() < 1e-2, "{flat_out}");
        let mut surge = SurgeLoop::settled_at(0.3, DragFeedForward::On, HULL.drag_surge);
        let mut state = *states.last().expect("some");
        for _ in 0..1200 {
            let _ = steer_surface_craft(
                &HULL,
                &mut surge,
                &state,
                &Reference {
                    speed: 5.0,
                    heading: Heading::new(0.0),
                },
            );
        }
        let slower = Reference {
            speed: 1.0,
            heading: Heading::new(0.0),
        };
        for _ in 0..150 {
            let input = steer_surface_craft(&HULL, &mut surge, &state, &slower);
            state = rk4(&state, PERIOD, |x| HULL.derivative(x, input, &Vector2::zeros()));
        }
        assert!((state[3] - 1.0).abs() < 0.1, "{}", state[3]);
    }

    #[test]
    fn a_pitch_reversal_takes_about_four_seconds() {
        let hull = UnderwaterHull::MEDUSA;
        let fifty = 50_f64.to_radians();
        let mut surge = SurgeLoop::settled_at(0.3, DragFeedForward::Off, hull.drag_surge);
        let mut state = UnderwaterState::from([0.0, 0.0, 23.0, -fifty, 0.0, 0.3, 0.0, 0.0]);
        let reference = UnderwaterReference {
            surge: 0.3,
            pitch: fifty,
            yaw_rate: 0.0,
        };
        let mut settled = 0.0;
        let mut largest: f64 = 0.0;
        for k in 0..200_u32 {
            let input = steer_underwater_vehicle(&hull, &mut surge, &state, &reference);
            state = rk4(&state, PERIOD, |x| hull.derivative(x, input, &Vector2::zeros()));
            largest = largest.max(state[3]);
            if (state[3] - fifty).abs() > 0.05 * 2.0 * fifty {
                settled = PERIOD * f64::from(k + 1);
            }
        }
        println!(
            "pitch reversal {settled:.1} s, overshoot to {:.2} deg",
            largest.to_degrees()
        );
        assert!((settled / 4.0 - 1.0).abs() < 0.15, "{settled} s");
        assert!(largest.to_degrees() < 52.0);
    }
}
