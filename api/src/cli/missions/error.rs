//! Why a mission on the command line gave no result.

use lab::tuning::TuningError;
use sim::guide::GuideError;

/// Why a mission gave no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MissionError {
    #[error("the scenario has no surface craft: leave --craft out")]
    NoSurfaceCraft,
    #[error("--{name} must be above 0, not {given}")]
    Gain { name: &'static str, given: f64 },
    #[error("--{0} is a gain of line of sight and the planner has none: add --controller saturated_los")]
    GainOfAnother(&'static str),
    #[error(
        "--tuned searches for gains of line of sight and the planner has none: add --controller saturated_los"
    )]
    TunedOfAnother,
    #[error("the line-of-sight law could not be tuned")]
    Tuning(#[from] TuningError),
    #[error("only the planner is asked in snapshots: leave --snapshots out, or --controller")]
    SnapshotsOfAnother,
    #[error("the mission failed")]
    Mission(#[source] GuideError),
}
