//! Comparisons and differences that several tests share.

pub(crate) mod prelude {
    pub(crate) use nalgebra::Vector2;

    pub(crate) use super::{declared_through, moving, near, near_to, rows, slope};
    pub(crate) use crate::{
        angle::{Course, Heading, angle_of, direction, ned_from_body, wrap},
        facts::path::piece::starboard,
        path::{Path, Segment, Side},
        snapshot::{
            Asc, Auv, AuvState, DeclaredPath, Goal, GroundTrack, KnownPath, Limits, PlanRequest,
            PreviousPlan, Report, Snapshot, Task, VehicleId,
        },
    };
}

mod checks;

pub(crate) use checks::{near, near_to, rows};
use prelude::{AuvState, Course, DeclaredPath, Segment, Vector2};

/// Slope of `curve` at `time` by a central difference over twice `step`.
pub(crate) fn slope(curve: impl Fn(f64) -> Vector2<f64>, time: f64, step: f64) -> Vector2<f64> {
    (curve(time + step) - curve(time - step)) / (2.0 * step)
}

/// Way-points in lines, with corners of this radius, m.
pub(crate) fn declared_through(
    points: Vec<[f64; 2]>,
    turn_radius_m: Option<f64>,
    speed_mps: f64,
) -> DeclaredPath {
    let waypoints = Segment::Waypoints { points, fillet_m: None, turn_radius_m, legs: vec![] };
    DeclaredPath { segments: vec![waypoints], closed: false, speed_mps }
}

/// An AUV's state on a straight course: position, depth, course, speed.
pub(crate) fn moving(north: f64, east: f64, depth: f64, course: f64, speed: f64) -> AuvState {
    AuvState::new(Vector2::new(north, east), depth, Course::new(course), speed)
}
