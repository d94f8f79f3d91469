//! What passes of the program lead to, and which of two such outcomes is better.

use crate::{
    answer::{Degraded, Predicted, SolverReport},
    merit::Broken,
};

/// By how much the merit of one way must be below that of another to be better: ties go to the first, which is the
/// one to starboard.
const TIE: f64 = 1e-6;

/// What the passes led to: a way, or the reason why there is none.
pub(crate) struct Optimum {
    pub(crate) way: Option<Way>,
    /// Whether the last pass left the directions that it was given about as they were.
    pub(crate) settled: bool,
    pub(crate) degraded: Option<Degraded>,
    pub(crate) report: SolverReport,
    /// Limits of motion that the program's own stages do not keep.
    pub(crate) violations: Broken<2>,
}

/// A planned way, and what following it is predicted to lead to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// Its number among all [`Ways`](crate::ways::Ways).
    pub(crate) number: usize,
    pub(crate) predicted: Predicted,
    /// Limits of position that the craft breaks on it.
    pub(crate) violations: Broken<4>,
}

impl Optimum {
    pub(crate) fn none(reason: Degraded) -> Self {
        Self {
            way: None,
            settled: false,
            degraded: Some(reason),
            report: SolverReport::nothing_done(),
            violations: [None; 2],
        }
    }

    pub(crate) fn merit(&self) -> f64 {
        self.way.as_ref().map_or(f64::INFINITY, |way| way.predicted.merit)
    }

    /// The better of both, with the work of both.
    pub(crate) fn or(self, other: Self) -> Self {
        let passes = self.report.passes + other.report.passes;
        let iterations = self.report.iterations + other.report.iterations;
        let (ours, theirs) = (self.merit(), other.merit());
        // Nobody knows what a way that there was no time for would have led to.
        let stopped = [self.degraded, other.degraded].contains(&Some(Degraded::Deadline));
        // Infinite merits: keep the first, and its reason.
        let mut better = if theirs < ours - TIE * ours.abs().min(f64::MAX) {
            other
        } else {
            self
        };
        if better.way.is_none() && stopped {
            better.degraded = Some(Degraded::Deadline);
        }
        better.report = SolverReport {
            passes,
            iterations,
            ..better.report
        };
        better
    }
}
