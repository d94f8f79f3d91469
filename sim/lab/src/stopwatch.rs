//! Times a guide and notes what it received: the simulator has no clock.

use std::time::Instant;

use planner::{
    forecast::AuvForecast,
    snapshot::{ForecastModel, Snapshot},
};
use sim::guide::{Guidance, Guide, GuideError};

/// A guide with a stopwatch.
pub struct Stopwatch<'a> {
    guide: &'a mut dyn Guide,
    /// What the snapshots held.
    pub received: Received,
}

/// What a guide received over a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Received {
    /// The forecast models that the snapshots called for, in the order of their first use.
    pub forecasts: Vec<ForecastModel>,
    /// How many snapshots there were.
    pub snapshots: usize,
    /// How many of them gave the current.
    pub with_current: usize,
}

impl<'a> Stopwatch<'a> {
    /// Around `guide`.
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
        for (auv, estimate) in snapshot.auvs.iter().zip(snapshot.estimates()) {
            let model = AuvForecast::new(&estimate.state, auv.into(), snapshot.forecast, &current).model;
            if !self.received.forecasts.contains(&model) {
                self.received.forecasts.push(model);
            }
        }
        timed(self.guide, snapshot)
    }
}

/// What `guide` answers, and how long that took.
pub(crate) fn timed(guide: &mut dyn Guide, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
    let start = Instant::now();
    let guidance = guide.guide(snapshot)?;
    Ok(Guidance {
        solve_time: Some(start.elapsed()),
        ..guidance
    })
}
