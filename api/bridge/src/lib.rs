//! Between a craft's own wires and a live mission of the service.
//!
//! ```text
//! bytes ─ mavlink, nmea, acoustics, ros2 → Measurement → CraftState, fixes ─ mission_link → the mission
//! frames, sentences, messages ← follow ← reference, along the newest plan ←───────────────────┘
//! ```
//!
//! Each adapter turns the bytes of one wire into [`Measurement`]s, and knows no socket, no clock and no thread; [`wire`] has the
//! sockets, [`mission`] speaks HTTP, and [`follow`] is the loop that joins them. Nothing here knows the service's code.
//!
//! Headings are true, rad, clockwise from north; positions are WGS 84 in degrees.

pub mod acoustics;
mod clock;
mod craft_state;
mod current_observer;
pub mod follow;
pub mod helm;
pub mod mavlink;
mod measurement;
pub mod mission;
pub mod mission_link;
pub mod nmea;
mod plan;
pub mod preflight;
pub mod reference;
mod refused;
#[cfg(feature = "ros2")]
pub mod ros2;
mod setup;
pub mod wire;

pub use self::{
    clock::Clock,
    craft_state::{CraftState, StateNow},
    current_observer::CurrentObserver,
    measurement::{AuvFix, CraftMeasurement, Geographic, Measurement},
    plan::PlanNow,
    refused::Refused,
};
