//! Campaigns: many missions of many controllers in many worlds, drawn from one seed, and what they come to.
//!
//! ```text
//! file ─ scenarios × craft → arenas;  arena × replicate → a world: seed, parameters
//! arena × laws × grid × tuning replicates → gains                         (a stage of its own, with seeds of its own)
//! world × controllers × gains → runs → rows → chunks → runs.parquet → report
//! ```
//! All controllers of a world fly from the same start, in the same water, with the same noise: every comparison is paired.
//! A row depends on the file, on the scenarios that it names and on the version of the program alone, but for the columns
//! that are measured by the clock ([`rows::MEASURED`]): any number of jobs, shards and interruptions gives the same rows.
//!
//! In reading order: [`mod@file`] is what a campaign file says, [`design`] what that amounts to, [`contender`] is who flies; `tune` and
//! `fly` are the two kinds of work, `score` is what a flight is worth, [`rows`] is a table of results, [`directory`] keeps it on the disk, and [`run()`] does what is left to be done.
//! `statistics` compares controllers in the rows, and [`mod@report`] says what came of it.

mod chunk;
pub mod contender;
pub mod design;
pub mod directory;
pub mod file;
mod fly;
mod replay;
pub mod report;
pub mod rows;
mod run;
mod score;
mod statistics;
#[cfg(test)]
mod tests;
mod tune;
mod work;

pub use design::{Campaign, Run, ScenarioFiles};
pub use directory::{Directory, DirectoryError, Manifest, Shard};
pub use file::{CampaignError, CampaignFile};
pub use fly::GoOn;
pub use replay::{Replay, ReplayError, replay};
pub use report::CampaignReport;
pub use run::{Progress, Unflown, Watch, jobs, run, run_watched};
pub use work::{Work, WorkError};
