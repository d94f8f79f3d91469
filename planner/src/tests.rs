//! Comparisons and differences that several tests share.

pub(crate) mod prelude {
    pub(crate) use nalgebra::Vector2;

    pub(crate) use super::{moving, near, near_to, rows, slope};
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

use prelude::{AuvState, Course, Vector2};

/// Asserts that two numbers differ by less than `tolerance`.
#[track_caller]
pub(crate) fn near(found: f64, expected: f64, tolerance: f64) {
    let off = (found - expected).abs();
    assert!(off < tolerance, "{found} instead of {expected}");
}

/// Asserts that two vectors are less than `tolerance` apart.
#[track_caller]
pub(crate) fn near_to(found: Vector2<f64>, expected: Vector2<f64>, tolerance: f64) {
    let off = (found - expected).norm();
    assert!(off < tolerance, "{found} instead of {expected}: {off} apart");
}

/// Slope of `curve` at `time` by a central difference over twice `step`.
pub(crate) fn slope(curve: impl Fn(f64) -> Vector2<f64>, time: f64, step: f64) -> Vector2<f64> {
    (curve(time + step) - curve(time - step)) / (2.0 * step)
}

/// An AUV's state on a straight course: position, depth, course, speed.
pub(crate) fn moving(north: f64, east: f64, depth: f64, course: f64, speed: f64) -> AuvState {
    AuvState::new(Vector2::new(north, east), depth, Course::new(course), speed)
}

/// The cells of a table in words: a row a line, cells apart by `|`.
pub(crate) fn rows<const N: usize>(table: &str) -> Vec<[String; N]> {
    let cells = |row: &str| {
        row.split('|')
            .map(|cell| cell.trim().to_owned())
            .collect::<Vec<_>>()
    };
    let lines = table.lines().filter(|row| !row.trim().is_empty());
    lines
        .map(|row| cells(row).try_into().unwrap_or_else(|_| panic!("{row}")))
        .collect()
}
