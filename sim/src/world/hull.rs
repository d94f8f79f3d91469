//! Hulls and what moves them: masses, drag, thrusters, equations of motion.

mod surface;
mod underwater;

pub use surface::{
    CoriolisMasses, SurfaceHull, SurfaceInput, SurfaceState, Thrust, ThrusterHealth, Thrusters,
};
pub use underwater::{PITCH_MAX, UnderwaterHull, UnderwaterInput, UnderwaterState, heading_rate};

/// Resistance of the water to one motion: (d + d₂ |v|) v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Linear coefficient d, N/(m/s) or N m/(rad/s).
    pub linear: f64,
    /// Quadratic coefficient d₂, N/(m/s)² or N m/(rad/s)².
    pub quadratic: f64,
}

impl Drag {
    /// Force or moment against a motion of `velocity`, with the sign of the motion, N or N m.
    pub fn resistance(&self, velocity: f64) -> f64 {
        (self.linear + self.quadratic * velocity.abs()) * velocity
    }

    /// Speed at which the resistance is `load`, N or N m, not negative: m/s or rad/s.
    pub fn speed_against(&self, load: f64) -> f64 {
        // 2 load / (d + √(d² + 4 d₂ load)) is the root that does not cancel where d₂ is small.
        2.0 * load / (self.linear + (self.linear * self.linear + 4.0 * self.quadratic * load).sqrt())
    }
}
