//! Motion of a free vehicle between two reports, as linear Gaussian models.

use nalgebra::{Complex, Matrix2, Matrix4, Vector4};

use crate::tuned::EstimateNumbers;

/// A motion model, linear in positions and velocities.
///
/// ```text
/// v̇ = −a v + w    ṗ = v    E[w(t) w(τ)ᵀ] = q I δ(t − τ)
/// straight    a = 0              q = q₀ + q₁ s²
/// manoeuvre   a = s/ℓ − i ω      q = 2 s³ / ℓ
/// ```
/// with north + i east as complex numbers, speed s and reported rate of turn ω, or 0. Under the
/// manoeuvre a velocity decays over the distance ℓ towards any of that size: σ = s along either
/// axis. A constant-turn model is omitted: between two fixes a fast vehicle turns by more than half
/// a circle, and the rate is ambiguous. Source: the integrated Ornstein-Uhlenbeck process; Y.
/// Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
/// 2001, section 8.2 (Singer's model, one order lower).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum MotionModel {
    /// White acceleration of a density q, m²/s³.
    Straight {
        /// q.
        density: f64,
    },
    /// A velocity that decays and is renewed during a turn.
    Manoeuvre {
        /// s/ℓ, 1/s.
        forgetting: f64,
        /// ω, rad/s, positive clockwise.
        turn_rate: f64,
        /// Variance of a renewed velocity along either axis, m²/s².
        variance: f64,
    },
}

/// A motion model over an interval: `x ← F x`, `P ← F P Fᵀ + Q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transition {
    pub(crate) f: Matrix4<f64>,
    pub(crate) q: Matrix4<f64>,
}

/// Moments of a motion along either axis over an interval.
pub(crate) struct Moments {
    /// Distance per velocity, s.
    pub(crate) travelled: Complex<f64>,
    /// Kept share of the velocity.
    pub(crate) kept: Complex<f64>,
    /// Variances of the position, m², and of the velocity, m²/s².
    pub(crate) variances: [f64; 2],
    /// Their covariance, m²/s.
    pub(crate) correlation: Complex<f64>,
}

impl MotionModel {
    /// Straight motion at a speed, m/s.
    pub(crate) fn straight(speed: f64, tuned: &EstimateNumbers) -> Self {
        Self::Straight { density: tuned.straight_density + tuned.straight_density_of_speed * speed * speed }
    }

    /// A manoeuvre at a speed, m/s, above 0, with a rate of turn, rad/s, 0 if unknown.
    pub(crate) fn manoeuvre(speed: f64, turn_rate: f64, tuned: &EstimateNumbers) -> Self {
        Self::Manoeuvre { forgetting: speed / tuned.forgetting_length, turn_rate, variance: speed * speed }
    }

    /// The transition over `t` seconds.
    pub(crate) fn over(&self, t: f64) -> Transition {
        let Moments { travelled, kept, variances: [position, velocity], correlation } = self.moments(t);
        let mut f = Matrix4::identity();
        f.fixed_view_mut::<2, 2>(0, 2).copy_from(&turned(travelled));
        f.fixed_view_mut::<2, 2>(2, 2).copy_from(&turned(kept));
        let mut q = Matrix4::from_diagonal(&Vector4::new(position, position, velocity, velocity));
        q.fixed_view_mut::<2, 2>(0, 2).copy_from(&turned(correlation));
        q.fixed_view_mut::<2, 2>(2, 0).copy_from(&turned(correlation.conj()));
        Transition { f, q }
    }

