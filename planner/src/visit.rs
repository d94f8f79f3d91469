//! Visits: next AUVs, arrivals and departures over the next half hour to two hours.
//!
//! ```text
//! minimise  (∫ Σ wᵢ cᵢ dt + θ Σ wᵢ cᵢ(H)) / (H + θ)     or the largest wᵢ cᵢ and 0.01 times that
//! over sequences of (AUV, arrival, departure), with every arrival the earliest possible
//! ```
//! `cost` evolves a cost, `depth` forecasts depths, `fleet` holds the AUVs and the craft,
//! `intercept` finds the earliest arrival, `state` applies a leg or a stay to all costs, `search`
//! tries sequences, `orders` lists tours by the clock, `bound` limits the cost from below, `memory`
//! reads the previous schedule, `hearing` detects silent AUVs, `schedule` chooses, `answer` and
//! `sentence` describe the choice.

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
