//! Angles on the circle; heading and course are types of their own.

use std::f64::consts::{PI, TAU};

pub use geodesy::direction;
use nalgebra::Vector2;

/// Wraps an angle to (−π, π]. Unit: rad. Exact for angles already inside.
pub fn wrap(angle: f64) -> f64 {
    if -PI < angle && angle <= PI {
        return angle;
    }
    let wrapped = angle.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// Rotation from the body (or target, or path) frame to NED: `v_ned = ned_from_body(psi) * v_body`.
pub fn ned_from_body(psi: f64) -> nalgebra::Matrix2<f64> {
    let (sin, cos) = psi.sin_cos();
    nalgebra::Matrix2::new(cos, -sin, sin, cos)
}

/// Angle of a (north, east) vector, clockwise from north, in (−π, π]; 0 for the zero vector.
pub fn angle_of(vector: &Vector2<f64>) -> f64 {
    // `+ 0.0` turns −0.0 into 0.0, for which atan2 would otherwise answer −π on the southern ray.
    wrap((vector.y + 0.0).atan2(vector.x + 0.0))
}

/// Direction of the bow: 0 at north, positive clockwise, in (−π, π]. Unit: rad.
#[doc(alias = "psi")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading(f64);

impl Heading {
    /// Wraps `angle` to (−π, π].
    pub fn new(angle: f64) -> Self {
        Self(wrap(angle))
    }

    /// The angle in (−π, π], rad.
    pub fn radians(self) -> f64 {
        self.0
    }

    /// The angle in [0, 360), degrees, as a compass shows it.
    pub fn compass_degrees(self) -> f64 {
        let degrees = self.0.to_degrees().rem_euclid(360.0);
        // rem_euclid of a tiny negative number rounds up to 360 itself.
        if degrees < 360.0 { degrees } else { 0.0 }
    }

    /// Unit vector along the bow, (north, east).
    pub fn unit(self) -> Vector2<f64> {
        direction(self.0)
    }
}

/// Direction of motion over ground: 0 at north, positive clockwise, in (−π, π]. Unit: rad.
#[doc(alias = "chi")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course(f64);

impl Course {
    /// Wraps `angle` to (−π, π].
    pub fn new(angle: f64) -> Self {
        Self(wrap(angle))
    }

    /// The course of a ground velocity (north, east).
    pub fn of(velocity: &Vector2<f64>) -> Self {
        Self(angle_of(velocity))
    }

    /// The angle in (−π, π], rad.
    pub fn radians(self) -> f64 {
        self.0
    }

    /// Unit vector along the course, (north, east).
    pub fn unit(self) -> Vector2<f64> {
        direction(self.0)
    }
}

/// The unit vector 90° clockwise of `direction`.
pub(crate) fn starboard_of(direction: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}

/// sin x / x, and its limit 1 at 0.
pub fn sinc(x: f64) -> f64 {
    // The series' next term, x⁴/120, is below the rounding of 1 here.
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_pi_and_turns_minus_pi_into_pi() {
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0 * PI / 2.0) + PI / 2.0).abs() < 1e-12);
        assert_eq!(wrap(0.3), 0.3);
    }

    #[test]
    fn due_south_is_plus_pi_for_both_signs_of_zero() {
        assert_eq!(angle_of(&Vector2::new(-1.0, -0.0)), PI);
        assert_eq!(angle_of(&Vector2::new(-1.0, 0.0)), PI);
        assert_eq!(angle_of(&Vector2::new(0.0, 0.0)), 0.0);
    }

    #[test]
    fn a_compass_never_shows_360() {
        assert_eq!(Heading::new(-1e-18).compass_degrees(), 0.0);
        assert_eq!(Heading::new(-PI / 2.0).compass_degrees(), 270.0);
    }
}
