//! What the planner learnt of its craft, and its alarms.

use serde::Serialize;

use super::data::Data;
use crate::campaign::{
    rows::LEARNT,
    statistics::student::{median, quantile},
};

/// The two-sided 95 % point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;
const SECONDS_PER_HOUR: f64 = 3_600.0;

/// An estimate of the planner beside step tests of the craft.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Estimated {
    pub(super) controller: String,
    /// The column of the estimates.
    pub(super) quantity: &'static str,
    pub(super) n_runs: usize,
    /// Absolute error, s: median and 90th percentile.
    pub(super) error_median_s: f64,
    pub(super) error_90_s: f64,
    /// Share of the runs whose 95 % interval contains the step test.
    pub(super) held: f64,
}

/// Alarms of a planner that the craft does not follow.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Alarms {
    pub(super) controller: String,
    pub(super) n_runs: usize,
    /// Whether something breaks in its runs.
    pub(super) breaks: bool,
    /// Alarms per hour of missions.
    pub(super) per_hour: f64,
    /// Share of the runs with an alarm.
    pub(super) alarmed: f64,
    /// Runs with a new alarm after the breakdown, and the delay, s: median and longest.
    pub(super) n_noticed: usize,
    pub(super) noticed_after_median_s: Option<f64>,
    pub(super) noticed_after_worst_s: Option<f64>,
}

#[expect(clippy::cast_precision_loss, reason = "millions of runs, not 2⁵³")]
fn share(part: usize, of: usize) -> f64 {
    part as f64 / of as f64
}

impl Data<'_> {
    pub(super) fn estimated(&self) -> Vec<Estimated> {
        let planners = self.campaign.controllers.iter();
        let all = planners.flat_map(|controller| {
            LEARNT.map(|[quantity, sigma, tested]| {
                let rows = self.runs.of_controller(&controller.name, quantity).into_iter();
                let found: Vec<(f64, f64)> = rows
                    .filter_map(|(_, row)| {
                        let value = |name| self.runs.value(name, row);
                        Some(((value(quantity)? - value(tested)?).abs(), value(sigma)?))
                    })
                    .collect();
                let errors: Vec<f64> = found.iter().map(|(error, _)| *error).collect();
                let held = found.iter().filter(|(error, sigma)| *error <= Z * sigma).count();
                Some(Estimated {
                    controller: controller.name.clone(),
                    quantity,
                    n_runs: found.len(),
                    error_median_s: median(&errors)?,
                    error_90_s: quantile(&errors, 0.9)?,
                    held: share(held, found.len()),
                })
            })
        });
        all.flatten().collect()
    }

    pub(super) fn alarms(&self) -> Vec<Alarms> {
        let planners = self.campaign.controllers.iter();
        let all = planners.filter_map(|controller| {
            let rows = self.runs.of_controller(&controller.name, "alarms").into_iter();
            let counted: Vec<(f64, f64, Option<f64>)> = rows
                .filter_map(|(_, row)| {
                    let value = |name| self.runs.value(name, row);
                    Some((value("alarms")?, value("duration_s")?, value("noticed_after_s")))
                })
                .collect();
            if counted.is_empty() {
                return None;
            }
            let alarms: f64 = counted.iter().map(|(alarms, ..)| alarms).sum();
            let seconds: f64 = counted.iter().map(|(_, seconds, _)| seconds).sum();
            let noticed: Vec<f64> = counted.iter().filter_map(|(.., after)| *after).collect();
            Some(Alarms {
                controller: controller.name.clone(),
                n_runs: counted.len(),
                breaks: controller.breaks_at().is_some(),
                per_hour: alarms * SECONDS_PER_HOUR / seconds,
                alarmed: share(
                    counted.iter().filter(|(alarms, ..)| 0.0 < *alarms).count(),
                    counted.len(),
                ),
                n_noticed: noticed.len(),
                noticed_after_median_s: median(&noticed),
                noticed_after_worst_s: noticed.into_iter().reduce(f64::max),
            })
        });
        all.collect()
    }
}
