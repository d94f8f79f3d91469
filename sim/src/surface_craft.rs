//! The surface craft's hull: surge, sway and yaw under two stern thrusters.

use nalgebra::{SVector, Vector2, Vector3};
use planner::angle::ned_from_body;

/// Resistance of the water to one motion: (d + d₂ |v|) v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Linear coefficient d, N/(m/s) or N m/(rad/s).
    pub linear: f64,
    /// Quadratic coefficient d₂, N/(m/s)² or N m/(rad/s)².
    pub quadratic: f64,
}

impl Drag {
    /// Force or moment that a motion of `velocity` has to overcome; it has the motion's sign. N or N m.
    #[must_use]
    pub fn resistance(&self, velocity: f64) -> f64 {
        (self.linear + self.quadratic * velocity.abs()) * velocity
    }
}

/// A hull with two fixed stern thrusters, side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHull {
    /// Mass with added mass in surge m_u, kg.
    pub mass_surge: f64,
    /// Mass with added mass in sway m_v, kg.
    pub mass_sway: f64,
    /// Moment of inertia in yaw with added inertia m_r, kg m².
    pub inertia_yaw: f64,
    /// Drag in surge.
    pub drag_surge: Drag,
    /// Drag in sway.
    pub drag_sway: Drag,
    /// Drag in yaw.
    pub drag_yaw: Drag,
    /// Largest thrust of one thruster, ahead or astern, N.
    pub thrust_max: f64,
    /// Distance of each thruster from the centre line, m.
    pub thruster_arm: f64,
}

/// State of the surface craft: (north, east, ψ, u, v, r) in m, rad, m/s and rad/s.
///
/// Velocities are through the water, in the body frame; ψ is not wrapped.
pub type SurfaceState = SVector<f64, 6>;

/// What the thrusters do together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceInput {
    /// Thrust ahead τ_u, N.
    pub surge_force: f64,
    /// Moment to starboard τ_r, N m.
    pub yaw_moment: f64,
}

impl SurfaceHull {
    /// A MEDUSA-class craft: 30 kg dry, 1.62 m/s flat out.
    ///
    /// Source: the public parameters of the vehicle's laboratory (IST Lisbon).
    pub const MEDUSA: Self = Self {
        mass_surge: 50.0,
        mass_sway: 60.0,
        inertia_yaw: 4.64,
        drag_surge: Drag {
            linear: 0.0,
            quadratic: 27.5,
        },
        drag_sway: Drag {
            linear: 55.1,
            quadratic: 101.0,
        },
        drag_yaw: Drag {
            linear: 4.14,
            quadratic: 6.23,
        },
        thrust_max: 36.0,
        thruster_arm: 0.15,
    };

    /// Acceleration (u̇, v̇, ṙ) in the body frame, m/s² and rad/s².
    ///
    /// ```text
    /// m_u u̇ = τ_u + m_v v r − D_u(u)
    /// m_v v̇ =     − m_u u r − D_v(v)
    /// m_r ṙ = τ_r + (m_u − m_v) u v − D_r(r)
    /// ```
    /// Source: T. I. Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2011), the
    /// three-degree-of-freedom manoeuvring model; eq. (5) of the paper prints the sway row's Coriolis
    /// term with the other sign, which would create energy.
    #[must_use]
    pub fn acceleration(&self, velocity: &Vector3<f64>, input: SurfaceInput) -> Vector3<f64> {
        let (u, v, r) = (velocity.x, velocity.y, velocity.z);
        let (m_u, m_v, m_r) = (self.mass_surge, self.mass_sway, self.inertia_yaw);
        Vector3::new(
            (input.surge_force + m_v * v * r - self.drag_surge.resistance(u)) / m_u,
            (-m_u * u * r - self.drag_sway.resistance(v)) / m_v,
            (input.yaw_moment + (m_u - m_v) * u * v - self.drag_yaw.resistance(r)) / m_r,
        )
    }

    /// Time derivative of `state` in a current (north, east), m/s.
    ///
    /// The current is constant and without rotation, so it moves the craft and does not push it.
    #[must_use]
    pub fn derivative(
        &self,
        state: &SurfaceState,
        input: SurfaceInput,
        current: &Vector2<f64>,
    ) -> SurfaceState {
        let (psi, velocity) = (state[2], Vector3::new(state[3], state[4], state[5]));
        let over_ground = ned_from_body(psi) * velocity.xy() + current;
        let acceleration = self.acceleration(&velocity, input);
        SurfaceState::new(
            over_ground.x,
            over_ground.y,
            velocity.z,
            acceleration.x,
            acceleration.y,
            acceleration.z,
        )
    }

