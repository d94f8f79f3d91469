//! Selection of the answer: the fallback level of least predicted cost.

pub(crate) mod answer;
mod beside;
#[cfg(test)]
mod beside_tests;
pub mod explain;
pub mod plan;
mod round_land;
pub(crate) mod select;
