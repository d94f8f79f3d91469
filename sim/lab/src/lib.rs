//! The laboratory: what a guidance law is worth, and what a craft is like.
//!
//! In reading order: [`tuning`] makes the compared laws strong ones; [`comparison`] is the planner and a law on one
//! mission, with [`scores`] of each; a [`campaign`] flies all contenders in many worlds and on many craft, beside the best that the
//! hull allows (`regret`), and reports what that comes to. [`trial`] puts a craft through the manoeuvres that show how it answers, [`mod@identify`]
//! learns it from the log ([`log_file`]). [`figures`] are charts, [`report`] is a mission as one page, drawn as the service's page draws it.
//!
//! Everything here looks at the planner and the simulator from outside: neither knows that there is a laboratory.

mod article;
pub mod campaign;
mod chart;
pub mod comparison;
mod document;
pub mod figures;
pub mod identify;
pub mod log_file;
mod regret;
pub mod report;
pub mod scores;
pub mod stopwatch;
pub mod trial;
pub mod tuning;
mod unwrap;
