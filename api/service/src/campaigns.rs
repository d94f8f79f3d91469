//! Campaigns: many simulated missions of many controllers, flown when no live work waits.
//!
//! ```text
//! routes → posted: file, limits → registry → kept (the disk)
//!                                     └ flyer: one thread of the lowest priority ── lab::campaign ──► progress → events, summary
//! ```
//! A campaign is on the disk before its client hears of it. What is not over goes on after a start of the service.

mod flyer;
mod kept;
pub(crate) mod limits;
mod posted;
mod registry;
pub(crate) mod routes;
mod stream;

pub(crate) use registry::Campaigns;
