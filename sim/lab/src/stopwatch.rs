//! Solve times and contents of snapshots: the simulator has no clock.

use std::time::Instant;

use planner::{
    forecast::{AuvForecast, Intent},
    snapshot::{ForecastModel, Snapshot},
};
use sim::guide::{Guidance, Guide, GuideError};

/// A guide whose solve times are measured.
pub struct Stopwatch<'a> {
    guide: &'a mut dyn Guide,
    /// Contents of the snapshots.
    pub received: Received,
}

/// Input of a guide over a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Received {
    /// The forecast models that the snapshots called for, in the order of their first use.
    pub forecasts: Vec<ForecastModel>,
    /// Number of snapshots.
    pub snapshots: usize,
    /// Number of snapshots with the current.
    pub with_current: usize,
}

impl<'a> Stopwatch<'a> {
    /// Measures `guide`.
    pub fn new(guide: &'a mut dyn Guide) -> Self {
        Self {
            guide,
            received: Received::default(),
        }
    }
}

impl Guide for Stopwatch<'_> {
    fn name(&self) -> &'static str {
        self.guide.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        self.received.snapshots += 1;
        self.received.with_current += usize::from(snapshot.current.is_some());
        let current = snapshot.current();
        let known = snapshot.auvs.iter().zip(snapshot.paths());
        for ((auv, path), estimate) in known.zip(snapshot.estimates()) {
            let is_followed = estimate.route.is_none_or(|route| route.is_followed());
            let intent = Intent {
                path: path.as_ref().filter(|_| is_followed),
                fit: None,
                dive: auv.dive,
                forgets_after: estimate.forgets_after,
                tuned: &snapshot.tuned().forecast,
            };
            let model = AuvForecast::new(&estimate.state, intent, snapshot.forecast, &current).model;
            if !self.received.forecasts.contains(&model) {
                self.received.forecasts.push(model);
            }
        }
        timed(self.guide, snapshot)
    }
}

/// The answer of `guide`, with its solve time.
pub(crate) fn timed(guide: &mut dyn Guide, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
    let start = Instant::now();
    let guidance = guide.guide(snapshot)?;
    Ok(Guidance {
        solve_time: Some(start.elapsed()),
        ..guidance
    })
}
