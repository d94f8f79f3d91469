//! A first-order Gauss–Markov velocity: the current's slow fluctuation about its mean.

use nalgebra::Vector2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Statistics of the fluctuation, for each of its two components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussMarkov {
    /// Standard deviation σ of each component, m/s.
    pub sigma: f64,
    /// Time after which the autocorrelation has fallen to 1/e, s.
    pub correlation_time: f64,
}

/// The fluctuation, discretised exactly, so that its statistics do not depend on the step:
///
/// ```text
/// x⁺ = e^(−Δt/T) x + σ √(1 − e^(−2Δt/T)) n,   n ~ N(0, 1),   x(0) ~ N(0, σ²)
/// ```
#[derive(Clone, Debug)]
pub(super) struct Fluctuation {
    setup: GaussMarkov,
    /// x (north, east), m/s.
    velocity: Vector2<f64>,
    rng: ChaCha8Rng,
}

impl Fluctuation {
    /// Begins in the stationary distribution.
    pub(super) fn new(setup: GaussMarkov, mut rng: ChaCha8Rng) -> Self {
        let velocity = setup.sigma * normal_pair(&mut rng);
        Self { setup, velocity, rng }
    }

    /// The present fluctuation (north, east), m/s.
    pub(super) fn velocity(&self) -> Vector2<f64> {
        self.velocity
    }

    /// Advances by `period` s.
    pub(super) fn step(&mut self, period: f64) {
        let GaussMarkov { sigma, correlation_time } = self.setup;
        let elapsed = period / correlation_time;
        // expm1 keeps the digits that 1 − exp loses over steps far shorter than T.
        let fresh = sigma * (-(-2.0 * elapsed).exp_m1()).sqrt();
        self.velocity = (-elapsed).exp() * self.velocity + fresh * normal_pair(&mut self.rng);
    }
}

fn normal_pair(rng: &mut ChaCha8Rng) -> Vector2<f64> {
    let north = rng.sample(StandardNormal);
    Vector2::new(north, rng.sample(StandardNormal))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const SETUP: GaussMarkov = GaussMarkov { sigma: 0.07, correlation_time: 10.0 };
    /// Bounds in standard deviations of the estimate: 1 in 16 000 is missed by chance.
    const CONFIDENCE: f64 = 4.0;

    fn run(period: f64, steps: u32) -> Vec<Vector2<f64>> {
        let mut fluctuation = Fluctuation::new(SETUP, ChaCha8Rng::seed_from_u64(11));
        (0..steps)
            .map(|_| {
                fluctuation.step(period);
                fluctuation.velocity()
            })
            .collect()
    }

    /// Mean over a run of x(t) · x(t + lag), both components together.
    fn autocovariance(run: &[Vector2<f64>], lag: usize) -> f64 {
        let products = run.iter().zip(&run[lag..]).map(|(x, later)| x.dot(later));
        let (n, sum) = products.fold((0.0, 0.0), |(n, sum), product| (n + 2.0, sum + product));
        sum / n
    }

    #[test]
    fn variance_and_autocorrelation_do_not_depend_on_the_step() {
        let variance_asked = SETUP.sigma.powi(2);
        for (period, steps) in [(0.1, 2_000_000), (1.0, 200_000), (5.0, 200_000), (30.0, 100_000)] {
            let run = run(period, steps);
            let n = 2.0 * f64::from(steps);
            let phi = (-period / SETUP.correlation_time).exp();
            let lag = (SETUP.correlation_time / period).round().max(1.0);
            // Sampling errors of an AR(1) process with known mean: Bartlett's formulae (Priestley,
            // Spectral Analysis and Time Series, 1981, section 5.3).
            let (phi2, phi2k) = (phi.powi(2), phi.powf(2.0 * lag));
            let variance_error = (2.0 / n * (1.0 + phi2) / (1.0 - phi2)).sqrt();
            let correlation_error =
                ((1.0 + phi2) * (1.0 - phi2k) / (1.0 - phi2) - 2.0 * lag * phi2k).sqrt() / n.sqrt();

            let variance = autocovariance(&run, 0);
            let off = variance / variance_asked - 1.0;
            assert!(off.abs() < CONFIDENCE * variance_error, "{period} s: {off}");
            #[expect(clippy::cast_possible_truncation, reason = "a small count")]
            let correlation = autocovariance(&run, lag as usize) / variance;
            let off = correlation - (-lag * period / SETUP.correlation_time).exp();
            assert!(off.abs() < CONFIDENCE * correlation_error, "{period} s: {off}");
            // The bounds themselves are tight: 3 % at most.
            assert!(CONFIDENCE * variance_error.max(correlation_error) < 0.03);
        }
    }

    #[test]
    fn a_fluctuation_begins_stationary_with_independent_components() {
        let n_starts = 20_000_u32;
        let starts: Vec<_> = (0..n_starts)
            .map(|seed| Fluctuation::new(SETUP, ChaCha8Rng::seed_from_u64(seed.into())).velocity())
            .collect();
        // Relative error of a variance from n numbers √(2/n); of a correlation 1/√n.
        let n = f64::from(n_starts);
        let mean_of =
            |f: fn(&Vector2<f64>) -> f64| starts.iter().map(f).sum::<f64>() / n / SETUP.sigma.powi(2);
        for off in [mean_of(|x| x.x * x.x) - 1.0, mean_of(|x| x.y * x.y) - 1.0] {
            assert!(off.abs() < CONFIDENCE * (2.0 / n).sqrt(), "{off}");
        }
        assert!(mean_of(|x| x.x * x.y).abs() < CONFIDENCE / n.sqrt());
    }
}
