//! Position and velocity of a target.

use nalgebra::Vector2;

use crate::facts::{angle::Course, evidence::SPEED_AT_REST};

/// The target's course; below 0.05 m/s it is noise, and the last one, `held`, applies.
pub fn target_course(target: &Motion, held: Option<Course>) -> Course {
    course_from(target, SPEED_AT_REST, held)
}

/// [`target_course`] of a target that rests below the speed `slowest`, m/s.
pub(crate) fn course_from(target: &Motion, slowest: f64, held: Option<Course>) -> Course {
    match held {
        Some(course) if target.velocity.norm() < slowest => course,
        Some(_) | None => Course::of(&target.velocity),
    }
}

/// Position and velocity over ground at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s.
    pub velocity: Vector2<f64>,
}
