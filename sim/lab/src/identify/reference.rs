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
        let rows = log.rows();
        Self {
            times: rows.iter().map(|row| row.time).collect(),
            values: continuous(rows.iter().map(|row| row.heading_reference)),
        }
    }

    pub(super) fn speeds(log: &Log) -> Self {
        let rows = log.rows();
        Self {
            times: rows.iter().map(|row| row.time).collect(),
            values: rows.iter().map(|row| row.speed_reference).collect(),
        }
    }

    /// The value from each row on.
    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Reads it with a delay, s, from `time` on; before the first row it has the first value.
    pub(super) fn late(&self, delay: f64, time: f64) -> Reader<'_> {
        Reader {
            held: self,
            row: 0,
            time: time - delay,
        }
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
        while held
            .times
            .get(self.row + 1)
            .is_some_and(|next| *next <= self.time)
        {
            self.row += 1;
        }
        let value = held.values[self.row];
        match held.times.get(self.row + 1) {
            Some(next) if *next < self.time + longest => {
                let lasts = next - self.time;
                // Exactly, without rounding.
                self.time = *next;
                (value, lasts)
            }
            Some(_) | None => {
                self.time += longest;
                (value, longest)
            }
        }
    }
}