    /// The same along one axis; without a turn rate the numbers are real.
    pub(crate) fn moments(&self, t: f64) -> Moments {
        match *self {
            Self::Straight { density: q } => Moments {
                travelled: t.into(),
                kept: 1.0.into(),
                variances: [q * t.powi(3) / 3.0, q * t],
                correlation: (0.5 * q * t * t).into(),
            },
            Self::Manoeuvre { forgetting, turn_rate, variance } => {
                let a = Complex::new(forgetting, -turn_rate);
                let q = 2.0 * variance * forgetting;
                let kept = (-a * t).exp();
                let travelled = (Complex::from(1.0) - kept) / a;
                // ∫ |exp(−a s)|² ds
                let decay = -(-2.0 * forgetting * t).exp_m1() / (2.0 * forgetting);
                // ∫ |(1 − exp(−a s)) / a|² ds; over a short time rounding dominates.
                let spread = ((t - 2.0 * travelled.re + decay) / a.norm_sqr()).max(0.0);
                let correlation = (travelled.conj() - decay) / a;
                Moments { travelled, kept, variances: [q * spread, q * decay], correlation: correlation * q }
            }
        }
    }
}

/// Multiplication by a complex number, as a matrix on (north, east).
fn turned(by: Complex<f64>) -> Matrix2<f64> {
    Matrix2::new(by.re, -by.im, by.im, by.re)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TUNED: &EstimateNumbers = &EstimateNumbers::DEFAULT;

    /// F and Q by integration of Ṗ = A P + P Aᵀ + Q̇ with the midpoint rule.
    fn integrated(model: &MotionModel, t: f64) -> Transition {
        let (a, q) = match *model {
            MotionModel::Straight { density } => (Matrix2::zeros(), density),
            MotionModel::Manoeuvre { forgetting, turn_rate, variance } => {
                (Matrix2::new(-forgetting, -turn_rate, turn_rate, -forgetting), 2.0 * variance * forgetting)
            }
        };
        let mut drift = Matrix4::zeros();
        drift.fixed_view_mut::<2, 2>(0, 2).fill_with_identity();
        drift.fixed_view_mut::<2, 2>(2, 2).copy_from(&a);
        let noise = Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, q, q));
        let steps = 20_000;
        let h = t / f64::from(steps);
        let (mut f, mut p) = (Matrix4::identity(), Matrix4::zeros());
        for _ in 0..steps {
            let slope = |p: &Matrix4<f64>| drift * p + p * drift.transpose() + noise;
            let middle = p + slope(&p) * (0.5 * h);
            p += slope(&middle) * h;
            f += drift * (f + drift * f * (0.5 * h)) * h;
        }
        Transition { f, q: p }
    }

    #[test]
    fn the_closed_forms_agree_with_integrated_moments() {
        for model in [
            MotionModel::straight(0.9, TUNED),
            MotionModel::manoeuvre(0.2, 0.02, TUNED),
            MotionModel::manoeuvre(0.9, -0.09, TUNED),
            MotionModel::manoeuvre(3.0, 0.0, TUNED),
        ] {
            for t in [0.5, 10.0, 60.0] {
                let (closed, stepped) = (model.over(t), integrated(&model, t));
                // Error of the midpoint rule: (|a| h)² of at most 2e-7, times the 60 s.
                assert!((closed.f - stepped.f).amax() < 1e-5 * stepped.f.amax());
                assert!((closed.q - stepped.q).amax() < 1e-5 * stepped.q.amax(), "{model:?}");
            }
        }
    }

    #[test]
    fn a_brief_manoeuvre_is_white_acceleration() {
        let (speed, t) = (0.9_f64, 1e-2);
        let short = MotionModel::manoeuvre(speed, 0.05, TUNED).over(t).q;
        let density = 2.0 * speed.powi(3) / TUNED.forgetting_length;
        let white = MotionModel::Straight { density }.over(t).q;
        // The first neglected term is of relative size t s/ℓ, 4.5e-4; rounding is far less.
        assert!((short[(2, 2)] / white[(2, 2)] - 1.0).abs() < 1e-3);
        assert!((short[(0, 2)] / white[(0, 2)] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_long_manoeuvre_leaves_any_velocity_of_its_size() {
        let transition = MotionModel::manoeuvre(0.7, 0.1, TUNED).over(1.0e4);
        assert!((transition.q[(2, 2)] - 0.49).abs() < 1e-12 && transition.f[(2, 2)].abs() < 1e-12);
    }
}
