//! Planning: which requests are admitted, on which threads they are read and planned, and until when.

pub(crate) mod admission;
pub mod batch;
pub(crate) mod deadline;
pub mod offline;
pub(crate) mod plan;
pub(crate) mod planners;
pub(crate) mod pool;
pub mod route_files;
