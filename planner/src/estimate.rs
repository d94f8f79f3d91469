//! Where each AUV was when it was last heard of: from its reports, or as the client says.
//!
//! A pure function of the request: a client that remembers nothing gets the same answer from every replica. The price,
//! filters run again over a few dozen reports, is a tenth of a millisecond to one.

mod claims;
pub(crate) mod corners;
pub(crate) mod dive;
pub(crate) mod from_reports;
pub(crate) mod interacting;
pub(crate) mod kalman;
pub(crate) mod legs;
pub(crate) mod motion_model;
pub(crate) mod on_path;
pub(crate) mod repeats;
pub(crate) mod rigid_motion;
pub(crate) mod track;
pub(crate) mod turn;

#[cfg(test)]
mod claims_tests;
#[cfg(test)]
mod pace_tests;
#[cfg(test)]
mod speed_band_tests;
#[cfg(test)]
pub(crate) mod tests;

pub use from_reports::{Estimate, Route};
pub use on_path::{NextTurn, PathFit, Spread};
pub use repeats::Repeats;
pub use rigid_motion::Pattern;
