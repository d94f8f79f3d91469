//! A chunk of runs, in pieces that can be flown in parallel.

use super::{
    controller::ControlLaw,
    design::{Campaign, Chunk, Condition, Run},
    fly::{bound, result},
    rows::{Rows, RunResult},
    tune::Gains,
};
use crate::http_guide::NoGuidance;

/// A piece of a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// Fly a run.
    Fly(Run),
    /// Compute the bound of a condition.
    Bound(Condition),
}

/// The result of a piece.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// None if an earlier run has the same gains and stands for this one.
    Run(Option<Box<RunResult>>),
    Bound(Condition, Option<f64>),
}

impl Piece {
    /// All pieces of a chunk. The planner's runs, which take a hundred times as long as others, come first: so the last thread ends
    /// with a short one.
    pub(super) fn all(campaign: &Campaign, chunk: Chunk) -> Vec<Self> {
        let mut pieces = vec![];
        for condition in chunk.conditions() {
            pieces.extend(campaign.runs_in(condition).into_iter().map(Self::Fly));
            pieces.push(Self::Bound(condition));
        }
        // A stable sort: the same order each time.
        pieces.sort_by_key(|piece| !piece.is_slow(campaign));
        pieces
    }

    fn is_slow(self, campaign: &Campaign) -> bool {
        let planner = |run: Run| {
            matches!(
                campaign.controllers[run.controller].law,
                ControlLaw::Planner { .. } | ControlLaw::Guide(_)
            )
        };
        matches!(self, Self::Fly(run) if planner(run))
    }

    /// Flies or computes it, with the gains of its case.
    pub(super) fn done(self, campaign: &Campaign, gains: &Gains) -> Result<Part, NoGuidance> {
        match self {
            Self::Bound(condition) => Ok(Part::Bound(condition, bound(campaign, condition))),
            Self::Fly(run) => {
                let gains = gains.of_run(campaign, run.controller, run.objective);
                let flown = gains.map(|gains| result(campaign, run, &gains)).transpose()?;
                Ok(Part::Run(flown.map(Box::new)))
            }
        }
    }
}

/// The results of a chunk so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    rows: Vec<RunResult>,
    bounds: Vec<(Condition, Option<f64>)>,
    n: usize,
}

impl Parts {
    /// Adds a part, and returns the number of parts.
    pub(super) fn add(&mut self, part: Part) -> usize {
        match part {
            Part::Run(row) => self.rows.extend(row.map(|row| *row)),
            Part::Bound(condition, bound) => self.bounds.push((condition, bound)),
        }
        self.n += 1;
        self.n
    }

    /// The table of all parts.
    pub(super) fn rows(mut self, campaign: &Campaign) -> Rows {
        for row in &mut self.rows {
            let own = self
                .bounds
                .iter()
                .find(|(condition, _)| condition.replicate == row.replicate);
            row.bound_rms_m = own.and_then(|(_, bound)| *bound);
        }
        self.rows.sort_by_key(|row| row.run);
        Rows::of(&self.rows, &campaign.parameter_keys())
    }
}

/// Flies all runs of a chunk on this thread.
pub(super) fn flown(campaign: &Campaign, chunk: Chunk, gains: &Gains) -> Result<Rows, NoGuidance> {
    let mut parts = Parts::default();
    for piece in Piece::all(campaign, chunk) {
        parts.add(piece.done(campaign, gains)?);
    }
    Ok(parts.rows(campaign))
}
