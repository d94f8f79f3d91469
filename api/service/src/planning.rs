//! Planning: admission of requests, threads that read them and plan, and deadlines.

pub(crate) mod admission;
pub mod batch;
pub(crate) mod deadline;
pub(crate) mod fleet;
pub mod offline;
pub(crate) mod plan;
pub(crate) mod planners;
pub(crate) mod pool;
pub mod route_files;
