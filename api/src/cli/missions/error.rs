//! Errors of `simulate` and `compare`.

use lab::comparison::ComparisonError;
use sim::guide::GuideError;

/// The mission cannot be run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MissionError {
    #[error("the scenario has no surface craft: remove --craft")]
    NoSurfaceCraft,
    #[error("--{name} must be above 0, not {given}")]
    Gain { name: &'static str, given: f64 },
    #[error("--{0} is a gain of the line-of-sight laws: add --controller saturated_los")]
    GainOfAnother(&'static str),
    #[error("--tuned searches for gains of a line-of-sight law: add --controller saturated_los")]
    TunedOfAnother,
    #[error(transparent)]
    Tuning(#[from] ComparisonError),
    #[error("only the planner has snapshots: remove --snapshots or --controller")]
    SnapshotsOfAnother,
    #[error("the mission failed")]
    Mission(#[source] GuideError),
}
