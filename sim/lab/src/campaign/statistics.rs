//! Paired statistics on the rows of a campaign.
//!
//! Two controllers are compared under the conditions that both flew: the same start, water and noise, so that their effect
//! cancels. A comparison is a ratio a/b of positive values, or a difference a − b where a value is 0 or below.
//!
//! ```text
//! row ─ scenario, craft → group;  group, replicate → condition
//! d = ln(a/b), or a − b                                  of a condition
//! x = mean of d over a cluster                           what counts as one observation
//! estimate = mean of x;  ratio = exp(estimate)
//! ```
//! Replicates of one group are independent; groups differ more. A comparison over several groups therefore takes each group as
//! one observation (a cluster) with equal weight: its interval describes other scenarios or craft of that kind, not more
//! replicates of these. For one scenario with several craft the clusters are the craft; for one group, its replicates.
//!
//! Replicate k of every group has the same seed and parameters. The interval over groups holds them fixed: it does not contain
//! what these draws have in common.
//!
//! Failed missions have no values. They are counted beside the pairs.

mod compare;
mod effect;
mod run_table;
pub(crate) mod student;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use compare::{Cluster, Comparison, Measure, Question, Wins, compare, holm, unit};
pub(crate) use effect::{Effect, Third, effect};
pub(crate) use run_table::RunTable;
