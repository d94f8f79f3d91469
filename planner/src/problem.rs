//! The planning problem: goal, craft and limits sampled on the parameters' grid, in the craft's own frame.

pub(crate) mod common_point;
pub(crate) mod frame;
pub(crate) mod horizon;
pub(crate) mod limits;
pub mod parameters;
pub(crate) mod previous_trajectory;
pub(crate) mod stage_constraints;
pub(crate) mod violation;
