//! Ways over one horizon, side by side.

use std::ops::{Index, Range};

use crate::response::Stage;

/// Ways of the craft over one horizon, told apart by number: all of them in one piece of memory, which serves the next
/// horizon too.
#[derive(Debug, Default)]
pub(crate) struct Ways {
    /// Stages of a way.
    n_stages: usize,
    /// Way after way.
    stages: Vec<Stage>,
}

impl Ways {
    /// Forgets all ways, for others of `n_stages` stages each.
    pub(crate) fn begin(&mut self, n_stages: usize) {
        self.n_stages = n_stages;
        self.stages.clear();
    }

    /// Adds a way, and answers its number.
    pub(crate) fn add(&mut self, stages: impl IntoIterator<Item = Stage>) -> usize {
        let number = self.count();
        self.stages.extend(stages);
        debug_assert_eq!(self.stages.len(), (number + 1) * self.n_stages);
        number
    }

    /// How many there are: the number of the next.
    pub(crate) fn count(&self) -> usize {
        self.stages.len() / self.n_stages
    }

    /// The numbers of the ways from `first` on, after all but `most` of them are forgotten.
    pub(crate) fn at_most(&mut self, most: usize, first: usize) -> Range<usize> {
        self.stages.truncate((first + most) * self.n_stages);
        first..self.count()
    }
}

impl Index<usize> for Ways {
    type Output = [Stage];

    fn index(&self, number: usize) -> &[Stage] {
        &self.stages[number * self.n_stages..][..self.n_stages]
    }
}
