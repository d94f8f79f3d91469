//! The underwater vehicle's hull: surge, pitch and yaw.

use nalgebra::{SVector, Vector2};

use super::Drag;

/// Largest pitch reference, rad, either way: 80°, beyond which the heading has no meaning.
pub const PITCH_MAX: f64 = 80.0 / 180.0 * std::f64::consts::PI;

/// Least |cosθ| in heading rates: cos 85°.
///
/// ψ̇ = r / cosθ has a pole at a vertical attitude. Pitch references end at 80°, so only an initial
/// state can be there; its heading rate is at most 11.5 r.
const COSINE_MIN: f64 = 0.087;

/// A hull that moves ahead, pitches and yaws; sway, heave and roll are neglected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderwaterHull {
    /// Mass with added mass in surge m_u, kg.
    pub mass_surge: f64,
    /// Moment of inertia in pitch with added inertia m_q, kg m².
    pub inertia_pitch: f64,
    /// Moment of inertia in yaw with added inertia m_r, kg m².
    pub inertia_yaw: f64,
    /// Drag in surge.
    pub drag_surge: Drag,
    /// Drag in pitch.
    pub drag_pitch: Drag,
    /// Drag in yaw.
    pub drag_yaw: Drag,
    /// Weight times the distance of the centre of gravity below that of buoyancy W·BG, N m.
    pub restoring_moment: f64,
    /// Largest surge force, N.
    pub force_max: f64,
    /// Largest moment in pitch, N m.
    pub pitch_moment_max: f64,
    /// Largest moment in yaw, N m.
    pub yaw_moment_max: f64,
}

/// State of an underwater vehicle: (north, east, z, θ, ψ, u, q, r) in m, rad, m/s and rad/s.
///
/// Depth z is positive down; θ nose-up; u along the body through the water; angles not wrapped.
pub type UnderwaterState = SVector<f64, 8>;

/// Force and moments of the actuators.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnderwaterInput {
    /// Force ahead τ_u, N.
    pub surge_force: f64,
    /// Moment nose-up τ_q, N m.
    pub pitch_moment: f64,
    /// Moment to starboard τ_r, N m.
    pub yaw_moment: f64,
}

impl UnderwaterHull {
    /// A MEDUSA-class AUV: the surface craft's masses and drag, pitch like yaw.
    ///
    /// No public value exists for the restoring moment: 30 kg · 9.81 m/s² · 0.02 m is an
    /// assumption, like the same authority in pitch as in yaw.
    pub const MEDUSA: Self = Self {
        mass_surge: 50.0,
        inertia_pitch: 4.64,
        inertia_yaw: 4.64,
        drag_surge: Drag { linear: 0.0, quadratic: 27.5 },
        drag_pitch: Drag { linear: 4.14, quadratic: 6.23 },
        drag_yaw: Drag { linear: 4.14, quadratic: 6.23 },
        restoring_moment: 30.0 * 9.81 * 0.02,
        force_max: 72.0,
        pitch_moment_max: 10.8,
        yaw_moment_max: 10.8,
    };

    /// A Slocum-class glider of 50 kg, 1.5 m by 0.22 m, pushed and turned like a propelled vehicle.
    ///
    /// The real one sinks and rises; wings turn that into motion ahead, a battery shifts for pitch,
    /// a rudder steers. Here a force along the body and moments replace them; depth follows from
    /// pitch and speed, without the angle of attack (a few degrees).
    ///
    /// Source: the Slocum model of J. G. Graver (*Underwater Gliders: Dynamics, Control and
    /// Design*, Princeton 2005), with the figures of public glider simulators: 50 kg, added mass
    /// 5 kg in surge, inertias 12 and 11 kg m² in pitch and yaw, drag 2.15 N/(m/s)² at no angle of
    /// attack, rotational damping 50 N m/(rad/s)/(m/s)², here at 0.32 m/s: 5.1. Quadratic
    /// rotational drag is the cross-flow of the hull, ½ρ C_d D L⁴/32 = 20 with C_d = 1.1.
    ///
    /// Derived: force, 250 cm³ of ballast pumped, 2.5 N, of which sin 26° along the path, rounded
    /// up to 1.5 N; pitch moment, 9 kg of battery shifted by 5 cm, 4.4 N m. Assumptions: centre of
    /// gravity 5 mm below that of buoyancy; a rudder that turns within a radius of 7 m.
    pub const SLOCUM: Self = Self {
        mass_surge: 55.0,
        inertia_pitch: 12.0,
        inertia_yaw: 11.0,
        drag_surge: Drag { linear: 0.0, quadratic: 2.15 },
        drag_pitch: Drag { linear: 5.1, quadratic: 20.0 },
        drag_yaw: Drag { linear: 5.1, quadratic: 20.0 },
        restoring_moment: 50.0 * 9.81 * 0.005,
        force_max: 1.5,
        pitch_moment_max: 4.4,
        yaw_moment_max: 0.25,
    };

