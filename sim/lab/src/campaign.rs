//! Campaigns: many missions of many controllers under many conditions, drawn from one seed.
//!
//! ```text
//! file ─ scenarios × craft → cases;  case × replicate → condition: seed, parameters
//! case × laws × grid × tuning replicates → gains                 (a stage with its own seeds)
//! condition × controllers × gains → runs → rows → chunks → runs.parquet → pilotfish.analysis
//! ```
//! All controllers of a condition have the same start, water and noise: comparisons are paired. A
//! row depends only on the campaign file, its scenario files and the program's version, except for
//! measured times ([`rows::MEASURED`]): jobs, shards and interruptions do not change it.
//!
//! In reading order: [`mod@file`] is the campaign file, [`design`] its cases and runs,
//! [`controller`] a controller; `tune` and `fly` do the work, `score` scores a run, [`rows`] and
//! [`directory`] keep results, [`run()`] flies missing runs, [`summary()`] is a table of ratios.

pub mod controller;
pub mod design;
pub mod directory;
pub mod file;
pub(crate) mod fly;
pub(crate) mod grid;
mod learnt;
mod queue;
mod replay;
pub mod rows;
mod run;
mod score;
mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod tune;
mod work;

pub use design::{Campaign, Run, ScenarioFiles};
pub use directory::{Directory, DirectoryError, Manifest, Shard};
pub use file::{CampaignError, CampaignFile};
pub use replay::{Replay, ReplayError, replay};
pub use run::{Progress, jobs, run};
pub use summary::summary;
pub use work::{Work, WorkError};
