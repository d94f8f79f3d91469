//! Means and ratios over seeds, with the interval that holds the true one 95 % of the time.
//!
//! Controllers are compared from the same starts, so that what a start has in store for all cancels: the
//! interval of a ratio is Student's for the mean of the logarithms of the paired ratios. A bootstrap of three or ten
//! seeds covers far less than it says, as it never draws what lies outside them; and ratios of errors are products of
//! many influences, so that their logarithms are nearer to normal than they are.

use std::f64::consts::FRAC_2_PI;

/// What an interval leaves out on either side.
const TAIL: f64 = 0.025;

/// Halvings of the bracket in which a quantile is sought: 10⁴ · 2⁻⁶⁰ is below rounding.
const HALVINGS: u32 = 60;

/// Above every quantile that is asked for: that of one degree of freedom is 12.7.
const QUANTILE_MAX: f64 = 1e4;

/// A centre, and where there is more than one seed its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    /// The estimate.
    pub(crate) centre: f64,
    /// Least and largest value that the seeds do not speak against.
    pub(crate) bounds: Option<(f64, f64)>,
}

impl Interval {
    /// Its upper end; the centre where one seed is all there is.
    #[must_use]
    pub(crate) fn upper(&self) -> f64 {
        self.bounds.map_or(self.centre, |(_, upper)| upper)
    }

    /// Whether it holds `value`. A centre without an interval holds itself.
    #[must_use]
    pub(crate) fn holds(&self, value: f64) -> bool {
        let (low, high) = self.bounds.unwrap_or((self.centre, self.centre));
        low <= value && value <= high
    }
}

/// The mean of `values`, at least one, by Student's distribution.
///
/// ```text
/// x̄ ± t_{0.975, n−1} s / √n
/// ```
#[must_use]
pub(crate) fn mean(values: &[f64]) -> Interval {
    let n = count(values);
    let centre = values.iter().sum::<f64>() / n;
    let bounds = (1 < values.len()).then(|| {
        let variance = values.iter().map(|value| (value - centre).powi(2)).sum::<f64>() / (n - 1.0);
        let half = student_quantile(values.len() - 1) * (variance / n).sqrt();
        (centre - half, centre + half)
    });
    Interval { centre, bounds }
}

/// The least value that a `share` of `values`, from 0 to 1, does not exceed; none of no values.
#[must_use]
pub(crate) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count is one, and never negative"
    )]
    let rank = (share * count(values)).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

/// The mean of a − b over pairs: what tells a tie where a value may be 0.
#[must_use]
pub(crate) fn paired_difference(a: &[f64], b: &[f64]) -> Interval {
    mean(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// The geometric mean of a / b over pairs; none where a value is not positive.
#[must_use]
pub(crate) fn paired_ratio(a: &[f64], b: &[f64]) -> Option<Interval> {
    let positive = |values: &[f64]| values.iter().all(|value| 0.0 < *value);
    if !positive(a) || !positive(b) {
        return None;
    }
    let logarithms: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a / b).ln()).collect();
    let Interval { centre, bounds } = mean(&logarithms);
    Some(Interval {
        centre: centre.exp(),
        bounds: bounds.map(|(low, high)| (low.exp(), high.exp())),
    })
}

/// The middle of `values`, or the mean of the two in the middle; none of none.
#[must_use]
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

#[expect(clippy::cast_precision_loss, reason = "dozens of seeds, not 2⁵³")]
fn count(values: &[f64]) -> f64 {
    values.len() as f64
}

