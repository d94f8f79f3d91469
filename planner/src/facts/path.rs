//! Horizontal paths made of lines and arcs, parametrised by arc length.
//!
//! A [`Path`] is built from lengths and angles ([`Path::starting_at`], [`Path::lawn_mower`]), or
//! from checked outside data ([`Path::from_segments`], [`Path::waypoints`], [`Path::circle`]). A
//! [`SpeedProfile`] gives the speed along one.

mod build;
mod closest;
pub(crate) mod curve;
pub(crate) mod limits;
pub(crate) mod piece;
pub(crate) mod segment;
pub(crate) mod speed_profile;
#[cfg(test)]
mod tests;
pub(crate) mod waypoints;

pub use curve::{Path, Side};
pub use limits::{
    ARC_ANGLE_MAX, GAP_MAX, InvalidPath, KINK_MAX, LENGTH_MAX, LENGTH_MIN, SEGMENTS_MAX, TURN_RADIUS,
};
pub use piece::{Leg, PathPoint};
pub use segment::Segment;
pub use speed_profile::SpeedProfile;
pub use waypoints::{LOOP_FROM, REPEATED_WITHIN};
