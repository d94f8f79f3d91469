//! Missions: vehicles, real or simulated, that the planner accompanies for hours.

mod actor;
mod check;
mod clock;
pub mod event;
mod known;
pub mod log;
pub mod record;
mod registry;
pub mod replay;
pub(crate) mod routes;
mod simulation;
mod stream;

pub use registry::Missions;
