//! MOOS: a client of a MOOSDB, beside the IvP helm.
//!
//! `MoosClient` turns bytes into events and references into bytes; `views` draws the plan for
//! pMarineViewer. Variables are in metres east (x) and north (y) of a datum, degrees and seconds.
//! None of this uses a socket.

mod client;
mod mission_file;
mod node_report;
mod packet;
#[cfg(test)]
mod tests;
mod vehicles;
mod views;

pub(crate) use self::client::MoosClient;
pub use self::mission_file::{NoDatum, datum_of};
pub(crate) use self::vehicles::MoosVehicles;
pub(crate) use self::views::NO_PLAN;
