//! Times a guide and notes what it was told: the simulator has no clock.

use std::time::{Duration, Instant};

use planner::{
    forecast::AuvForecast,
    snapshot::{ForecastModel, Snapshot},
};
use sim::guide::{Guidance, Guide, GuideError};

/// A guide with a stopwatch.
pub struct Stopwatch<'a> {
    guide: &'a mut dyn Guide,
    /// Time of each answer.
    pub times: Vec<Duration>,
    /// What the snapshots held.
    pub told: Told,
}

/// What a guide was told over a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
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
            times: Vec::new(),
            told: Told::default(),
        }
    }
}

impl Guide for Stopwatch<'_> {
    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        self.told.snapshots += 1;
        self.told.with_current += usize::from(snapshot.current.is_some());
        for auv in &snapshot.auvs {
            let model = AuvForecast::new(auv, snapshot.forecast, &snapshot.current()).model;
            if !self.told.forecasts.contains(&model) {
                self.told.forecasts.push(model);
            }
        }
        let start = Instant::now();
        let guidance = self.guide.guide(snapshot);
        self.times.push(start.elapsed());
        guidance
    }
}

/// The time that a share `q` in (0, 1] of `times` do not exceed, ms (nearest rank); `None` of none.
#[must_use]
pub fn quantile_ms(times: &[Duration], per_cent: usize) -> Option<f64> {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    let rank = (sorted.len() * per_cent).div_ceil(100).saturating_sub(1);
    sorted.get(rank).map(|time| time.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_a_time_that_was_measured() {
        let times: Vec<_> = (1..=200).rev().map(Duration::from_millis).collect();
        assert_eq!(quantile_ms(&times, 50), Some(100.0));
        assert_eq!(quantile_ms(&times, 99), Some(198.0));
        assert_eq!(quantile_ms(&times, 100), Some(200.0));
        assert_eq!(quantile_ms(&times[..1], 50), Some(200.0));
        assert_eq!(quantile_ms(&[], 50), None);
    }
}
