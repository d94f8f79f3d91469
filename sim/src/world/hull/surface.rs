//! The surface craft's hull: surge, sway and yaw under two stern thrusters.

use nalgebra::{SVector, Vector2, Vector3};
use planner::{angle::ned_from_body, snapshot::Limits};

use super::Drag;

mod otter;
mod thrusters;

pub use thrusters::{Thrust, ThrusterHealth, Thrusters};

/// Masses in the Coriolis terms, kg.
///
/// With added mass they are m_u and m_v, whose difference makes the Munk moment (c_u − c_v) u v.
/// Otherwise both are the dry mass. Neither choice does work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoriolisMasses {
    /// In surge c_u, kg.
    pub surge: f64,
    /// In sway c_v, kg.
    pub sway: f64,
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
    /// Masses of the Coriolis terms.
    pub coriolis: CoriolisMasses,
    /// Drag in surge.
    pub drag_surge: Drag,
    /// Drag in sway.
    pub drag_sway: Drag,
    /// Drag in yaw.
    pub drag_yaw: Drag,
    /// Its thrusters.
    pub thrusters: Thrusters,
}

/// State of the surface craft (north, east, ψ, u, v, r, T_port, T_starboard) in m, rad, s and N.
///
/// Velocities are through the water, in the body frame; ψ is not wrapped; thrust is positive ahead.
pub type SurfaceState = SVector<f64, 8>;

/// A force ahead and a moment to starboard, of both thrusters or of the waves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceInput {
    /// Force ahead τ_u, N.
    pub surge_force: f64,
    /// Moment to starboard τ_r, N m.
    pub yaw_moment: f64,
}

impl SurfaceHull {
    /// A MEDUSA-class craft: 30 kg dry, 1.62 m/s flat out.
    ///
    /// Source: the public parameters of the vehicle's laboratory (IST Lisbon). No public value
    /// exists for dead zone and lag of the thrusters: 0.2 N and 0.1 s are assumptions, to which a
    /// heading step is not sensitive (docs/rationale.md#sim-thruster-lag).
    pub const MEDUSA: Self = Self {
        mass_surge: 50.0,
        mass_sway: 60.0,
        inertia_yaw: 4.64,
        coriolis: CoriolisMasses { surge: 50.0, sway: 60.0 },
        drag_surge: Drag { linear: 0.0, quadratic: 27.5 },
        drag_sway: Drag { linear: 55.1, quadratic: 101.0 },
        drag_yaw: Drag { linear: 4.14, quadratic: 6.23 },
        thrusters: Thrusters { ahead_max: 36.0, astern_max: 36.0, arm: 0.15, dead_zone: 0.2, lag: 0.1 },
    };

    /// The craft at a steady `speed` through the water, m/s, on a straight course with thrust in
    /// balance with drag. Position (north, east), m; heading ψ, rad.
    pub fn cruising(&self, position: &Vector2<f64>, heading: f64, speed: f64) -> SurfaceState {
        let thrust = 0.5 * self.drag_surge.resistance(speed);
        SurfaceState::from([position.x, position.y, heading, speed, 0.0, 0.0, thrust, thrust])
    }

    /// Top speed through the water, straight ahead, m/s.
    pub fn speed_top(&self) -> f64 {
        self.drag_surge.speed_against(2.0 * self.thrusters.ahead_max)
    }

    /// Slowest useful speed reference, m/s, with the thrusters well out of their dead zone.
    pub fn speed_least(&self) -> f64 {
        let margin = 2.0;
        let out_of_dead_zone = self.drag_surge.speed_against(margin * 2.0 * self.thrusters.dead_zone);
        out_of_dead_zone.max(Limits::MEDUSA.speed_min)
    }

    /// Acceleration (u̇, v̇, ṙ) in the body frame, m/s² and rad/s².
    ///
    /// ```text
    /// m_u u̇ = τ_u + c_v v r − D_u(u)
    /// m_v v̇ =     − c_u u r − D_v(v)
    /// m_r ṙ = τ_r + (c_u − c_v) u v − D_r(r)
    /// ```
    /// Source: T. I. Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2011),
    /// three-degree-of-freedom manoeuvring model. Eq. (5) of the paper has the other sign in the
    /// sway row's Coriolis term, which would create energy.
    pub fn acceleration(&self, velocity: &Vector3<f64>, input: SurfaceInput) -> Vector3<f64> {
        let (u, v, r) = (velocity.x, velocity.y, velocity.z);
        let (c_u, c_v) = (self.coriolis.surge, self.coriolis.sway);
        Vector3::new(
            (input.surge_force + c_v * v * r - self.drag_surge.resistance(u)) / self.mass_surge,
            (-c_u * u * r - self.drag_sway.resistance(v)) / self.mass_sway,
            (input.yaw_moment + (c_u - c_v) * u * v - self.drag_yaw.resistance(r)) / self.inertia_yaw,
        )
    }

    /// Time derivative of `state`.
    ///
    /// `steady` is the thrust that the thrusters approach, N, from [`Thrusters::steady`].
    /// `disturbance` comes from the waves. `current` (north, east), m/s, is constant and without
    /// rotation: it moves the craft and does not push it.
    pub fn derivative(
        &self,
        state: &SurfaceState,
        steady: Thrust,
        disturbance: SurfaceInput,
        current: &Vector2<f64>,
    ) -> SurfaceState {
        let velocity = Vector3::new(state[3], state[4], state[5]);
        let over_ground = ned_from_body(state[2]) * velocity.xy() + current;
        let propulsion = self.thrusters.force(Thrust { port: state[6], starboard: state[7] });
        let acceleration = self.acceleration(
            &velocity,
            SurfaceInput {
                surge_force: propulsion.surge_force + disturbance.surge_force,
                yaw_moment: propulsion.yaw_moment + disturbance.yaw_moment,
            },
        );
        let lag = self.thrusters.lag;
        SurfaceState::from([
            over_ground.x,
            over_ground.y,
            velocity.z,
            acceleration.x,
            acceleration.y,
            acceleration.z,
            (steady.port - state[6]) / lag,
            (steady.starboard - state[7]) / lag,
        ])
    }

    /// Power that the thrusters draw, W, never negative: thrust times the speed of the hull at the
    /// thruster, each by its size, because a braking propeller returns nothing.
    ///
    /// ```text
    /// |T_port (u + a r)| + |T_starboard (u − a r)|
    /// ```
    /// Losses of propeller and motor are omitted, for want of a public value.
    pub fn propulsion_power(&self, state: &SurfaceState) -> f64 {
        let (u, swing) = (state[3], self.thrusters.arm * state[5]);
        (state[6] * (u + swing)).abs() + (state[7] * (u - swing)).abs()
    }
}
