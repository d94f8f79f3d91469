//! Path following by stabilising the position error in the path's own frame.
//!
//! Source: L. Lapierre, D. Soetanto, A. Pascoal, *Nonlinear path following with applications to the
//! control of autonomous underwater vehicles*, CDC 2003; eqs. (9)–(31) of the paper, corrected as
//! `docs/rationale.md#corrections-of-the-source-paper` lists.

use nalgebra::Vector2;
use planner::{
    angle::{ned_from_body, sinc, wrap},
    path::PathPoint,
};

/// Gains of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFollowingGains {
    /// Heading gain k₁, 1/s.
    pub k_1: f64,
    /// Weight of the heading error against the position error k₂, 1/m².
    pub k_2: f64,
    /// Gain of the point on the path k₃, 1/s.
    pub k_3: f64,
    /// Largest approach angle `θ_a`, rad.
    pub theta_a: f64,
    /// Growth of the approach angle with the cross-track error `k_δ`, 1/m.
    pub k_delta: f64,
}

impl PathFollowingGains {
    /// The public gains of the paper's laboratory (IST Lisbon).
    pub const LAB: Self = Self { k_1: 1.0, k_2: 0.3, k_3: 0.3, theta_a: 0.8, k_delta: 1.0 };

    /// Approach angle δ, rad: the heading relative to the tangent that leads back to the path.
    ///
    /// ```text
    /// δ(y₁) = −θ_a tanh(k_δ y₁)
    /// ```
    /// δ(0) = 0 and y₁ u sin δ ≤ 0, which the proof needs.
    pub fn approach_angle(&self, cross_track: f64) -> f64 {
        -self.theta_a * (self.k_delta * cross_track).tanh()
    }

    /// dδ/dy₁, rad/m.
    pub fn approach_slope(&self, cross_track: f64) -> f64 {
        -self.theta_a * self.k_delta / (self.k_delta * cross_track).cosh().powi(2)
    }
}

/// A vehicle's deviation from a point of its path, in the path's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathError {
    /// Along-track s₁, m, positive ahead of the point.
    pub s_1: f64,
    /// Cross-track y₁, m, positive to starboard of the path.
    pub y_1: f64,
    /// Heading less the tangent angle `ψ_e`, rad, in (−π, π].
    pub psi_e: f64,
}

impl PathError {
    /// The deviation of a vehicle at `position` (north, east) with heading `psi`.
    pub fn new(position: &Vector2<f64>, psi: f64, point: &PathPoint) -> Self {
        let error = ned_from_body(point.tangent).transpose() * (position - point.position);
        Self { s_1: error.x, y_1: error.y, psi_e: wrap(psi - point.tangent) }
    }
}

/// The command of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathCommand {
    /// Speed of the point along the path `u_P`, m/s.
    pub point_speed: f64,
    /// Heading rate ψ̇, rad/s. Not the body's yaw rate: that is ψ̇ cosθ.
    pub heading_rate: f64,
}

/// The law, for a vehicle of horizontal speed `u_h` = u cosθ through the water, m/s.
///
/// ```text
/// δ   = −θ_a tanh(k_δ y₁)             ψ̃ = ψ_e − δ
/// u_P = u_h cosψ_e + k₃ s₁
/// ψ̇   = κ u_P + δ̇ − k₁ ψ̃ − k₂ y₁ u_h (sinψ_e − sinδ) / ψ̃
/// δ̇   = δ′(y₁) (−κ u_P s₁ + u_h sinψ_e)
/// ```
/// δ̇ omits the current, which the vehicle does not know. A cross current therefore leaves a steady
/// offset, little larger than with the current in δ̇ (docs/rationale.md#sim-path-offset).
pub fn follow_path(error: &PathError, curvature: f64, u_h: f64, gains: &PathFollowingGains) -> PathCommand {
    let PathError { s_1, y_1, psi_e } = *error;
    let delta = gains.approach_angle(y_1);
    let u_p = u_h * psi_e.cos() + gains.k_3 * s_1;
    let delta_rate = gains.approach_slope(y_1) * (-curvature * u_p * s_1 + u_h * psi_e.sin());
    let heading_rate = curvature * u_p + delta_rate
        - gains.k_1 * (psi_e - delta)
        - gains.k_2 * y_1 * u_h * sine_quotient(psi_e, delta);
    PathCommand { point_speed: u_p, heading_rate }
}

/// (sin a − sin b) / (a − b) = cos((a + b)/2) sinc((a − b)/2), regular where a = b.
pub fn sine_quotient(a: f64, b: f64) -> f64 {
    (0.5 * (a + b)).cos() * sinc(0.5 * (a - b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::near;

    #[test]
    fn the_sine_quotient_is_the_cosine_at_equal_angles() {
        for (a, b) in [(0.3, -0.9), (2.0, 1.0), (-0.4, 0.1)] {
            near(sine_quotient(a, b), (f64::sin(a) - f64::sin(b)) / (a - b), 1e-14);
        }
        near(sine_quotient(0.7, 0.7), 0.7_f64.cos(), 1e-15);
        // The values join on either side of the switch inside sinc.
        let found = sine_quotient(0.7, 0.7 + 2.01e-4);
        near(found, sine_quotient(0.7, 0.7 + 1.99e-4), 1e-6);
    }

    #[test]
    fn the_approach_angle_leads_back_to_the_path() {
        let gains = PathFollowingGains::LAB;
        assert_eq!(gains.approach_angle(0.0), 0.0);
        for y_1 in [-20.0, -0.5, 0.01, 3.0] {
            assert!(y_1 * gains.approach_angle(y_1).sin() < 0.0);
            let h = 1e-5;
            let slope = (gains.approach_angle(y_1 + h) - gains.approach_angle(y_1 - h)) / (2.0 * h);
            assert!((slope - gains.approach_slope(y_1)).abs() < 1e-8);
        }
    }
}