/// What |t| of so many degrees of freedom, at least one, exceeds 5 % of the time.
fn student_quantile(freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, QUANTILE_MAX);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if student_within(middle, freedom) < 1.0 - 2.0 * TAIL {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// How often |t| of ν degrees of freedom stays within `most`.
///
/// ```text
/// θ = atan(t/√ν)
/// ν odd:   A = 2/π (θ + sin θ (cos θ + 2/3 cos³ θ + … + 2·4…(ν−3) / (1·3…(ν−2)) cos^{ν−2} θ))
/// ν even:  A = sin θ (1 + 1/2 cos² θ + … + 1·3…(ν−3) / (2·4…(ν−2)) cos^{ν−2} θ)
/// ```
/// Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 26.7.3 and 26.7.4.
fn student_within(most: f64, freedom: usize) -> f64 {
    let nu = f64::from(u32::try_from(freedom).expect("dozens of seeds"));
    let theta = (most / nu.sqrt()).atan();
    let (sine, cosine) = theta.sin_cos();
    let odd = freedom % 2 == 1;
    let (mut power, mut term) = if odd { (1.0, cosine) } else { (0.0, 1.0) };
    let mut sum = 0.0;
    while power <= nu - 2.0 {
        sum += term;
        term *= (power + 1.0) / (power + 2.0) * cosine * cosine;
        power += 2.0;
    }
    if odd {
        FRAC_2_PI * (theta + sine * sum)
    } else {
        sine * sum
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, LogNormal};

    use super::*;

    #[test]
    fn quantiles_are_those_of_the_printed_tables() {
        for (freedom, printed) in [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (4, 2.776),
            (9, 2.262),
            (29, 2.045),
            (120, 1.980),
        ] {
            let found = student_quantile(freedom);
            assert!((found - printed).abs() < 5.1e-4, "{freedom}: {found}");
        }
    }

    #[test]
    fn the_interval_holds_a_known_ratio_as_often_as_it_says() {
        const TRIALS: u32 = 4_000;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        // A start common to both, and noise of each one's own; the true ratio is e^0.2.
        let start = LogNormal::new(1.0, 0.8).expect("finite");
        let first = LogNormal::new(0.2, 0.3).expect("finite");
        let second = LogNormal::new(0.0, 0.1).expect("finite");
        for seeds in [3, 10, 30] {
            let mut held = 0;
            for _ in 0..TRIALS {
                let pairs: Vec<(f64, f64)> = (0..seeds)
                    .map(|_| {
                        let common = start.sample(&mut rng);
                        (common * first.sample(&mut rng), common * second.sample(&mut rng))
                    })
                    .collect();
                let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
                held += u32::from(paired_ratio(&a, &b).expect("positive").holds(0.2_f64.exp()));
            }
            let share = f64::from(held) / f64::from(TRIALS);
            // Four deviations of a share of 95 % in 4000 trials.
            assert!((share - 0.95).abs() < 0.014, "{seeds} seeds: {share}");
        }
    }

    #[test]
    fn a_factor_common_to_all_pairs_is_found_exactly() {
        let second = [1.0, 20.0, 0.3];
        let first = second.map(|value| 0.5 * value);
        let ratio = paired_ratio(&first, &second).expect("positive");
        let (low, high) = ratio.bounds.expect("three seeds");
        assert!(
            (low - 0.5).abs() < 1e-12 && (high - 0.5).abs() < 1e-12,
            "{ratio:?}"
        );
    }

    #[test]
    fn one_seed_has_no_interval_and_nothing_has_no_ratio_to_nought() {
        assert_eq!(mean(&[3.0]).bounds, None);
        assert_eq!(mean(&[3.0]).upper(), 3.0);
        assert_eq!(paired_ratio(&[1.0, 0.0], &[1.0, 1.0]), None);
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[4.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0]), Some(2.5));
    }

    #[test]
    fn a_quantile_is_the_least_value_that_its_share_does_not_exceed() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0];
        for (share, value) in [(0.0, 1.0), (0.2, 1.0), (0.5, 3.0), (0.61, 4.0), (1.0, 5.0)] {
            assert_eq!(quantile(&values, share), Some(value), "{share}");
        }
        assert_eq!(quantile(&[], 0.5), None);
    }
}
