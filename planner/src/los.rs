//! Line-of-sight laws: analytic trackers that the program is compared with. The first of them is also its
//! initial guess and a fallback level.
//!
//! Each law is a pure function in a file of its own. [`TrackingLaw`] holds what a law remembers from one look
//! to the next, so that its owner (a simulated mission, a rollout) owns the memory.

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

pub use crate::{
    facts::{asc::AscNow, reference::Reference},
    predict::motion::target_course,
};
