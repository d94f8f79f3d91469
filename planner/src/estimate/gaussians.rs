//! What a cloud of particles leaves possible, as a few Gaussians, which the next request returns.
//!
//! ```text
//! (north, east, depth, north velocity, east velocity) = mean + L z,   z ~ N(0, I)
//! ```
//! One for each place and motion. Any numbers in the lower triangle of L make a covariance.

use nalgebra::{Matrix2, Matrix4, SMatrix, SVector, Vector2, Vector4};

use crate::{
    estimate::particles::{Cloud, Noise, Normals, Particle, VARIANCE_MIN},
    facts::{
        angle::direction,
        previous_plan::GaussianRow,
        ranges::{AUV_SPEED_MAX, DEPTH, FORESEEN},
    },
};

/// Largest number of a factor: twice a coordinate's.
const FACTOR_MAX: f64 = 4.0e6;

/// Share of the variance that is added, so that there is a factor.
const ROUNDING: f64 = 1e-12;

/// A possible motion at a possible place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaussian {
    pub(crate) weight: f64,
    /// `true` at the second of two places.
    pub(crate) is_second: bool,
    turns: bool,
    mean: SVector<f64, 5>,
    factor: SMatrix<f64, 5, 5>,
}

/// Rows and columns of a lower triangle.
fn lower() -> impl Iterator<Item = (usize, usize)> {
    (0..5).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

impl Gaussian {
    /// The Gaussians of `cloud`, in which a particle is at the second place if `is_second`.
    pub(crate) fn all(cloud: &Cloud, is_second: impl Fn(&Particle) -> bool) -> Vec<Self> {
        let kinds = [(false, false), (false, true), (true, false), (true, true)];
        let of_kind = |(second, turns)| {
            let is_part = |of: &&Particle| of.turns == turns && is_second(of) == second;
            let part: Vec<_> = cloud.particles.iter().filter(is_part).collect();
            Some(Self { is_second: second, turns, ..Self::of(&part)? })
        };
        kinds.into_iter().filter_map(of_kind).collect()
    }

    fn of(particles: &[&Particle]) -> Option<Self> {
        let weight = Some(particles.iter().map(|of| of.weight).sum()).filter(|sum: &f64| 0.0 < *sum)?;
        let state = |of: &Particle| {
            SVector::<f64, 5>::from([of.position.x, of.position.y, of.depth, of.velocity.x, of.velocity.y])
        };
        let weighted = |of: &&Particle| state(of) * (of.weight / weight);
        let mean: SVector<f64, 5> = particles.iter().map(weighted).sum();
        let covariance = particles.iter().map(|of| {
            let off = state(of) - mean;
            let own = SMatrix::from_diagonal(&SVector::from([0.0, 0.0, 0.0, of.variance, of.variance]));
            (off * off.transpose() + own) * (of.weight / weight)
        });
        let covariance: SMatrix<f64, 5, 5> = covariance.sum();
        let rounding = SMatrix::identity() * (VARIANCE_MIN + ROUNDING * covariance.trace());
        let factor = (covariance + rounding).cholesky()?.l();
        Some(Self { weight, is_second: false, turns: false, mean, factor })
    }

    /// The Gaussians of `rows`, if they are those of one vehicle.
    pub(crate) fn read(rows: &[GaussianRow]) -> Option<Vec<Self>> {
        let sum: f64 = rows.iter().map(|row| row[0]).sum();
        let is_whole = (1..=4).contains(&rows.len()) && (sum - 1.0).abs() < 1e-6;
        if is_whole { rows.iter().map(Self::from_row).collect() } else { None }
    }

    fn from_row(row: &GaussianRow) -> Option<Self> {
        let [weight, second, turns, numbers @ ..] = row;
        let (mean, numbers) = numbers.split_first_chunk::<5>()?;
        let [north, east, depth, velocity @ ..] = mean;
        let is_valid = (0.0..=1.0).contains(weight)
            && [north, east].into_iter().all(|along| FORESEEN.contains(along))
            && DEPTH.contains(depth)
            && velocity.iter().all(|along| along.abs() <= 2.0 * AUV_SPEED_MAX)
            && numbers.iter().all(|number| number.abs() <= FACTOR_MAX);
        let mut factor = SMatrix::zeros();
        for (number, place) in numbers.iter().zip(lower()) {
            factor[place] = *number;
        }
        let (is_second, turns) = (0.5 < *second, 0.5 < *turns);
        is_valid.then(|| Self { weight: *weight, is_second, turns, mean: (*mean).into(), factor })
    }

    /// Its numbers, as [`Self::read`] takes them.
    pub(crate) fn row(&self) -> GaussianRow {
        let flags = [self.is_second, self.turns].map(|flag| f64::from(u8::from(flag)));
        let numbers = lower().map(|place| self.factor[place]);
        let all = [self.weight].into_iter().chain(flags).chain(self.mean.iter().copied()).chain(numbers);
        let mut row = [0.0; 23];
        row.iter_mut().zip(all).for_each(|(to, number)| *to = number);
        row
    }

    pub(crate) fn position(&self) -> Vector2<f64> {
        Vector2::new(self.mean[0], self.mean[1])
    }

    pub(crate) fn depth(&self) -> f64 {
        self.mean[2]
    }

    /// Mean and covariance of position and velocity of all `parts`, of any sum of weights.
    pub(crate) fn moments<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> (Vector4<f64>, Matrix4<f64>) {
        let total: f64 = parts.clone().map(|of| of.weight).sum();
        let state = |of: &Self| Vector4::new(of.mean[0], of.mean[1], of.mean[3], of.mean[4]);
        let mean: Vector4<f64> = parts.clone().map(|of| state(of) * (of.weight / total)).sum();
        let covariance = parts.map(|of| {
            let own = (of.factor * of.factor.transpose()).remove_row(2).remove_column(2);
            let off = state(of) - mean;
            (own + off * off.transpose()) * (of.weight / total)
        });
        let sum: Matrix4<f64> = covariance.sum();
        (mean, (sum + sum.transpose()) * 0.5)
    }

    /// `count` particles of it by the noise of measurement `k`; equal variance stays with each.
    pub(crate) fn particles(
        &self,
        k: u64,
        count: usize,
        normals: &Normals,
    ) -> impl Iterator<Item = Particle> {
        let (mean, factor, turns) = (self.mean, self.factor, self.turns);
        let rest = factor.fixed_view::<2, 2>(3, 3);
        let rest: Matrix2<f64> = rest * rest.transpose();
        let (middle, half) = (0.5 * rest.trace(), 0.5 * (rest.m11 - rest.m22).hypot(2.0 * rest.m12));
        let longest = direction(0.5 * (2.0 * rest.m12).atan2(rest.m11 - rest.m22)) * (2.0 * half).sqrt();
        let (weight, variance) = (self.weight / count as f64, (middle - half).max(VARIANCE_MIN));
        (0..count).zip(0..).map(move |(_, i)| {
            let mut noise = Noise::new(k, i);
            let ([a, b], [c, d]) = (normals.pair(&mut noise), normals.pair(&mut noise));
            let at = mean + factor * SVector::from([a, b, c, 0.0, 0.0]);
            let velocity = Vector2::new(at[3], at[4]) + longest * d;
            Particle { weight, position: Vector2::new(at[0], at[1]), velocity, variance, depth: at[2], turns }
        })
    }
}
