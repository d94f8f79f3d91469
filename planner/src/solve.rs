//! A program solved by Clarabel, with its solution certified by other arithmetic.

pub(crate) mod by_shape;
pub mod certificate;
pub(crate) mod clarabel;
pub mod stop;

pub use by_shape::{ByShape, KEPT_BYTES_MAX};
pub use clarabel::{Solution, SolverStatus, Solvers, TOLERANCE};
