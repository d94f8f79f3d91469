//! A chunk, flown piece by piece, on one thread or several.

use super::{
    contender::Pilot,
    design::{Campaign, Chunk, Run, World},
    fly::{GoOn, Stopped, TO_THE_END, bound, row},
    rows::{Row, Rows},
    tune::Gains,
};

/// What can be done by itself.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// Fly a run.
    Fly(Run),
    /// Find the bound of a world.
    Bound(World),
}

/// What a piece came to.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// None where an earlier run stands for this one too.
    Row(Option<Box<Row>>),
    Bound(World, Option<f64>),
}

impl Piece {
    /// All of a chunk: the planner's runs first, which take a hundred times as long as others, so that the thread which ends last ends
    /// with a short one.
    pub(super) fn all(campaign: &Campaign, chunk: Chunk) -> Vec<Self> {
        let mut pieces = vec![];
        for world in chunk.worlds() {
            pieces.extend(campaign.runs_in(world).into_iter().map(Self::Fly));
            pieces.push(Self::Bound(world));
        }
        // Stable: the same order each time.
        pieces.sort_by_key(|piece| !piece.is_dear(campaign));
        pieces
    }

    fn is_dear(self, campaign: &Campaign) -> bool {
        let planner = |run: Run| matches!(campaign.controllers[run.controller].pilot, Pilot::Planner { .. });
        matches!(self, Self::Fly(run) if planner(run))
    }

    /// Does it, with the gains of its arena.
    pub(super) fn done(self, campaign: &Campaign, gains: &Gains, go_on: GoOn<'_>) -> Result<Part, Stopped> {
        match self {
            Self::Bound(world) => Ok(Part::Bound(world, bound(campaign, world, go_on)?)),
            Self::Fly(run) => {
                let flight = gains.flight(campaign, run.controller, run.objective);
                let row = flight
                    .map(|flight| row(campaign, run, &flight, go_on))
                    .transpose()?;
                Ok(Part::Row(row.map(Box::new)))
            }
        }
    }
}

/// What the pieces of a chunk came to so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    rows: Vec<Row>,
    bounds: Vec<(World, Option<f64>)>,
    n: usize,
}

impl Parts {
    /// Keeps a part; how many there are now.
    pub(super) fn keep(&mut self, part: Part) -> usize {
        match part {
            Part::Row(row) => self.rows.extend(row.map(|row| *row)),
            Part::Bound(world, bound) => self.bounds.push((world, bound)),
        }
        self.n += 1;
        self.n
    }

    /// Of all parts the table.
    pub(super) fn rows(mut self, campaign: &Campaign) -> Rows {
        for row in &mut self.rows {
            let own = self
                .bounds
                .iter()
                .find(|(world, _)| world.replicate == row.replicate);
            row.bound_rms_m = own.and_then(|(_, bound)| *bound);
        }
        self.rows.sort_by_key(|row| row.run);
        Rows::of(&self.rows, &campaign.parameter_keys())
    }
}

/// All runs of a chunk, on this thread.
pub(super) fn flown(campaign: &Campaign, chunk: Chunk, gains: &Gains) -> Rows {
    let mut parts = Parts::default();
    for piece in Piece::all(campaign, chunk) {
        parts.keep(piece.done(campaign, gains, TO_THE_END).expect("nothing stops it"));
    }
    parts.rows(campaign)
}
