//! Claims about the project, checked inside one process without the program.
//!
//! `api/tests/program` starts the program: only a package's own tests know its binary.

mod any_snapshot;
mod deadline;
mod fallback_levels;
mod fleets;
mod fuzz;
mod guarantees;
mod imports;
mod missions;
mod paper_corrections;
mod rejections;
mod service;
mod store;
mod telemetry;
mod violations;
mod voyages;
mod wire;
