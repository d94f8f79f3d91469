//! Visits: which AUV to serve next, when to arrive and when to leave, over the next half hour to two hours.
//!
//! ```text
//! minimise  (∫ Σ wᵢ cᵢ dt + θ Σ wᵢ cᵢ(H)) / (H + θ)      or the largest wᵢ cᵢ and a hundredth of that
//! over sequences of (AUV, arrival, departure), every arrival the earliest at which the craft can be there
//! ```
//! `cost` is how a cost goes on, `depth` how deep an AUV will be, `fleet` the AUVs and the craft as this needs them, `intercept` the earliest arrival,
//! `state` what a leg or a stay does to all costs, `search` the sequences, `orders` those of a clock, `bound` what no schedule
//! costs less than, `memory` what the schedule before left, `hearing` which AUV is not heard any more, `schedule` the one that is chosen, `answer` what is said of it.

pub(crate) mod answer;
pub(crate) mod bound;
pub(crate) mod cost;
pub(crate) mod depth;
pub(crate) mod fleet;
pub(crate) mod hearing;
pub(crate) mod intercept;
pub(crate) mod memory;
pub(crate) mod orders;
pub(crate) mod schedule;
pub(crate) mod search;
pub(crate) mod sentence;
pub(crate) mod state;
#[cfg(test)]
mod tests;
