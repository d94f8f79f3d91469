//! Indices of a program's numbers: all index arithmetic is here.

use serde::{Deserialize, Serialize};

/// Shape of a program: its variables and rows, and so their indices. It depends on the promises and
/// their numbers, never on the data, so that one solver serves all programs of a shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Number of stages N.
    pub n_stages: usize,
    /// AUVs to stay within acoustic range of.
    pub n_ranges: usize,
    /// Number of the last of these, which the goal does not name.
    pub n_other_ranges: usize,
    /// Discs to stay out of, then half-planes beside no-go areas.
    pub n_discs: usize,
    /// Edges of the area to stay in.
    pub n_edges: usize,
    /// AUVs in a minimax range; 0 if the goal is a point.
    pub n_minimax: usize,
    /// `true` if propulsion energy has a price.
    pub energy: bool,
}

/// Soft rows of a stage. Rows of one kind share a slack, the largest of theirs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slack {
    /// Forward speed and turn rate: two in one saves a sixth of the variables.
    Motion,
    /// Ranges of the AUVs that the goal names.
    AcousticRange,
    /// Ranges of the others.
    OtherRange,
    /// Edges of the area.
    Area,
    /// Discs and no-go areas to keep out of.
    KeepOut,
}

impl Slack {
    /// In the order of their columns.
    const ALL: [Self; 5] = [Self::Motion, Self::AcousticRange, Self::OtherRange, Self::Area, Self::KeepOut];
}

const N_STATES: usize = 4;

/// σ, m and e of a stage.
const N_ENERGY: usize = 3;

impl Layout {
    /// Number of variables.
    pub fn n_variables(&self) -> usize {
        self.energy(self.n_stages + 1)
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.energy_cones(self.n_stages + 1)
    }

    /// The slacks of a stage, in the order of their columns.
    pub(crate) fn slacks(self) -> impl Iterator<Item = Slack> {
        Slack::ALL.into_iter().filter(move |slack| self.has(*slack))
    }

    fn has(&self, slack: Slack) -> bool {
        match slack {
            Slack::Motion => true,
            Slack::AcousticRange => self.n_ranges > self.n_other_ranges,
            Slack::OtherRange => self.n_other_ranges > 0,
            Slack::Area => self.n_edges > 0,
            Slack::KeepOut => self.n_discs > 0,
        }
    }

    fn n_slacks(&self) -> usize {
        self.slacks().count()
    }

    fn slack_index(&self, slack: Slack) -> usize {
        debug_assert!(self.has(slack));
        self.slacks().take_while(|before| *before != slack).count()
    }

    // Columns: d and v by stage, then the slacks by stage, the minimax ranges, σ, m and e.

    /// First of the two columns of d_k, k = 1 … N.
    #[expect(clippy::unused_self, reason = "callers need not know which places depend on the shape")]
    pub(crate) fn deviation(&self, k: usize) -> usize {
        N_STATES * (k - 1)
    }

    /// First of the two columns of v_k, k = 1 … N.
    #[expect(clippy::unused_self, reason = "callers need not know which places depend on the shape")]
    pub(crate) fn velocity(&self, k: usize) -> usize {
        N_STATES * (k - 1) + 2
    }

    /// Column of a slack of stage k = 1 … N.
    pub(crate) fn slack(&self, k: usize, slack: Slack) -> usize {
        N_STATES * self.n_stages + self.n_slacks() * (k - 1) + self.slack_index(slack)
    }

    fn after_slacks(&self) -> usize {
        (N_STATES + self.n_slacks()) * self.n_stages
    }

    fn n_minimax_columns(&self) -> usize {
        if self.n_minimax == 0 { 0 } else { self.n_stages }
    }

    /// Column of the minimax range of stage k.
    pub(crate) fn minimax(&self, k: usize) -> usize {
        self.after_slacks() + (k - 1)
    }

    /// First of the columns σ_k, m_k, e_k.
    pub(crate) fn energy(&self, k: usize) -> usize {
        let per_stage = if self.energy { N_ENERGY } else { 0 };
        self.after_slacks() + self.n_minimax_columns() + per_stage * (k - 1)
    }

    // Rows, block after block: equations, then inequalities, then cones of second order.

    pub(crate) fn dynamics(&self, k: usize) -> usize {
        2 * (k - 1).min(self.n_stages)
    }

    pub(crate) fn acceleration(&self, k: usize) -> usize {
        2 * self.n_stages + 2 * (k - 1)
    }

    pub(crate) fn forward_speed(&self, k: usize) -> usize {
        4 * self.n_stages + (k - 1)
    }

    pub(crate) fn turn_rate(&self, k: usize) -> usize {
        5 * self.n_stages + 2 * (k - 1)
    }

    pub(crate) fn slack_sign(&self, k: usize, slack: Slack) -> usize {
        7 * self.n_stages + self.n_slacks() * (k - 1) + self.slack_index(slack)
    }

    pub(crate) fn area(&self, k: usize, edge: usize) -> usize {
        (7 + self.n_slacks()) * self.n_stages + self.n_edges * (k - 1) + edge
    }

    /// Row of the end of interval k, from stage k − 1 to k, outside a disc.
    pub(crate) fn disc_at_end(&self, k: usize, disc: usize) -> usize {
        self.area(self.n_stages + 1, 0) + self.n_discs * (k - 1) + disc
    }

    /// Row of the start of interval k = 2 … N outside a disc; interval 1 starts at the craft.
    pub(crate) fn disc_at_start(&self, k: usize, disc: usize) -> usize {
        self.disc_at_end(self.n_stages + 1, 0) + self.n_discs * (k - 2) + disc
    }

    /// Row of σ_k below its limit.
    pub(crate) fn top_speed(&self, k: usize) -> usize {
        let discs = if self.n_stages == 0 { 0 } else { self.n_discs * (2 * self.n_stages - 1) };
        let per_stage = usize::from(self.energy);
        self.area(self.n_stages + 1, 0) + discs + per_stage * (k - 1)
    }

    pub(crate) fn n_inequalities(&self) -> usize {
        self.speed_cone(1) - 2 * self.n_stages
    }

    pub(crate) fn speed_cone(&self, k: usize) -> usize {
        self.top_speed(self.n_stages + 1) + 3 * (k - 1)
    }

    pub(crate) fn range_cone(&self, k: usize, auv: usize) -> usize {
        self.speed_cone(self.n_stages + 1) + 3 * (self.n_ranges * (k - 1) + auv)
    }

    pub(crate) fn minimax_cone(&self, k: usize, auv: usize) -> usize {
        self.range_cone(self.n_stages + 1, 0) + 4 * (self.n_minimax * (k - 1) + auv)
    }

    /// First row of the two cones of stage k for e_k ≥ σ_k³.
    pub(crate) fn energy_cones(&self, k: usize) -> usize {
        let per_stage = if self.energy { 6 } else { 0 };
        self.minimax_cone(self.n_stages + 1, 0) + per_stage * (k - 1)
    }
}
