//! Solve times: the simulator has no clock.

use std::time::Instant;

use planner::snapshot::Snapshot;
use sim::guide::{Guidance, Guide, GuideError};

/// The clock that times plans of several craft.
pub const CLOCK: fn() -> Instant = Instant::now;

/// A guide whose solve times are measured.
pub struct Stopwatch<'a>(pub &'a mut dyn Guide);

impl Guide for Stopwatch<'_> {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        timed(self.0, snapshot)
    }
}

/// The answer of `guide`, with its solve time.
pub(crate) fn timed(guide: &mut dyn Guide, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
    let start = Instant::now();
    let guidance = guide.guide(snapshot)?;
    Ok(Guidance { solve_time: Some(start.elapsed()), ..guidance })
}
