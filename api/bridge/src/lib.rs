//! Connects a craft's autopilot, modems and sensors to a live mission of the service.
//!
//! ```text
//! bytes ─ mavlink, nmea, imc, moos, acoustics → Measurement → integrity → CraftState, fixes, Vessels ─ mission_link
//! frames, sentences ← output_limiter ← follow ← reference, along the newest plan ←─┘
//! ```
//!
//! Each adapter turns the bytes of one wire into [`Measurement`]s, without socket, clock or thread.
//! [`wire`] has sockets and threads, [`mission_client`] HTTP, and [`follow`] the loop.
//!
//! Time is an argument, [`clock::Clock`]. With a simulated one, wires of a test, and a service in
//! the process ([`mission_client::Transport::in_process`]), a bridge is a function:
//! `tests/voyage.rs`.
//!
//! Headings are true, rad, clockwise from north; positions are WGS 84 in degrees.

pub mod acoustics;
mod arrivals;
pub mod autopilot_link;
mod bridge_clock;
mod confirmation;
mod craft_state;
mod current_observer;
pub mod follow;
pub mod imc;
mod integrity;
mod mavlink;
mod measurement;
pub mod mission_client;
pub mod mission_link;
mod mission_setup;
pub mod moos;
pub mod nmea;
mod output_limiter;
mod plan;
pub mod preflight;
mod recent_positions;
pub mod reference;
pub mod rehearsal;
mod rejects;
#[cfg(test)]
mod tests;
mod vessels;
pub mod wire;

pub(crate) use self::craft_state::{CraftState, MeasuredState};
pub(crate) use self::integrity::{Alarm, Source};
pub(crate) use self::plan::Plan;
pub(crate) use self::rejects::{Parsed, reject_if};
pub use planner::snapshot::Origin;

pub use self::measurement::{AuvFix, CraftMeasurement, Measurement, VesselFix, VesselMessage, on_earth};
pub use self::rejects::Rejects;
