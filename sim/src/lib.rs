//! A simulator for guidance laws: vehicles, water, and missions from start to end.
//!
//! One frame throughout: local north-east-down, depth positive down; heading 0 at north, positive
//! clockwise; SI and radians. The same scenario, guide and seed give the same record, to the byte.
//!
//! ```text
//! scenario → world → observe → guide → reference → inner loops → hulls → world → record → metrics
//! ```
//!
//! In the order of the data:
//!
//! - [`scenario`]: files with vehicles, water and knowledge; the start of a mission with a seed.
//! - [`world`]: the truth and its steps: hulls, inner loops, vehicles, water, faults.
//! - [`observe`]: the only path from truth to knowledge.
//! - [`guide`]: guidance laws, which answer an observation with a reference.
//! - [`own_navigation`]: the navigation of AUVs that the craft localises.
//! - [`visits`]: the true costs of unserved AUVs.
//! - [`mission`]: the closed loop from start to end.
//! - [`fleet`]: the same of several craft that share the AUVs.
//! - [`record`] and [`metrics`]: rows of a run, and its measures; `geodesy` places them on Earth.

pub mod fleet;
pub mod guide;
pub mod metrics;
pub mod mission;
pub mod observe;
pub mod own_navigation;
pub mod record;
pub mod scenario;
#[cfg(test)]
mod tests;
pub mod visits;
pub mod world;

pub use world::{
    auv, dive, fault, inner_loop, integrate, path_following, plant, surface_craft, underwater_vehicle, water,
};
