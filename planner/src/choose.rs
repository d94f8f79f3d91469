//! Selection of the answer: the fallback level of least predicted cost.

pub(crate) mod answer;
pub mod explain;
pub mod plan;
pub(crate) mod select;
