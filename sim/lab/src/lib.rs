//! The laboratory: comparison of guidance laws, and identification of craft.
//!
//! In reading order: [`rules`] visit AUVs without a schedule; [`http_guide`] is an external law; a
//! [`campaign`] flies many controllers under many conditions, with a lower bound (`clairvoyant`);
//! [`comparison`] is one of a single mission, with [`scores`]. [`trial`] simulates a sea trial,
//! [`mod@identify`] fits a craft to its log ([`log_file`]). [`report`] is a mission as one page.
//!
//! Neither the planner nor the simulator depends on this crate.

mod bound;
pub mod campaign;
mod clairvoyant;
pub mod comparison;
pub mod http_guide;
pub mod identify;
pub mod log_file;
pub mod report;
pub mod rules;
pub mod scores;
pub mod stopwatch;
pub mod trial;
