//! A planner's estimates of its craft.

use planner::{craft::CraftEstimate, tuned::CraftNumbers};

/// Time of the estimates, s.
const LEARNT_AT_S: f64 = 300.0;

/// A planner's estimates of its craft during a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CraftLearning {
    /// Start times of its alarms that the craft does not follow, s.
    pub(super) alarms_at_s: Vec<f64>,
    /// Total duration of the alarms, s.
    pub(super) alarm_s: f64,
    /// Lag of the heading loop, lag of the surge loop and sway per yaw rate, s, each with its
    /// standard deviation, after `LEARNT_AT_S`; `None` if the mission is shorter.
    pub(super) estimates: Option<[(f64, f64); 3]>,
    is_alarmed: bool,
}

impl CraftLearning {
    pub(super) fn observe(&mut self, time: f64, interval: f64, known: &CraftEstimate, tuned: &CraftNumbers) {
        let alarm = known.monitor.alarm;
        if alarm {
            self.alarm_s += interval;
        }
        if alarm && !self.is_alarmed {
            self.alarms_at_s.push(time);
        }
        self.is_alarmed = alarm;
        if self.estimates.is_none() && LEARNT_AT_S <= time {
            let drift = (known.drift.mean, known.drift.variance.max(0.0).sqrt());
            self.estimates = Some([known.heading_lag(tuned), known.surge_lag(tuned), drift]);
        }
    }

    /// Time from the breakdown at `broke` s to the next start of an alarm, s; `None` without one.
    pub(super) fn noticed_after_s(&self, broke: f64) -> Option<f64> {
        let after = self.alarms_at_s.iter().map(|at| at - broke);
        after.into_iter().find(|after| 0.0 <= *after)
    }
}
