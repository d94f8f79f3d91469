//! Missions: the service plans for vehicles, real or simulated, for hours.
//!
//! ```text
//! routes → check → registry → actor (live, simulated) → event → store
//!                               └ state, simulation, clock
//! stream, record, replay ← event ← store
//! shared: which missions this service continues, if others share the store
//! ```

mod actor;
pub(crate) mod check;
mod clock;
mod craft_state;
pub mod event;
mod facts;
pub(crate) mod forward;
mod if_match;
mod list;
mod memory;
pub mod own_craft;
pub(crate) mod parameters;
pub mod record;
mod registry;
pub mod replay;
pub mod retention;
pub(crate) mod routes;
mod scene;
mod shared;
mod simulation;
mod state;
mod stream;
mod traffic;

pub use registry::Missions;
