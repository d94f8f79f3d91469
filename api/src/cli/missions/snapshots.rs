//! The planner's snapshots in a mission, as requests to plan again, one for each line.

use std::io::{self, Write as _};
use std::time::Duration;

use planner::snapshot::Snapshot;
use serde_json::Map;
use sim::guide::{Guidance, Guide, GuideError, MpcGuide};
use wire::{Answer, Prediction};

use crate::cli::{failure::Failure, out_file::OutFile};

/// A planner that keeps the first and every `every`-th further snapshot, and the prediction of
/// every [`PREDICTION_EVERY`]-th plan. Both are written after the mission, outside planning time.
pub(super) struct RecordedPlanner<'a> {
    pub(super) planner: MpcGuide,
    pub(super) n_plans: usize,
    pub(super) every: Option<usize>,
    pub(super) asked: &'a mut Vec<Snapshot>,
    pub(super) predictions: Option<&'a mut Vec<(f64, Prediction)>>,
}

/// A report has one prediction in so many: each takes some kilobytes.
const PREDICTION_EVERY: usize = 5;

impl Guide for RecordedPlanner<'_> {
    fn name(&self) -> &'static str {
        self.planner.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let guidance = self.planner.guide(snapshot)?;
        if self.every.is_some_and(|every| self.n_plans.is_multiple_of(every)) {
            self.asked.extend(self.planner.planned().map(|(snapshot, _)| snapshot.clone()));
        }
        if let (Some(kept), Some((snapshot, plan))) = (&mut self.predictions, self.planner.planned())
            && self.n_plans.is_multiple_of(PREDICTION_EVERY)
        {
            let metadata = Map::new();
            let answer = Answer::new(snapshot, plan, Duration::ZERO, &metadata).planned();
            kept.push((snapshot.t_s, Prediction::of(snapshot, plan, &answer)));
        }
        self.n_plans += 1;
        Ok(guidance)
    }
}

pub(super) fn write_snapshots(file: &OutFile, snapshots: &[Snapshot]) -> Result<(), Failure> {
    file.write(|out| {
        for snapshot in snapshots {
            serde_json::to_writer(&mut *out, &**snapshot)?;
            out.write_all(b"\n")?;
        }
        Ok::<(), io::Error>(())
    })
}
