//! A Kalman filter for a vehicle that goes straight on, but for small random accelerations.

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Matrix4x2, Vector2, Vector4};

use super::track::Filter;
use crate::{
    angle::ned_from_body,
    snapshot::{GroundTrack, Report},
};

/// Spectral density of the white acceleration along north and along east, m²/s³.
///
/// Tuned on simulated lawn-mowers (0.193 m/s, turns of 10 m radius, a fix of σ 1.5 m every 10 s, 30 % lost, six seeds):
/// the forecast is off by 1.09 m now and 1.63 m half a minute ahead, root mean square; from 1e-4 to 1e-3 m²/s³ it is
/// off by 1.06 to 1.23 m and 1.59 to 1.80 m.
pub(super) const ACCELERATION_DENSITY: f64 = 2.0e-4;

/// Standard deviation of a velocity of which nothing is known, m/s, along either axis.
///
/// The fastest vehicle that a snapshot accepts, 10 m/s, is inside its gate: (10/3)² = 11.1 is less than
/// [`GATE`]. A smaller one would never take up the track of a fast vehicle that tells no speed.
const UNKNOWN_SPEED_SIGMA: f64 = 3.0;

/// Standard deviation of a telemetered speed, m/s. Assumption: a Doppler log or a thruster model, quantised, and what
/// the speed of a sawtooth differs from its mean over a few seconds.
const SPEED_SIGMA: f64 = 0.03;

/// Standard deviation of a telemetered course, rad. Assumption: 3°, a micro-mechanical compass under water and the
/// vehicle's own guess of its drift.
const COURSE_SIGMA: f64 = 0.05;

/// Largest squared Mahalanobis distance with which a measurement of two numbers is believed: the 99.9 % quantile of χ²
/// with two degrees of freedom, −2 ln 0.001.
pub(super) const GATE: f64 = 13.815_510_557_964_274;

/// Mean and covariance of (north, east, north velocity, east velocity) at one time.
///
/// ```text
/// ẋ = [v; w]    E[w(t) w(τ)ᵀ] = q I δ(t − τ)
/// F = [I, t I; 0, I]    Q = q [t³/3 I, t²/2 I; t²/2 I, t I]
/// K = P Hᵀ (H P Hᵀ + R)⁻¹    x ← x + K (z − H x)    P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ
/// ```
/// Joseph's form of the covariance: a sum of squares stays positive definite in rounding.
/// Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
/// sections 5.2 and 6.2.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kalman {
    time: f64,
    mean: Vector4<f64>,
    covariance: Matrix4<f64>,
}

impl Kalman {
    pub(super) fn new(
        time: f64,
        position: &Vector2<f64>,
        velocity: &Vector2<f64>,
        covariance: &Matrix4<f64>,
    ) -> Self {
        Self {
            time,
            mean: Vector4::new(position.x, position.y, velocity.x, velocity.y),
            covariance: *covariance,
        }
    }

    /// From a report alone.
    pub(super) fn start(report: &Report) -> Self {
        let (position, velocity) = (report.sigma.powi(2), UNKNOWN_SPEED_SIGMA.powi(2));
        let variances = Vector4::new(position, position, velocity, velocity);
        let mut filter = Self {
            time: report.time,
            mean: Vector4::new(report.position.x, report.position.y, 0.0, 0.0),
            covariance: Matrix4::from_diagonal(&variances),
        };
        if let Some(track) = &report.ground_track {
            filter.update(&Measurement::of_velocity(track));
        }
        filter
    }

    /// Takes `report` in whatever it says.
    #[cfg(test)]
    pub(super) fn accept_blindly(&mut self, report: &Report) {
        *self = self.at(report.time);
        if let Some(track) = &report.ground_track {
            self.update(&Measurement::of_velocity(track));
        }
        self.update(&Measurement::of_position(report));
    }

    /// The same at a later time, s.
    pub(super) fn at(&self, time: f64) -> Self {
        let t = time - self.time;
        let blocks = |pp: f64, pv: f64, vp: f64, vv: f64| {
            Matrix4::new(
                pp, 0.0, pv, 0.0, //
                0.0, pp, 0.0, pv, //
                vp, 0.0, vv, 0.0, //
                0.0, vp, 0.0, vv,
            )
        };
        let f = blocks(1.0, t, 0.0, 1.0);
        let q = blocks(t.powi(3) / 3.0, 0.5 * t * t, 0.5 * t * t, t) * ACCELERATION_DENSITY;
        Self {
            time,
            mean: f * self.mean,
            covariance: symmetric(&(f * self.covariance * f.transpose() + q)),
        }
    }

    pub(super) fn time(&self) -> f64 {
        self.time
    }

    pub(super) fn position(&self) -> Vector2<f64> {
        self.mean.xy()
    }

    pub(super) fn velocity(&self) -> Vector2<f64> {
        Vector2::new(self.mean.z, self.mean.w)
    }

    pub(super) fn covariance(&self) -> &Matrix4<f64> {
        &self.covariance
    }

    /// Sum of the variances along north and east, m².
    pub(super) fn position_variance(&self) -> f64 {
        self.covariance[(0, 0)] + self.covariance[(1, 1)]
    }

    fn believes(&self, measurement: &Measurement) -> bool {
        let Measurement { z, h, r } = measurement;
        let (y, s) = (z - h * self.mean, h * self.covariance * h.transpose() + r);
        y.dot(&(inverse(&s) * y)) <= GATE
    }

    fn update(&mut self, measurement: &Measurement) {
        let Measurement { z, h, r } = measurement;
        let p = &self.covariance;
        let gain: Matrix4x2<f64> = p * h.transpose() * inverse(&(h * p * h.transpose() + r));
        let kept = Matrix4::identity() - gain * h;
        self.mean += gain * (z - h * self.mean);
        self.covariance = symmetric(&(kept * p * kept.transpose() + gain * r * gain.transpose()));
    }
}

impl Filter for Kalman {
    /// A velocity outside its own gate is left out.
    ///
    /// The velocity comes first: it tells where the vehicle went since the last report, and so what position to
    /// believe. The other way round, an outlier after a long gap would be taken for a fast vehicle, and what the
    /// vehicle then says of its speed for a mistake.
    fn accept(&mut self, report: &Report) -> bool {
        let mut then = self.at(report.time);
        if let Some(track) = &report.ground_track {
            let velocity = Measurement::of_velocity(track);
            if then.believes(&velocity) {
                then.update(&velocity);
            }
        }
        let position = Measurement::of_position(report);
        let believed = then.believes(&position);
        if believed {
            then.update(&position);
            *self = then;
        }
        believed
    }
}

/// Two numbers z = H x + noise of covariance R.
struct Measurement {
    z: Vector2<f64>,
    h: Matrix2x4<f64>,
    r: Matrix2<f64>,
}

impl Measurement {
    fn of_position(report: &Report) -> Self {
        Self {
            z: report.position,
            h: Matrix2x4::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
            r: Matrix2::identity() * report.sigma.powi(2),
        }
    }

    /// Along the course the speed errs, across it the course too.
    fn of_velocity(track: &GroundTrack) -> Self {
        let (along, across) = (SPEED_SIGMA, SPEED_SIGMA.hypot(COURSE_SIGMA * track.speed));
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

/// What rounding left unsymmetric, made so.
fn symmetric(matrix: &Matrix4<f64>) -> Matrix4<f64> {
    (matrix + matrix.transpose()) * 0.5
}

fn inverse(s: &Matrix2<f64>) -> Matrix2<f64> {
    s.try_inverse()
        .expect("a covariance of a measurement with errors is positive definite")
}
