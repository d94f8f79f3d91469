//! One program solved by Clarabel, and its solution certified by arithmetic that is not Clarabel's.

pub mod certificate;
pub(crate) mod clarabel;
pub mod stop;

pub use clarabel::{SHAPES_MAX, Solution, SolverStatus, Solvers, TOLERANCE};
