//! A Kalman filter of position and velocity, under a motion model.

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Matrix4x2, Vector2, Vector4};

use crate::{
    estimate::motion_model::{MotionModel, Transition},
    facts::{
        angle::ned_from_body,
        evidence::{GroundTrack, Report},
    },
    tuned::EstimateNumbers,
};

/// Standard deviation of an unknown velocity, m/s, along either axis. The largest accepted speed,
/// 10 m/s, is inside the gate: (10/3)² = 11.1 is less than 13.8. With a smaller one the track
/// of a fast vehicle without a reported speed would never start.
const UNKNOWN_SPEED_SIGMA: f64 = 3.0;

/// Mean and covariance of (north, east, north velocity, east velocity) at one time.
///
/// ```text
/// x ← F x    P ← F P Fᵀ + Q                             over a motion model
/// K = P Hᵀ (H P Hᵀ + R)⁻¹    x ← x + K (z − H x)    P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ
/// ```
/// Joseph's form of the covariance is a sum of squares, which rounding keeps positive definite.
/// Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and
/// Navigation*, 2001, sections 5.2 and 6.2.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kalman {
    pub(crate) time: f64,
    pub(crate) mean: Vector4<f64>,
    pub(crate) covariance: Matrix4<f64>,
}

impl Kalman {
    pub(crate) fn new(
        time: f64,
        position: &Vector2<f64>,
        velocity: &Vector2<f64>,
        covariance: &Matrix4<f64>,
    ) -> Self {
        let mean = Vector4::new(position.x, position.y, velocity.x, velocity.y);
        Self { time, mean, covariance: *covariance }
    }

    pub(crate) fn start(report: &Report, tuned: &EstimateNumbers) -> Self {
        let (position, velocity) = (report.sigma_m.powi(2), UNKNOWN_SPEED_SIGMA.powi(2));
        let variances = Vector4::new(position, position, velocity, velocity);
        let covariance = Matrix4::from_diagonal(&variances);
        let mut filter = Self::new(report.t_s, &report.position(), &Vector2::zeros(), &covariance);
        if let Some(track) = &report.ground_track() {
            filter.update(&Measurement::of_velocity(track, tuned));
        }
        filter
    }

    /// Updates with all of `report`, without a gate.
    #[cfg(test)]
    pub(crate) fn accept_ungated(&mut self, report: &Report) {
        *self = self.at(report.t_s, &EstimateNumbers::DEFAULT);
        if let Some(track) = &report.ground_track() {
            self.update(&Measurement::of_velocity(track, &EstimateNumbers::DEFAULT));
        }
        self.update(&Measurement::of_position(report));
    }

    /// The state at a later time, s, on a straight course.
    pub(crate) fn at(&self, time: f64, tuned: &EstimateNumbers) -> Self {
        let straight = MotionModel::Straight { density: tuned.acceleration_density };
        self.after(time, &straight)
    }

    /// The state at a later time, s, under a motion model.
    pub(crate) fn after(&self, time: f64, motion: &MotionModel) -> Self {
        let Transition { f, q } = motion.over(time - self.time);
        Self { time, mean: f * self.mean, covariance: symmetric(&(f * self.covariance * f.transpose() + q)) }
    }

    /// The same velocity at another position with a standard deviation `sigma`, m.
    pub(crate) fn found_at(&self, position: &Vector2<f64>, sigma: f64) -> Self {
        let mut found = self.clone();
        found.mean.fixed_rows_mut::<2>(0).copy_from(position);
        found.covariance.fixed_view_mut::<2, 2>(0, 2).fill(0.0);
        found.covariance.fixed_view_mut::<2, 2>(2, 0).fill(0.0);
        let variance = Matrix2::identity() * sigma.powi(2);
        found.covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&variance);
        found
    }

    pub(crate) fn position(&self) -> Vector2<f64> {
        self.mean.xy()
    }

    pub(crate) fn velocity(&self) -> Vector2<f64> {
        Vector2::new(self.mean.z, self.mean.w)
    }

    /// Sum of the variances along north and east, m².
    pub(crate) fn position_variance(&self) -> f64 {
        self.covariance[(0, 0)] + self.covariance[(1, 1)]
    }

    /// Mean square of the speed, (m/s)².
    pub(crate) fn mean_square_speed(&self) -> f64 {
        self.velocity().norm_squared() + self.covariance[(2, 2)] + self.covariance[(3, 3)]
    }

    /// Logarithm of the probability density of `measurement`, up to a constant.
    pub(crate) fn log_likelihood(&self, measurement: &Measurement) -> f64 {
        let (distance, spread) = self.mahalanobis(measurement);
        -0.5 * (distance + spread.ln())
    }

    /// Geometric mean of the innovation variances of `measurement`.
    pub(crate) fn innovation_variance(&self, measurement: &Measurement) -> f64 {
        self.mahalanobis(measurement).1.sqrt()
    }

    /// Squared Mahalanobis distance and determinant of the innovation covariance of a measurement.
    fn mahalanobis(&self, measurement: &Measurement) -> (f64, f64) {
        let Measurement { z, h, r } = measurement;
        let (y, s) = (z - h * self.mean, h * self.covariance * h.transpose() + r);
        (y.dot(&(inverse(&s) * y)), s.determinant())
    }

    pub(crate) fn update(&mut self, measurement: &Measurement) {
        let Measurement { z, h, r } = measurement;
        let p = &self.covariance;
        let gain: Matrix4x2<f64> = p * h.transpose() * inverse(&(h * p * h.transpose() + r));
        let kept = Matrix4::identity() - gain * h;
        self.mean += gain * (z - h * self.mean);
        self.covariance = symmetric(&(kept * p * kept.transpose() + gain * r * gain.transpose()));
    }
}

/// Two numbers z = H x + noise of covariance R.
pub(crate) struct Measurement {
    z: Vector2<f64>,
    h: Matrix2x4<f64>,
    r: Matrix2<f64>,
}

impl Measurement {
    pub(crate) fn of_position(report: &Report) -> Self {
        Self {
            z: report.position(),
            h: Matrix2x4::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
            r: Matrix2::identity() * report.sigma_m.powi(2),
        }
    }

    /// Normalised square of the innovation.
    pub(crate) fn normalised_square(&self, expected: &Kalman) -> f64 {
        expected.mahalanobis(self).0
    }

    pub(crate) fn square_distance(&self, expected: &Kalman) -> f64 {
        (self.z - self.h * expected.mean).norm_squared()
    }

    /// The speed errs along the course, speed and course across it.
    pub(crate) fn of_velocity(track: &GroundTrack, tuned: &EstimateNumbers) -> Self {
        let along = tuned.speed_sigma;
        let across = along.hypot(tuned.course_sigma * track.speed);
        let ned_from_course = ned_from_body(track.course.radians());
        let variances = Vector2::new(along.powi(2), across.powi(2));
        let r = ned_from_course * Matrix2::from_diagonal(&variances) * ned_from_course.transpose();
        Self {
            z: track.velocity(),
            h: Matrix2x4::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            r: (r + r.transpose()) * 0.5,
        }
    }
}

/// Removes the asymmetry of rounding.
fn symmetric(matrix: &Matrix4<f64>) -> Matrix4<f64> {
    (matrix + matrix.transpose()) * 0.5
}

fn inverse(s: &Matrix2<f64>) -> Matrix2<f64> {
    s.try_inverse().expect("a covariance of a measurement with errors is positive definite")
}
