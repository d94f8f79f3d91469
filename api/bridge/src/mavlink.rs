//! MAVLink 2: an autopilot's messages, and what is sent to it.
//!
//! [`MavlinkReader`] turns bytes into what was heard; [`MavlinkWriter`] makes the frames to send; [`Authority`] says when
//! anything may be sent at all. None of them knows a socket.

mod authority;
mod autopilot;
mod reader;
#[cfg(test)]
mod tests;
mod writer;

pub use self::{
    authority::{Action, Authority, Conditions, Control, Silence},
    autopilot::{Autopilot, Contradiction, Heartbeat, PARAMETERS, Parameters},
    reader::{Heard, MavlinkReader},
    writer::MavlinkWriter,
};
