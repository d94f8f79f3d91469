//! The snapshots that the planner was asked in a mission, to ask again: requests, one a line.

use std::{
    io::{self, Write as _},
    path::Path,
};

use planner::snapshot::Snapshot;
use sim::guide::{Guidance, Guide, GuideError, MpcGuide};
use wire::PlanRequest;

use crate::cli::out_file::{NotWritten, OutFile};

/// The planner, and where the first and every `every`-th further snapshot is kept that it is asked. They are
/// written after the mission, so that writing does not count as planning.
pub(super) struct Witness<'a> {
    pub(super) planner: MpcGuide,
    pub(super) every: usize,
    pub(super) looks: usize,
    pub(super) asked: &'a mut Vec<Snapshot>,
}

impl Guide for Witness<'_> {
    fn name(&self) -> &'static str {
        self.planner.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let guidance = self.planner.guide(snapshot)?;
        if self.looks.is_multiple_of(self.every) {
            self.asked.extend(self.planner.asked().cloned());
        }
        self.looks += 1;
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
