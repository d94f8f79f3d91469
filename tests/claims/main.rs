//! Claims about the project that are checked inside one process, without the program.
//!
//! Tests that start the program are in `api/tests/program`: only a package's own tests know where its binary is.

mod any_snapshot;
mod bridge;
mod deadline;
mod fallback_levels;
mod fuzz;
mod guarantees;
mod imports;
mod malformed_bodies;
mod missions;
mod paper_corrections;
mod rejections;
mod service;
mod store;
mod telemetry;
mod violations;
mod visits;
mod voyages;
mod wire;
