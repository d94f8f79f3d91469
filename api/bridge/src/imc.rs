//! IMC 5.4: messages from and to vehicles that run DUNE.
//!
//! `codec` turns bytes into messages and back, `ImcReader` messages into events; `ImcLink`
//! holds the wire. None of the files uses a socket.

use std::collections::BTreeMap;

use crate::wire::Endpoint;

pub mod codec;
mod link;
mod mode;
mod reader;
#[cfg(test)]
mod tests;
mod vehicles;

pub(crate) use self::link::ImcLink;
pub(crate) use self::vehicles::ImcVehicles;

/// The name of the bridge's plan in DUNE.
const PLAN: &str = "pilotfish";

/// A craft that runs DUNE, and the AUVs on its network.
#[derive(Clone, Debug)]
pub struct ImcSettings {
    /// The wire to the network, or to the craft.
    pub connect: Endpoint,
    /// The bridge's number as a system.
    pub number: u16,
    /// Name of the craft, as it announces itself.
    pub vehicle: String,
    /// Names of the AUVs.
    pub auvs: Vec<String>,
    /// Names of systems that do not announce themselves, by number.
    pub numbers: BTreeMap<u16, String>,
    /// AUVs by the number of their beacon, for `LblRange`.
    pub beacons: BTreeMap<u8, String>,
    /// `true` for headings and speeds in the mode EXTERNAL, which DUNE does not end, instead of
    /// places ahead in the manoeuvre FollowReference, which ends when they cease.
    pub headings: bool,
    /// `true` if DUNE is asked, before departure, to load a plan of FollowReference.
    pub asks: bool,
}
