//! The snapshots that the planner was asked in a mission, to ask again: requests, one a line.

use std::{
    io::{self, Write as _},
    path::Path,
    time::Duration,
};

use planner::snapshot::Snapshot;
use serde_json::Map;
use sim::guide::{Guidance, Guide, GuideError, MpcGuide};
use wire::{Answer, PlanRequest, Prediction};

use crate::cli::out_file::{NotWritten, OutFile};

/// A planner of which some is kept: the first and every `every`-th further snapshot that it is asked, and what every
/// [`PREDICTION_EVERY`]-th plan predicts. They are written after the mission, so that writing does not count as planning.
pub(super) struct KeptPlanner<'a> {
    pub(super) planner: MpcGuide,
    pub(super) n_plans: usize,
    pub(super) every: Option<usize>,
    pub(super) asked: &'a mut Vec<Snapshot>,
    pub(super) predictions: Option<&'a mut Vec<(f64, Prediction)>>,
}

/// A report shows what was predicted at every so manyth plan: some kilobyte each.
const PREDICTION_EVERY: usize = 5;

impl Guide for KeptPlanner<'_> {
    fn name(&self) -> &'static str {
        self.planner.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let guidance = self.planner.guide(snapshot)?;
        if self.every.is_some_and(|every| self.n_plans.is_multiple_of(every)) {
            self.asked.extend(self.planner.asked().cloned());
        }
        if let (Some(kept), Some((snapshot, plan))) = (&mut self.predictions, self.planner.planned())
            && self.n_plans.is_multiple_of(PREDICTION_EVERY)
        {
            let metadata = Map::new();
            let answer = Answer::new(snapshot, plan, Duration::ZERO, &metadata).planned();
            kept.push((snapshot.time, Prediction::of(snapshot, plan, &answer)));
        }
        self.n_plans += 1;
        Ok(guidance)
    }
}

/// A file for the snapshots.
pub(super) fn snapshot_file(path: &Path) -> Result<OutFile, NotWritten> {
    OutFile::new(path, "choose another file with --snapshots")
}

pub(super) fn write_snapshots(file: &OutFile, snapshots: &[Snapshot]) -> Result<(), NotWritten> {
    file.write(|out| {
        for snapshot in snapshots {
            serde_json::to_writer(&mut *out, &PlanRequest::from(snapshot))?;
            out.write_all(b"\n")?;
        }
        Ok::<(), io::Error>(())
    })
}
