//! The bootstrap interval of a mean.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF as _, Normal};

/// Resamples of an interval. Source: Efron and Tibshirani (1993), 14.2, ask for at least 1,000 for a BCa interval.
pub(crate) const RESAMPLES: u32 = 2_000;

/// What a 95 % interval leaves out on either side.
const TAIL: f64 = 0.025;

/// Means this near to each other, as a share of the largest value, are one: the order of a sum is not to count.
const SAME: f64 = 1e-12;

/// Randomness of a comparison of that name in a campaign of that seed.
pub(super) fn rng(seed: u64, name: &str) -> ChaCha8Rng {
    let digest = wire::sha256(format!("{seed}\0{name}").as_bytes());
    let head = u64::from_str_radix(&digest[..16], 16).expect("a digest is hexadecimal");
    ChaCha8Rng::seed_from_u64(head)
}

/// The 95 % interval of the mean of `values`, bias-corrected and accelerated (BCa); none of fewer than two.
///
/// ```text
/// z₀ = Φ⁻¹(share of resampled means below x̄)
/// a  = Σ (xᵢ − x̄)³ / (6 (Σ (xᵢ − x̄)²)^{3/2})                        jackknife of a mean
/// α  = Φ(z₀ + (z₀ ± z) / (1 − a (z₀ ± z)))                           z = Φ⁻¹(0.975)
/// ```
/// Its ends are the quantiles α of the resampled means, linearly between two of them.
///
/// Source: B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap (1993), 14.3. A mean that equals x̄ counts as half below it.
pub(super) fn bootstrap(values: &[f64], rng: &mut ChaCha8Rng) -> Option<[f64; 2]> {
    let n = u32::try_from(values.len()).ok().filter(|n| 2 <= *n)?;
    let mean = |sum: f64| sum / f64::from(n);
    let centre = mean(values.iter().sum());
    let size = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let spread: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    if spread.sqrt() <= SAME * size {
        return Some([centre, centre]);
    }
    let resample = |rng: &mut ChaCha8Rng| {
        // Indices of 32 bits: the same draws on every machine.
        let draws = (0..n).map(|_| values[rng.random_range(0..n) as usize]);
        mean(draws.sum())
    };
    let mut means: Vec<f64> = (0..RESAMPLES).map(|_| resample(rng)).collect();
    means.sort_by(f64::total_cmp);

    let below: f64 = means
        .iter()
        .map(|mean| match mean - centre {
            apart if apart.abs() <= SAME * size => 0.5,
            apart if apart < 0.0 => 1.0,
            _ => 0.0,
        })
        .sum();
    // Within half a resample of 0 and 1, where Φ⁻¹ ends.
    let share =
        (below / f64::from(RESAMPLES)).clamp(0.5 / f64::from(RESAMPLES), 1.0 - 0.5 / f64::from(RESAMPLES));
    let cubes: f64 = values.iter().map(|value| (value - centre).powi(3)).sum();
    let acceleration = cubes / (6.0 * spread.powf(1.5));
    let normal = Normal::standard();
    let bias = normal.inverse_cdf(share);
    let end = |tail: f64| {
        let z = bias + normal.inverse_cdf(tail);
        between(&means, normal.cdf(bias + z / (1.0 - acceleration * z)))
    };
    Some([end(TAIL), end(1.0 - TAIL)])
}

/// The quantile of sorted values, linearly between two of them.
fn between(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len() - 1;
    #[expect(clippy::cast_precision_loss, reason = "thousands of resamples")]
    let place = share * last as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between the first and the last"
    )]
    let below = (place.floor() as usize).min(last);
    let above = (below + 1).min(last);
    sorted[below] + place.fract() * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, LogNormal, Normal as NormalSamples};

    use super::*;
    use crate::campaign::statistics::student::mean;

    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found}, not {expected}");
    }

    #[test]
    fn the_bootstrap_covers_a_known_mean_about_as_often_as_it_says() {
        const TRIALS: u32 = 400;
        // Normal values, and skewed ones; the mean of exp(N(0, σ)) is exp(σ²/2).
        let normal = NormalSamples::new(-0.4, 0.3).expect("finite");
        let skewed = LogNormal::new(0.0, 0.6).expect("finite");
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for n in [12, 40] {
            let mut held = [0, 0];
            for _ in 0..TRIALS {
                let values: Vec<f64> = (0..n).map(|_| normal.sample(&mut random)).collect();
                let [low, high] = bootstrap(&values, &mut random).expect("several values");
                held[0] += u32::from((low..=high).contains(&-0.4));
                let values: Vec<f64> = (0..n).map(|_| skewed.sample(&mut random)).collect();
                let [low, high] = bootstrap(&values, &mut random).expect("several values");
                held[1] += u32::from((low..=high).contains(&0.18_f64.exp()));
            }
            let [plain, skewed] = held.map(|held| f64::from(held) / f64::from(TRIALS));
            // A bootstrap of a dozen values covers some points less than it says; of skewed ones, some more.
            assert!((0.88..=0.98).contains(&plain), "{n}: {plain}");
            assert!((0.83..=0.98).contains(&skewed), "{n}: {skewed}");
        }
    }

    #[test]
    fn the_bootstrap_of_many_values_is_students_interval_and_leans_towards_the_long_tail() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let law = NormalSamples::new(1.0, 0.5).expect("finite");
        let values: Vec<f64> = (0..400).map(|_| law.sample(&mut random)).collect();
        let student = mean(&values);
        let (low, high) = student.bounds.expect("many values");
        let [least, most] = bootstrap(&values, &mut random).expect("many values");
        let width = high - low;
        near(least, low, 0.1 * width);
        near(most, high, 0.1 * width);

        let skewed: Vec<f64> = (0..30).map(|k| f64::from(k * k * k)).collect();
        let centre = mean(&skewed).centre;
        let [least, most] = bootstrap(&skewed, &mut random).expect("many values");
        assert!(1.1 * (centre - least) < most - centre, "{least} {centre} {most}");
    }

    #[test]
    fn the_bootstrap_of_one_value_is_none_and_of_equal_ones_a_point() {
        assert_eq!(bootstrap(&[1.0], &mut rng(1, "x")), None);
        assert_eq!(bootstrap(&[0.3; 5], &mut rng(1, "x")), Some([0.3; 2]));
        let three = [0.1, 0.2, 0.7];
        let ends = bootstrap(&three, &mut rng(1, "x")).expect("three values");
        assert_eq!(Some(ends), bootstrap(&three, &mut rng(1, "x")));
        assert!(0.1 <= ends[0] && ends[1] <= 0.7);
    }
}