    /// Kinetic energy of hull and entrained water, J.
    #[must_use]
    pub fn kinetic_energy(&self, velocity: &Vector3<f64>) -> f64 {
        let masses = Vector3::new(self.mass_surge, self.mass_sway, self.inertia_yaw);
        0.5 * velocity.component_mul(velocity).dot(&masses)
    }

    /// What the thrusters give when `wanted` is asked of them.
    ///
    /// The moment is served first: a craft that turns late is off its course, one that accelerates
    /// late is only late.
    #[must_use]
    pub fn saturated(&self, wanted: SurfaceInput) -> SurfaceInput {
        let (f_max, arm) = (self.thrust_max, self.thruster_arm);
        let differential = (wanted.yaw_moment / (2.0 * arm)).clamp(-f_max, f_max);
        let left = f_max - differential.abs();
        let common = (0.5 * wanted.surge_force).clamp(-left, left);
        SurfaceInput {
            surge_force: 2.0 * common,
            yaw_moment: 2.0 * arm * differential,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::rk4;

    const HULL: SurfaceHull = SurfaceHull::MEDUSA;

    fn ahead(surge_force: f64) -> SurfaceInput {
        SurfaceInput {
            surge_force,
            yaw_moment: 0.0,
        }
    }

    #[test]
    fn steady_speeds_follow_from_the_balance_of_thrust_and_drag() {
        for (thrust, published) in [(14.0, 0.714), (15.0, 0.739), (60.0, 1.477)] {
            let calm = Vector2::zeros();
            let end = (0..3000).fold(SurfaceState::zeros(), |state, _| {
                rk4(&state, 0.1, |x| HULL.derivative(x, ahead(thrust), &calm))
            });
            assert!(
                (end[3] - published).abs() < 5e-4,
                "{thrust} N gave {} m/s",
                end[3]
            );
        }
    }

    #[test]
    fn power_goes_to_motion_and_drag_alone() {
        // d/dt ½ νᵀMν = τᵀν − νᵀD(ν): the Coriolis terms do no work, whatever the motion.
        for velocity in [Vector3::new(1.2, -0.3, 0.8), Vector3::new(-0.4, 0.2, -1.1)] {
            let input = SurfaceInput {
                surge_force: 11.0,
                yaw_moment: -2.0,
            };
            let slope = HULL.acceleration(&velocity, input);
            let stored = HULL.mass_surge * velocity.x * slope.x
                + HULL.mass_sway * velocity.y * slope.y
                + HULL.inertia_yaw * velocity.z * slope.z;
            let fed = input.surge_force * velocity.x + input.yaw_moment * velocity.z;
            let lost = HULL.drag_surge.resistance(velocity.x) * velocity.x
                + HULL.drag_sway.resistance(velocity.y) * velocity.y
                + HULL.drag_yaw.resistance(velocity.z) * velocity.z;
            assert!((stored - (fed - lost)).abs() < 1e-12);
        }
    }

    #[test]
    fn thrusters_never_exceed_their_limit_and_turn_first() {
        let full = HULL.saturated(SurfaceInput {
            surge_force: 500.0,
            yaw_moment: 5.4,
        });
        assert!((full.yaw_moment - 5.4).abs() < 1e-12);
        let (port, starboard) = (
            0.5 * full.surge_force + full.yaw_moment / (2.0 * HULL.thruster_arm),
            0.5 * full.surge_force - full.yaw_moment / (2.0 * HULL.thruster_arm),
        );
        assert!((port - 36.0).abs() < 1e-12 && starboard.abs() < 1e-12);
    }

    #[test]
    fn a_tenth_of_a_second_is_a_fine_enough_step() {
        let turn = SurfaceInput {
            surge_force: 40.0,
            yaw_moment: 5.0,
        };
        let calm = Vector2::new(0.1, -0.05);
        let run = |step: f64, n: u32| {
            (0..n).fold(SurfaceState::zeros(), |state, _| {
                rk4(&state, step, |x| HULL.derivative(x, turn, &calm))
            })
        };
        let difference = run(0.1, 300) - run(0.0125, 2400);
        // Measured 2e-6 over the whole state after 30 s of hard turning; a tenth of a millimetre would be no
        // matter for tracking.
        assert!(
            difference.fixed_rows::<2>(0).norm() < 1e-4,
            "{}",
            difference.norm()
        );
    }
}
