//! Choosing the answer: the fallback levels side by side, the best of them by predicted cost.

pub(crate) mod answer;
pub mod explain;
pub mod plan;
pub(crate) mod select;
