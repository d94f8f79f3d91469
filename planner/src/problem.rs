//! The planning problem: goal, craft and limits sampled on a grid of times, in the craft's frame.

pub(crate) mod common_point;
pub(crate) mod frame;
pub(crate) mod horizon;
pub(crate) mod limits;
pub mod parameters;
pub(crate) mod previous_trajectory;
pub(crate) mod shores;
pub(crate) mod stage_constraints;
pub(crate) mod violation;
