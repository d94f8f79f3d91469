//! The delay of a reference before it reaches the loops.

use planner::los::Reference;

/// Longest delay of a reference, periods: 2 s.
pub const DELAY_PERIODS_MAX: usize = 20;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct CommandDelay {
    ring: [Reference; DELAY_PERIODS_MAX + 1],
    newest: usize,
}

impl CommandDelay {
    pub(super) fn holding(reference: Reference) -> Self {
        Self { ring: [reference; DELAY_PERIODS_MAX + 1], newest: 0 }
    }

    /// Takes the reference of this period and returns that of `periods` before.
    pub(super) fn pass(&mut self, reference: Reference, periods: usize) -> Reference {
        let places = self.ring.len();
        self.newest = (self.newest + 1) % places;
        self.ring[self.newest] = reference;
        self.ring[(self.newest + places - periods.min(DELAY_PERIODS_MAX)) % places]
    }
}
