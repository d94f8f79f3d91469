//! Missions: vehicles, real or simulated, for which the service plans for hours.
//!
//! ```text
//! routes → check → registry → actor (live, simulated) → event → store
//!                               └ state, simulation, clock
//! stream, record, replay ← event ← store
//! ```

mod actor;
pub(crate) mod check;
mod clock;
pub mod event;
pub mod record;
mod registry;
pub mod replay;
pub mod retention;
pub(crate) mod routes;
mod scene;
mod simulation;
mod state;
pub(crate) mod stream;

pub(crate) use actor::IdempotencyKey;
pub(crate) use clock::unix_now;
pub use registry::Missions;
