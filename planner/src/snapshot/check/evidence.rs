//! What is known of where an AUV is, checked.

use nalgebra::Matrix4;

use crate::{
    facts::{
        evidence::{AuvState, Evidence, Report},
        invalid_field::InvalidReason,
        ranges::{COORDINATE_MAX, REPORT_AGE_MAX, REPORT_AHEAD_MAX, REPORT_SIGMA_MIN, REPORTS_MAX},
    },
    snapshot::check::Check,
};

/// Largest, m: beyond it a fix says nothing.
const REPORT_SIGMA_MAX: f64 = 1.0e4;

/// Largest element of a covariance, in m², m²/s or m²/s².
const COVARIANCE_MAX: f64 = 1.0e10;

/// By how much a covariance may fall short of one through rounding, relative to its largest element.
const COVARIANCE_ROUNDING: f64 = 1.0e-9;

const HALF_TURN: f64 = std::f64::consts::PI;

impl Check {
    /// Of AUV number `i`, declared at time `now`, s.
    pub(crate) fn evidence(&mut self, i: usize, evidence: &Evidence, now: f64) {
        match evidence {
            Evidence::State(state) => self.state(i, state),
            Evidence::Reports(reports) => {
                self.length(format_args!("auvs/{i}/reports"), reports.len(), 1..=REPORTS_MAX);
                for (j, report) in reports.iter().enumerate() {
                    self.report(&format!("auvs/{i}/reports/{j}"), report, now);
                }
            }
        }
    }

    fn state(&mut self, i: usize, state: &AuvState) {
        for (name, value, range) in [
            ("north_m", state.position.x, -COORDINATE_MAX..=COORDINATE_MAX),
            ("east_m", state.position.y, -COORDINATE_MAX..=COORDINATE_MAX),
            ("depth_m", state.depth, -10.0..=12_000.0),
            ("course_rad", state.course.radians(), -HALF_TURN..=HALF_TURN),
            ("speed_mps", state.speed, 0.0..=10.0),
            ("turn_rate_radps", state.turn_rate, -1.0..=1.0),
            ("age_s", state.age, 0.0..=REPORT_AGE_MAX),
        ] {
            self.within(format_args!("auvs/{i}/state/{name}"), value, range);
        }
        if let Some(covariance) = &state.covariance {
            self.covariance(&format!("auvs/{i}/state/covariance"), covariance);
        }
    }

    fn report(&mut self, field: &str, report: &Report, now: f64) {
        // Where now is no number, that is said; here everything counts as from now.
        if now.is_finite() {
            let (given, least, most) = (report.time, now - REPORT_AGE_MAX, now + REPORT_AHEAD_MAX);
            if !(least..=most).contains(&given) {
                let reason = InvalidReason::OffTheClock {
                    given,
                    now,
                    least,
                    most,
                };
                self.fail(format_args!("{field}/t_s"), reason);
            }
        }
        for (name, value, range) in [
            ("north_m", report.position.x, -COORDINATE_MAX..=COORDINATE_MAX),
            ("east_m", report.position.y, -COORDINATE_MAX..=COORDINATE_MAX),
            ("sigma_m", report.sigma, REPORT_SIGMA_MIN..=REPORT_SIGMA_MAX),
        ] {
            self.within(format_args!("{field}/{name}"), value, range);
        }
        let track = report.ground_track;
        for (name, value, range) in [
            ("depth_m", report.depth, -10.0..=12_000.0),
            (
                "course_rad",
                track.map(|track| track.course.radians()),
                -HALF_TURN..=HALF_TURN,
            ),
            ("speed_mps", track.map(|track| track.speed), 0.0..=10.0),
            ("turn_rate_radps", report.turn_rate, -1.0..=1.0),
        ] {
            if let Some(value) = value {
                self.within(format_args!("{field}/{name}"), value, range);
            }
        }
    }

    fn covariance(&mut self, field: &str, covariance: &Matrix4<f64>) {
        let before = self.invalid.len();
        let rounding = COVARIANCE_ROUNDING * covariance.amax();
        for row in 0..4 {
            for column in 0..4 {
                let (value, mirrored) = (covariance[(row, column)], covariance[(column, row)]);
                let place = format_args!("{field}/{row}/{column}");
                self.within(place, value, -COVARIANCE_MAX..=COVARIANCE_MAX);
                if column < row && value.is_finite() && mirrored.is_finite() {
                    let place = format_args!("{field}/{row}/{column}");
                    self.within(place, value, mirrored - rounding..=mirrored + rounding);
                }
            }
        }
        if self.invalid.len() == before {
            let least = covariance.symmetric_eigenvalues().min();
            if least < -rounding {
                let reason = InvalidReason::NegativeVariance { given: least };
                self.fail(format_args!("{field}"), reason);
            }
        }
    }
}
