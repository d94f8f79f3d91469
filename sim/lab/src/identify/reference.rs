//! A reference that holds from one row to the next, read with a delay.

use super::log::{Log, continuous};

/// A piecewise constant reference.
///
/// Simulations step from change to change: their result is then smooth in the delay.
#[derive(Clone, Debug)]
pub(super) struct HeldReference {
    times: Vec<f64>,
    values: Vec<f64>,
}

impl HeldReference {
    /// The heading reference, without jumps.
    pub(super) fn headings(log: &Log) -> Self {
        let values = log.rows().iter().map(|row| row.heading_reference);
        Self::at_rows(log, continuous(values))
    }

    pub(super) fn speeds(log: &Log) -> Self {
        let values = log.rows().iter().map(|row| row.speed_reference);
        Self::at_rows(log, values.collect())
    }

    fn at_rows(log: &Log, values: Vec<f64>) -> Self {
        let times = log.rows().iter().map(|row| row.time).collect();
        Self { times, values }
    }

    /// The value from each row on.
    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Reads it with a delay, s, from `time` on; before the first row it has the first value.
    pub(super) fn late(&self, delay: f64, time: f64) -> Reader<'_> {
        Reader { held: self, row: 0, time: time - delay }
    }
}

/// Reads a reference in pieces.
#[derive(Clone, Debug)]
pub(super) struct Reader<'a> {
    held: &'a HeldReference,
    /// The last row not after `time`, or the first.
    row: usize,
    time: f64,
}

impl Reader<'_> {
    /// The value now, and the time until it changes, at most `longest`, s.
    pub(super) fn piece(&mut self, longest: f64) -> (f64, f64) {
        let held = self.held;
        let next = |row: usize| held.times.get(row + 1).copied();
        while next(self.row).is_some_and(|next| next <= self.time) {
            self.row += 1;
        }
        let value = held.values[self.row];
        if let Some(next) = next(self.row).filter(|next| *next < self.time + longest) {
            // Exactly, without rounding.
            return (value, next - std::mem::replace(&mut self.time, next));
        }
        self.time += longest;
        (value, longest)
    }
}
