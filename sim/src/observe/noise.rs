//! Normal random numbers, each pair from two uniform ones, and their addition to a truth.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Two independent standard normal numbers, each within ±8.6, from exactly two uniform ones.
///
/// ```text
/// z = √(−2 ln u₁) [cos 2πu₂, sin 2πu₂]
/// ```
/// Source: Box and Muller, "A note on the generation of random normal deviates", 1958. Faster
/// methods reject numbers, so a stream that two runs share would depend on earlier draws.
pub(crate) fn normal_pair(rng: &mut ChaCha8Rng) -> Vector2<f64> {
    // Uniform numbers are in [0, 1); the logarithm needs (0, 1].
    let u_1 = 1.0 - rng.random::<f64>();
    let u_2 = rng.random::<f64>();
    let (sin, cos) = (TAU * u_2).sin_cos();
    Vector2::new(cos, sin) * (-2.0 * u_1.ln()).sqrt()
}

/// `truth + error`, or the bits of `truth` without an error (−0 + 0 is +0).
pub(super) fn disturbed(truth: f64, error: f64) -> f64 {
    if error == 0.0 { truth } else { truth + error }
}

/// [`disturbed`] for both components.
pub(super) fn disturbed_vector(truth: &Vector2<f64>, error: &Vector2<f64>) -> Vector2<f64> {
    truth.zip_map(error, disturbed)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::tests::binomial;

    /// Pairs drawn per claim.
    const DRAWS: u32 = 100_000;

    /// Asserts the share of pairs with a property.
    #[track_caller]
    fn assert_share(expected: f64, inside: impl Fn(&Vector2<f64>) -> bool) {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let hits = (0..DRAWS).filter(|_| inside(&normal_pair(&mut rng))).count();
        let hits = u32::try_from(hits).expect("no more than draws");
        binomial(hits.into(), DRAWS.into(), expected);
    }

    #[test]
    fn a_pair_is_normal_and_independent() {
        // Tabulated.
        for (sigmas, expected) in [(1.0, 0.682_689_5), (2.0, 0.954_499_7), (3.0, 0.997_300_2)] {
            for axis in 0..2 {
                assert_share(expected, |z| z[axis].abs() <= sigmas);
            }
        }
        // Independent signs and sizes: every quadrant beyond the median size 0.674 49 holds 1/16.
        for sign in [Vector2::new(1.0, 1.0), Vector2::new(-1.0, 1.0)] {
            assert_share(1.0 / 16.0, |z| z.component_mul(&sign).min() > 0.674_49);
        }
    }

    #[test]
    fn a_pair_costs_two_uniform_numbers_every_time() {
        let [mut drawn, mut counted] = [3, 3].map(ChaCha8Rng::seed_from_u64);
        for _ in 0..10_000 {
            let _pair = normal_pair(&mut drawn);
            let _uniform: [f64; 2] = [counted.random(), counted.random()];
        }
        assert_eq!(drawn.random::<u64>(), counted.random::<u64>());
    }

    #[test]
    fn no_error_keeps_even_the_sign_of_zero() {
        assert!(disturbed(-0.0, 0.0).is_sign_negative());
        assert_eq!(disturbed(1.5, 0.25), 1.75);
    }
}
