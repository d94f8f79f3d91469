//! MAVLink 2: messages from and to an autopilot.
//!
//! [`MavlinkReader`] turns bytes into events; [`MavlinkWriter`] makes frames; [`Authority`] decides
//! when to send anything. None of them uses a socket.

mod authority;
mod autopilot;
mod reader;
#[cfg(test)]
mod tests;
mod writer;

pub(crate) use self::{
    authority::{Action, Authority, Conditions, Control, HEARTBEAT_AGE_MAX_S, Silence},
    autopilot::{Autopilot, Contradiction, Heartbeat, Parameters},
    reader::{AutopilotEvent, MavlinkReader},
    writer::{MavlinkWriter, TEXT_BYTES},
};
