//! Estimates of each AUV at its last report, from its reports or its given state.
//!
//! A pure function of the request: every replica answers a client without memory alike. The filters
//! run again over a few dozen reports, which takes a tenth of a millisecond to one.

pub(crate) mod corners;
pub(crate) mod dive;
pub(crate) mod from_reports;
mod gaussians;
pub(crate) mod interacting;
pub(crate) mod kalman;
pub(crate) mod legs;
pub(crate) mod motion_model;
pub(crate) mod on_path;
mod particles;
pub(crate) mod past_states;
mod ranging;
pub(crate) mod repeats;
pub(crate) mod rigid_motion;
mod screening;
mod steady_turn;
pub(crate) mod track;
pub(crate) mod turn;

#[cfg(test)]
mod pace_tests;
#[cfg(test)]
mod past_states_tests;
#[cfg(test)]
mod ranging_tests;
#[cfg(test)]
mod screening_tests;
#[cfg(test)]
mod speed_band_tests;
#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod tracking_error_tests;

pub use from_reports::{Estimate, Route};
pub use on_path::{NextTurn, PathFit, Spread};
pub use ranging::Places;
pub use repeats::{RepeatedTrack, Repeats};
pub use rigid_motion::Pattern;
