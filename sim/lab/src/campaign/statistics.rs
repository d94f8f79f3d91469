//! Paired statistics on the rows of a campaign.
//!
//! Two controllers are compared in the worlds that both flew: the same start, water and noise, so that what a world has in store for
//! both cancels. A comparison is a ratio a/b of positive values, or a difference a − b where a value may be 0 or below.
//!
//! ```text
//! row ─ scenario, craft → group;  group, replicate → world
//! d = ln(a/b), or a − b                                  of a world
//! x = mean of d over a cluster                           what counts as one observation
//! estimate = mean of x;  ratio = exp(estimate)
//! ```
//! Replicates of one group are independent of each other; groups differ by more than that. A line over several groups therefore takes a
//! group as one observation (a cluster), each with the same weight: its interval says how other scenarios or craft of that kind
//! would come out, and not what more replicates of these would give. A line on one scenario with several craft takes
//! the craft as clusters; a line on one group takes its replicates.
//!
//! Replicate k of every group has the same seed and parameters. The interval over groups holds them fixed: with few replicates, what
//! these draws have in common is not in it.
//!
//! Rows of missions that failed have no values. They are counted beside the pairs, and never stand for a value.

mod compare;
mod effect;
mod flights;
mod resampling;
pub(crate) mod student;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use compare::{Cluster, Comparison, Measure, Question, Wins, compare, holm, unit, worst};
pub(crate) use effect::{Effect, Third, effect};
pub(crate) use flights::Flights;
pub(crate) use resampling::RESAMPLES;
