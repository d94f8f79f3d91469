//! A filter for a vehicle that follows a path which is known.

use nalgebra::{Matrix2, Matrix4, Vector2};

use crate::{
    estimate::{
        kalman::GATE,
        track::{Filter, Innovation},
    },
    facts::{
        angle::{Course, direction, ned_from_body},
        evidence::{AuvState, Report},
        known_path::{KnownPath, place_on_path, speed_along},
        path::piece::PathPoint,
    },
};

/// Spread of the place along the path beside what the speed's error does to it, m²/s. The surges of a sawtooth's
/// reversals, 0.4 m each, two in a cycle of 200 s, make 0.0016.
const ALONG_DENSITY: f64 = 0.002;

/// Standard deviation of the speed along the path from the one that it is known to have, m/s. Assumption: a current
/// that is not known, or known elsewhere.
const SPEED_SIGMA: f64 = 0.05;

/// Spread of that difference, (m/s)²/s: between still water and an unknown current, see
/// `docs/rationale.md#estimating-the-auvs`.
const SPEED_DENSITY: f64 = 1.0e-5;

/// Standard deviation of the distance from the path at the first report, m. Assumption: vehicles begin some metres off.
const OFFSET_SIGMA: f64 = 5.0;

/// Spread of that distance, m²/s. Assumption: followers come back to their path, or go to their steady offset in a
/// current, by a metre in five minutes.
const OFFSET_DENSITY: f64 = 0.002;

/// Standard deviation of the velocity across the path, m/s: the offset's spread over ten seconds, by ten seconds.
const ACROSS_SIGMA: f64 = 0.014;

/// Standard deviation of a telemetered speed along the path, m/s: that of a moment, which may be a sawtooth's reversal.
/// Half of what the reversal adds, 0.1 m/s; see `docs/rationale.md#estimating-the-auvs`.
const TELEMETRY_SIGMA: f64 = 0.05;

/// Longest step in which the place along the path is carried on, s: at 0.3 m/s and 10 m radius a turn of 0.15 rad.
const STEP_MAX: f64 = 5.0;

/// Most steps between two reports: a quarter of an hour, after which no goal rests on the earlier one. Across a longer
/// silence steps are longer, so that no list of reports takes long to filter.
const STEPS_MAX: f64 = 180.0;

/// Place along a path, error of the speed along it, and distance from it.
///
/// ```text
/// γ̇ = u_P(γ) + b + w_s    ḃ = w_b    ẏ₁ = w_y        (γ, y₁) measured, each with the fix's σ
/// ```
/// u_P is the speed over ground that the known speed and current give. A fix is measured in the frame of the tangent at
/// the predicted place; that the foot of a vehicle off an arc is faster or slower than the vehicle is left to b and w_s.
#[derive(Clone, Debug)]
pub(crate) struct OnPath<'a> {
    known: &'a KnownPath,
    current: Vector2<f64>,
    time: f64,
    /// Place γ along the path, m.
    gamma: f64,
    /// b, m/s.
    bias: f64,
    /// Covariance of (γ, b).
    along: Matrix2<f64>,
    /// y₁, m, positive to starboard.
    offset: f64,
    offset_variance: f64,
}

impl<'a> OnPath<'a> {
    /// From a report alone.
    pub(crate) fn start(report: &Report, known: &'a KnownPath, current: &Vector2<f64>) -> Self {
        let track = report.ground_track();
        // At rest it has no course, and without telemetry none that is known.
        let course = track.map_or(Course::new(0.0), |track| track.course);
        let speed = track.map_or(0.0, |track| track.speed);
        let there = AuvState::new(report.position(), 0.0, course, speed);
        let mut filter = Self {
            known,
            current: *current,
            time: report.t_s,
            gamma: place_on_path(&there, known, current),
            bias: 0.0,
            along: Matrix2::new(report.sigma_m.powi(2), 0.0, 0.0, SPEED_SIGMA.powi(2)),
            offset: 0.0,
            offset_variance: OFFSET_SIGMA.powi(2),
        };
        let (_, across) = filter.errors(report);
        filter.update_offset(across, report.sigma_m.powi(2));
        filter
    }

    pub(crate) fn time(&self) -> f64 {
        self.time
    }

    /// Cross-track offset y₁, m, positive to starboard.
    pub(crate) fn offset(&self) -> f64 {
        self.offset
    }

    pub(crate) fn position(&self) -> Vector2<f64> {
        let point = self.point();
        point.position + ned_from_body(point.tangent) * Vector2::new(0.0, self.offset)
    }

    pub(crate) fn velocity(&self) -> Vector2<f64> {
        let point = self.point();
        direction(point.tangent) * (self.speed_at(point.tangent) * (1.0 - point.curvature * self.offset))
    }

