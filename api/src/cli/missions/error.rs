//! Why a mission on the command line gave no result.

use std::{io, path::PathBuf};

use lab::{
    bench::{BenchError, strangers::StrangersError},
    comparison::ComparisonError,
    figures::FiguresError,
    tuning::TuningError,
};
use record::ExportError;
use sim::guide::GuideError;

use crate::cli::{declared_craft::NoDeclaredCraft, scenarios::NoScenario, trial::TrialError};

/// Why a mission gave no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MissionError {
    #[error(transparent)]
    Scenario(#[from] NoScenario),
    #[error(transparent)]
    DeclaredCraft(#[from] NoDeclaredCraft),
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
    #[error("cannot write {path}: choose another file with --snapshots")]
    Snapshots { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Trial(#[from] TrialError),
    #[error("the mission failed")]
    Mission(#[source] GuideError),
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    #[error("cannot write {path}: see --out in `--help` of the command")]
    Out { path: PathBuf, source: ExportError },
    #[error("cannot write {path}: choose another file with --report")]
    Report { path: PathBuf, source: io::Error },
    #[error("cannot write {path}: choose another directory with --out")]
    Directory { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Figures(#[from] FiguresError),
    #[error(
        "--first-craft {first}: {crafts} craft lead beyond seed {last}, and gains are found on the seeds after it"
    )]
    CraftSeeds { first: u64, crafts: u64, last: u64 },
    #[error("the benchmark could not be run")]
    Bench(#[from] BenchError),
    #[error("the benchmark of random craft could not be run")]
    Strangers(#[from] StrangersError),
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}
