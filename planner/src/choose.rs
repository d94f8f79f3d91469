//! Selection of the answer: the fallback level of least predicted cost.

pub(crate) mod answer;
mod beside;
#[cfg(test)]
mod beside_tests;
pub mod explain;
pub mod plan;
pub(crate) mod select;