    /// Covariance of (north, east, north velocity, east velocity).
    pub(crate) fn covariance(&self) -> Matrix4<f64> {
        let (s, across) = (&self.along, ACROSS_SIGMA.powi(2));
        let in_path_frame = Matrix4::new(
            s[(0, 0)],
            0.0,
            s[(0, 1)],
            0.0, //
            0.0,
            self.offset_variance,
            0.0,
            0.0, //
            s[(1, 0)],
            0.0,
            s[(1, 1)],
            0.0, //
            0.0,
            0.0,
            0.0,
            across,
        );
        let turn = ned_from_body(self.point().tangent);
        let mut ned_from_path = Matrix4::zeros();
        ned_from_path.fixed_view_mut::<2, 2>(0, 0).copy_from(&turn);
        ned_from_path.fixed_view_mut::<2, 2>(2, 2).copy_from(&turn);
        let covariance = ned_from_path * in_path_frame * ned_from_path.transpose();
        (covariance + covariance.transpose()) * 0.5
    }

    fn point(&self) -> PathPoint {
        self.known.path.at(self.gamma)
    }

    /// Speed over ground along a tangent, m/s.
    fn speed_at(&self, tangent: f64) -> f64 {
        speed_along(self.known.horizontal_speed, &self.current, tangent) + self.bias
    }

    /// The same at a later time, s.
    fn at(&self, time: f64) -> Self {
        let mut then = self.clone();
        let t = time - self.time;
        let steps = (t / STEP_MAX).ceil().min(STEPS_MAX);
        let step = if steps > 0.0 { t / steps } else { 0.0 };
        let mut done = 0.0;
        while done < steps {
            // Half a step first: the speed in the middle of the step, to second order.
            let start = then.gamma;
            then.gamma += 0.5 * step * then.speed_at(then.point().tangent);
            then.gamma = start + step * then.speed_at(then.point().tangent);
            done += 1.0;
        }
        let f = Matrix2::new(1.0, t, 0.0, 1.0);
        let (q_s, q_b) = (ALONG_DENSITY, SPEED_DENSITY);
        let q = Matrix2::new(
            q_s * t + q_b * t.powi(3) / 3.0,
            0.5 * q_b * t * t,
            0.5 * q_b * t * t,
            q_b * t,
        );
        then.along = f * self.along * f.transpose() + q;
        then.offset_variance += OFFSET_DENSITY * t;
        then.time = time;
        then
    }

    /// How far a fix is ahead of the place, and how far to starboard of the path, m.
    fn errors(&self, report: &Report) -> (f64, f64) {
        let point = self.point();
        let error = ned_from_body(point.tangent).transpose() * (report.position() - point.position);
        (error.x, error.y)
    }

    fn update_offset(&mut self, across: f64, variance: f64) {
        let gain = self.offset_variance / (self.offset_variance + variance);
        self.offset += gain * (across - self.offset);
        self.offset_variance *= 1.0 - gain;
    }

    /// Takes in that `measured` · (γ, b) is more by `excess` than taken for so. Joseph's form, as in
    /// [`super::kalman::Kalman`].
    fn update_along(&mut self, measured: &Vector2<f64>, excess: f64, variance: f64) {
        let p = &self.along;
        let gain = p * measured / (measured.dot(&(p * measured)) + variance);
        let kept = Matrix2::identity() - gain * measured.transpose();
        let along = kept * p * kept.transpose() + gain * gain.transpose() * variance;
        self.along = (along + along.transpose()) * 0.5;
        self.gamma += gain.x * excess;
        self.bias += gain.y * excess;
    }
}

impl Filter for OnPath<'_> {
    fn accept(&mut self, report: &Report) -> Innovation {
        let mut then = self.at(report.t_s);
        let (ahead, across) = then.errors(report);
        let variance = report.sigma_m.powi(2);
        let variances = (then.along[(0, 0)] + variance, then.offset_variance + variance);
        let distance = ahead.powi(2) / variances.0 + (across - then.offset).powi(2) / variances.1;
        let mean_variance = (variances.0 * variances.1).sqrt();
        let accepted = distance <= GATE;
        if accepted {
            then.update_along(&Vector2::new(1.0, 0.0), ahead, variance);
            if let Some(track) = &report.ground_track() {
                let tangent = then.point().tangent;
                let excess = track.velocity().dot(&direction(tangent)) - then.speed_at(tangent);
                then.update_along(&Vector2::new(0.0, 1.0), excess, TELEMETRY_SIGMA.powi(2));
            }
            then.update_offset(across, variance);
            *self = then;
        }
        Innovation {
            accepted,
            normalised: distance,
            density: (-0.5 * distance).exp() / (std::f64::consts::TAU * mean_variance),
            square: ahead.powi(2) + (across - self.offset).powi(2),
            variance: mean_variance,
        }
    }

    fn found_at(&self, report: &Report) -> Self {
        Self::start(report, self.known, &self.current)
    }
}
