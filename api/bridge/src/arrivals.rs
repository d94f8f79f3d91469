//! Arrivals of what should keep coming: plans, and the fixes of each AUV.

use std::collections::VecDeque;

/// Number of kept times between arrivals, and the least number that predicts the next one.
const INTERVALS: usize = 8;
const INTERVALS_MIN: usize = 3;
/// Delay after which the next arrival is overdue, s.
const OVERDUE_S: f64 = 2.0;

/// The newest arrivals. Times are s of the bridge's clock.
#[derive(Clone, Debug)]
pub(crate) struct Arrivals {
    pub(crate) newest_s: f64,
    /// The last times between two arrivals, s.
    intervals: VecDeque<f64>,
}

impl Arrivals {
    pub(crate) fn first(at_s: f64) -> Self {
        Self { newest_s: at_s, intervals: VecDeque::new() }
    }

    pub(crate) fn push(&mut self, at_s: f64) {
        self.intervals.push_back(at_s - self.newest_s);
        if self.intervals.len() > INTERVALS {
            self.intervals.pop_front();
        }
        self.newest_s = at_s;
    }

    /// `true` if another one should have come by `now`, s: after the longest of the last intervals,
    /// since a modem often loses some. The first arrivals set no expectation.
    pub(crate) fn is_overdue(&self, now: f64) -> bool {
        let usual = self.intervals.iter().copied().fold(0.0, f64::max);
        self.intervals.len() >= INTERVALS_MIN && now - self.newest_s > usual + OVERDUE_S
    }
}
