//! Checks of AUV states and reports.

use nalgebra::Matrix4;
use serde_json::json;

use crate::facts::auv::Auv;
use crate::facts::evidence::{AuvState, Report};
use crate::facts::field_error::FieldError;
use crate::facts::ranges::{
    AUV_STATE, COVARIANCE, RANGE_FROM_WITHIN, REPORT, REPORT_AGE_MAX, REPORT_AHEAD_MAX, REPORT_RANGE,
    TELEMETRY, TRAVEL_TIME,
};
use crate::snapshot::check::Check;

/// Tolerance for a negative eigenvalue through rounding, relative to the largest element.
const COVARIANCE_ROUNDING: f64 = 1.0e-9;

const TOGETHER: &str = "give both course and speed, or neither";

impl Check {
    /// Checks AUV number `i` at time `now`, s.
    pub(crate) fn evidence(&mut self, i: usize, auv: &Auv, now: f64) {
        match (&auv.state, &auv.reports) {
            (Some(state), None) => self.state(i, state),
            (None, Some(reports)) => {
                for (j, report) in reports.iter().enumerate() {
                    self.report(&format!("/auvs/{i}/reports/{j}"), report, now);
                }
            }
            (None, None) => {
                let detail = "either `state` or `reports` must say where the vehicle is";
                self.fail(format_args!("/auvs/{i}/state"), "missing", detail);
            }
            (Some(_), Some(_)) => {
                let detail = "either `state` or `reports` says where the vehicle is, not both";
                self.fail(format_args!("/auvs/{i}/reports"), "unexpected", detail);
            }
        }
    }

    fn state(&mut self, i: usize, state: &AuvState) {
        let values = [
            state.north_m,
            state.east_m,
            state.depth_m,
            state.course_rad,
            state.speed_mps,
            state.turn_rate_radps,
            state.age_s,
        ];
        self.numbers(&format!("/auvs/{i}/state"), &AUV_STATE, values);
        if let Some(covariance) = state.covariance() {
            self.covariance(&format!("/auvs/{i}/state/covariance"), &covariance);
        }
    }

    pub(crate) fn report(&mut self, field: &str, report: &Report, now: f64) {
        match (report.course_rad, report.speed_mps) {
            (Some(_), None) => self.fail(format_args!("{field}/speed_mps"), "missing", TOGETHER),
            (None, Some(_)) => self.fail(format_args!("{field}/course_rad"), "missing", TOGETHER),
            (Some(_), Some(_)) | (None, None) => {}
        }
        // A `now` that is not finite is a fault of its own; here the report counts as from now.
        if now.is_finite() {
            let (given, range) = (report.t_s, now - REPORT_AGE_MAX..=now + REPORT_AHEAD_MAX);
            if !range.contains(&given) {
                let place = format_args!("{field}/t_s");
                let fault = FieldError::off_the_clock(place, given, "the request's `t_s`", now, &range);
                self.invalid.push(fault);
            }
        }
        self.place(field, report, now);
        let values = [report.north_m, report.east_m, report.range_m, Some(report.sigma_m)];
        self.given(field, &REPORT, values);
        if let Some(travel) = report.travel {
            let values = [Some(travel.time_s), travel.reply_delay_s, Some(travel.sound_speed_mps)];
            let before = self.invalid.len();
            self.given(&format!("{field}/travel"), &TRAVEL_TIME, values);
            let (range, within) = (travel.range(), REPORT_RANGE);
            if self.invalid.len() == before && !within.contains(&range) {
                let detail = format!(
                    "this time is a range of {range:.1} m; {} to {} m are accepted",
                    within.start(),
                    within.end()
                );
                self.fail(format_args!("{field}/travel/time_s"), "out_of_range", &detail);
            }
        }
        let telemetry = [report.depth_m, report.course_rad, report.speed_mps, report.turn_rate_radps];
        self.given(field, &TELEMETRY, telemetry);
    }

    /// A report has a position, or a range and the place from which it was measured.
    fn place(&mut self, field: &str, report: &Report, now: f64) {
        let position = [("north_m", report.north_m), ("east_m", report.east_m)];
        if report.range_m.is_some() && report.travel.is_some() {
            let detail = "a report has a `range_m` or the `travel` time, not both";
            self.fail(format_args!("{field}/travel"), "unexpected", detail);
        }
        let is_range = report.is_range();
        for (name, value) in position {
            match (is_range, value) {
                (false, None) => {
                    let detail = "a report has a position, a `range_m` or a `travel` time";
                    self.fail(format_args!("{field}/{name}"), "missing", detail);
                }
                (true, Some(_)) => {
                    let detail = "a range has no position: the place from which it was measured is `from`";
                    self.fail(format_args!("{field}/{name}"), "unexpected", detail);
                }
                (true, None) | (false, Some(_)) => {}
            }
        }
        match (is_range, report.from) {
            (true, Some(from)) => {
                for (axis, along) in from.into_iter().enumerate() {
                    self.within(format_args!("{field}/from/{axis}"), along, &REPORT[axis].1);
                }
            }
            (true, None) if (now - report.t_s).abs() <= RANGE_FROM_WITHIN => {}
            (true, None) => {
                let detail = format!(
                    "say from where the range was measured: where the craft was more than {RANGE_FROM_WITHIN} s from now is not known"
                );
                self.fail(format_args!("{field}/from"), "missing", &detail);
            }
            (false, Some(_)) => {
                self.fail(
                    format_args!("{field}/range_m"),
                    "missing",
                    "`from` belongs to a `range_m` or a `travel` time",
                );
            }
            (false, None) => {}
        }
    }

    fn covariance(&mut self, field: &str, covariance: &Matrix4<f64>) {
        let before = self.invalid.len();
        let rounding = COVARIANCE_ROUNDING * covariance.amax();
        for row in 0..4 {
            for column in 0..4 {
                let (value, mirrored) = (covariance[(row, column)], covariance[(column, row)]);
                let place = format_args!("{field}/{row}/{column}");
                self.within(place, value, &COVARIANCE);
                if column < row && value.is_finite() && mirrored.is_finite() {
                    let place = format_args!("{field}/{row}/{column}");
                    self.within(place, value, &(mirrored - rounding..=mirrored + rounding));
                }
            }
        }
        if self.invalid.len() == before {
            let least = covariance.symmetric_eigenvalues().min();
            if least < -rounding {
                let detail =
                    format!("not a covariance: its smallest eigenvalue is {least}, and must not be negative");
                let fault = FieldError::new(field, "negative_variance", detail).given(least);
                self.invalid.push(fault.limit(json!({ "least": 0 })));
            }
        }
    }
}
