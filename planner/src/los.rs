//! Line-of-sight laws to compare with the program; the first is its initial guess and fallback.
//!
//! Each law is a pure function in its own file. [`TrackingLaw`] holds a law's memory between steps,
//! so that the owner (a simulated mission, a rollout) owns the memory.

#[cfg(test)]
mod flight_for_tests;
pub(crate) mod geometry;
pub(crate) mod integral;
pub(crate) mod law;
pub(crate) mod saturated;
pub(crate) mod tracker_frame;
pub(crate) mod tracking_law;
pub(crate) mod waypoint_box;

pub use integral::{IntegralState, integral_los};
pub use law::{LawGains, LosGains, LosLaw, LosTuning};
pub use saturated::saturated_los;
pub use tracker_frame::saturated_los_tracker_frame;
pub use tracking_law::TrackingLaw;
pub use waypoint_box::WaypointBox;

pub use crate::facts::asc::AscNow;
pub use crate::facts::reference::Reference;
pub use crate::predict::motion::target_course;
