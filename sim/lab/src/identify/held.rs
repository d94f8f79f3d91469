//! A reference that is held from one row to the next, looked up at any delay.

use super::log::{Log, continuous};

/// A piecewise constant reference.
///
/// A simulation goes from change to change, and not by the clock: what it ends at then changes smoothly with the delay,
/// where with fixed steps it would jump and leave least squares without a slope.
#[derive(Clone, Debug)]
pub(super) struct Held {
    times: Vec<f64>,
    values: Vec<f64>,
}

impl Held {
    /// The heading reference, without jumps.
    pub(super) fn headings(log: &Log) -> Self {
        let rows = log.rows();
        Self {
            times: rows.iter().map(|row| row.time).collect(),
            values: continuous(rows.iter().map(|row| row.heading_reference)),
        }
    }

    /// The speed reference.
    pub(super) fn speeds(log: &Log) -> Self {
        let rows = log.rows();
        Self {
            times: rows.iter().map(|row| row.time).collect(),
            values: rows.iter().map(|row| row.speed_reference).collect(),
        }
    }

    /// The value held from each row on.
    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Reads it, `delay` s late, from `time` on: before the first row its value was held.
    pub(super) fn late(&self, delay: f64, time: f64) -> Reader<'_> {
        Reader {
            held: self,
            row: 0,
            time: time - delay,
        }
    }
}

/// Reads a reference piece by piece.
#[derive(Clone, Debug)]
pub(super) struct Reader<'a> {
    held: &'a Held,
    /// The last row not after `time`, the first where there is none.
    row: usize,
    time: f64,
}

impl Reader<'_> {
    /// The value that is held now, and how long until it changes or `longest` is over, s.
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
                // As it stands there, and not as rounding has it.
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