    /// Time derivative of `state` in a horizontal current (north, east), m/s.
    ///
    /// ```text
    /// [ẋ, ẏ] = u cosθ [cosψ, sinψ] + v_c     ż = −u sinθ      θ̇ = q     ψ̇ = r / cosθ
    /// m_u u̇ = τ_u − D_u(u)     m_q q̇ = τ_q − D_q(q) − W·BG sinθ     m_r ṙ = τ_r − D_r(r)
    /// ```
    /// Source: eqs. (3) and (6) of the paper without sway. (3) has east and depth added, and
    /// another ψ̇ than r: a pitched vehicle's yaw axis is not vertical. The restoring term is a
    /// moment. Within 5° of the vertical, ψ̇ is that at 85°: finite states have finite derivatives.
    pub fn derivative(
        &self,
        state: &UnderwaterState,
        input: UnderwaterInput,
        current: &Vector2<f64>,
    ) -> UnderwaterState {
        let (u, q, r) = (state[5], state[6], state[7]);
        let (sin_theta, cos_theta) = state[3].sin_cos();
        let (sin_psi, cos_psi) = state[4].sin_cos();
        let u_h = u * cos_theta;
        UnderwaterState::from([
            u_h * cos_psi + current.x,
            u_h * sin_psi + current.y,
            -u * sin_theta,
            q,
            r / off_the_pole(cos_theta),
            (input.surge_force - self.drag_surge.resistance(u)) / self.mass_surge,
            (input.pitch_moment - self.drag_pitch.resistance(q) - self.restoring_moment * sin_theta)
                / self.inertia_pitch,
            (input.yaw_moment - self.drag_yaw.resistance(r)) / self.inertia_yaw,
        ])
    }

    /// The forces of the actuators for the command `wanted`.
    pub fn saturated(&self, wanted: UnderwaterInput) -> UnderwaterInput {
        UnderwaterInput {
            surge_force: wanted.surge_force.clamp(-self.force_max, self.force_max),
            pitch_moment: wanted.pitch_moment.clamp(-self.pitch_moment_max, self.pitch_moment_max),
            yaw_moment: wanted.yaw_moment.clamp(-self.yaw_moment_max, self.yaw_moment_max),
        }
    }
}

/// Heading rate ψ̇ = r / cosθ, rad/s, at this pitch, rad, and body yaw rate, rad/s; bounded near
/// the vertical as in [`UnderwaterHull::derivative`].
pub fn heading_rate(pitch: f64, yaw_rate: f64) -> f64 {
    yaw_rate / off_the_pole(pitch.cos())
}

fn off_the_pole(cos_theta: f64) -> f64 {
    cos_theta.abs().max(COSINE_MIN).copysign(cos_theta)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;

    const HULL: UnderwaterHull = UnderwaterHull::MEDUSA;

    #[test]
    fn kinematics_agree_with_the_rotation_matrix() {
        // Second route: the attitude matrix moves with Ṙ = R S(ω), and carries [u, 0, 0] to NED.
        let (theta, psi, u, q, r) = (-0.87, 2.1, 0.3, 0.2, 0.15);
        let state = UnderwaterState::from([0.0, 0.0, 5.0, theta, psi, u, q, r]);
        let slope = HULL.derivative(&state, UnderwaterInput::default(), &Vector2::zeros());
        // Without roll, the body's roll rate must keep φ at zero: p = −r tanθ.
        let p = -r * theta.tan();
        let attitude = |theta: f64, psi: f64| Rotation3::from_euler_angles(0.0, theta, psi).into_inner();
        let spin = Matrix3::new(0.0, -r, q, r, 0.0, -p, -q, p, 0.0);
        let h = 1e-6;
        let turned = attitude(theta + h * slope[3], psi + h * slope[4]);
        let finite = (turned - attitude(theta, psi)) / h;
        assert!((finite - attitude(theta, psi) * spin).norm() < 1e-5);
        let over_ground = attitude(theta, psi) * Vector3::new(u, 0.0, 0.0);
        assert!((slope.fixed_rows::<3>(0) - over_ground).norm() < 1e-12);
    }
}
