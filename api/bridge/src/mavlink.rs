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

pub(crate) use self::authority::{Action, Authority, Conditions, Control, HEARTBEAT_AGE_MAX_S, Silence};
pub(crate) use self::autopilot::{Autopilot, Contradiction, Heartbeat, Mode, Parameters};
pub(crate) use self::reader::{AutopilotEvent, MavlinkReader};
pub(crate) use self::writer::{MavlinkWriter, TEXT_BYTES};
