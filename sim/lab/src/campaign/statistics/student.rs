//! Means and ratios over seeds with 95 % intervals.
//!
//! Controllers are compared from the same starts, so that the effect of the start cancels: the interval of a ratio is Student's
//! for the mean logarithm of the paired ratios. Ratios of errors are products of many influences, so their logarithms are nearer
//! to normal; a bootstrap of three or ten seeds covers far less than it states.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// Probability outside an interval, on either side.
const TAIL: f64 = 0.025;

/// A standard error below this share of the mean is rounding.
const SAME: f64 = 1e-12;

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    /// The estimate.
    pub(crate) centre: f64,
    /// Ends of the interval; none of one value, and of equal ones, whose variance is not known.
    pub(crate) bounds: Option<[f64; 2]>,
}

/// The mean of `values`, at least one, by Student's distribution.
///
/// ```text
/// x̄ ± t_{0.975, n−1} s / √n
/// ```
#[must_use]
pub(crate) fn mean(values: &[f64]) -> Interval {
    let (centre, error) = centre_and_error(values);
    // The error of one value is not a number.
    let bounds = (SAME * centre.abs() < error).then(|| {
        let half = student_quantile(values.len() - 1) * error;
        [centre - half, centre + half]
    });
    Interval { centre, bounds }
}

/// The least value that a `share` of `values`, 0 to 1, does not exceed; none of no values.
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
        bounds: bounds.map(|ends| ends.map(f64::exp)),
    })
}

/// The median of `values`; none of no values.
#[must_use]
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

/// The p-value of Student's two-sided test that the mean is 0. 1 if all values are 0; none of fewer than two values, and if all are
/// equal up to rounding, as their variance is then unknown.
///
/// ```text
/// p = P(|t_{n−1}| ≥ |x̄| √n / s)
/// ```
#[must_use]
pub(crate) fn student_test(values: &[f64]) -> Option<f64> {
    let law = student(values.len().checked_sub(1)?)?;
    let (centre, error) = centre_and_error(values);
    if centre == 0.0 {
        return Some(1.0);
    }
    (SAME * centre.abs() < error).then(|| two_sided(&law, centre / error))
}

/// Probability that |t| with `freedom` degrees of freedom is `t` or more; none for 0 degrees.
#[must_use]
pub(crate) fn student_beyond(t: f64, freedom: usize) -> Option<f64> {
    Some(two_sided(&student(freedom)?, t))
}

fn two_sided(law: &StudentsT, t: f64) -> f64 {
    2.0 * law.sf(t.abs())
}

/// Student's distribution; none for 0 degrees of freedom.
#[expect(clippy::cast_precision_loss, reason = "millions of runs, not 2⁵³")]
fn student(freedom: usize) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, freedom as f64).ok()
}

/// The value that |t| with `freedom` degrees of freedom, at least one, exceeds with a probability of 5 %.
fn student_quantile(freedom: usize) -> f64 {
    student(freedom)
        .expect("at least one degree of freedom")
        .inverse_cdf(1.0 - TAIL)
}

/// The mean of `values` and its standard error, which is not a number for one value.
fn centre_and_error(values: &[f64]) -> (f64, f64) {
    let n = count(values);
    let centre = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - centre).powi(2)).sum::<f64>() / (n - 1.0);
    (centre, (variance / n).sqrt())
}

#[expect(clippy::cast_precision_loss, reason = "millions of runs, not 2⁵³")]
fn count(values: &[f64]) -> f64 {
    values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_test_of_a_mean_is_the_worked_one() {
        // t of nine degrees of freedom exceeds 2.262 on either side 5 % of the time, as printed.
        let beyond = student_beyond(2.262, 9).expect("nine degrees");
        assert!((beyond - 0.05).abs() < 1e-4, "{beyond}");
        // 1, 2, 3: mean 2, standard error 1/√3, t = 2√3, and P(|t| of two degrees > t) = 1 − t/√(2 + t²).
        let t = 2.0 * 3.0_f64.sqrt();
        let expected = 1.0 - t / (2.0 + t * t).sqrt();
        let found = student_test(&[1.0, 2.0, 3.0]).expect("three values");
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        assert_eq!(student_test(&[0.0, 0.0]), Some(1.0));
        assert_eq!(student_test(&[0.1 + 0.2, 0.3, 0.3]), None);
        assert_eq!(student_test(&[2.0]), None);
        assert_eq!(student_test(&[]), None);
    }

    #[test]
    fn one_seed_has_no_interval_and_nothing_has_no_ratio_to_nought() {
        assert_eq!(mean(&[3.0]).bounds, None);
        // Nor have equal ones, up to rounding.
        assert_eq!(mean(&[0.1 + 0.2, 0.3, 0.3]).bounds, None);
        assert_eq!(mean(&[0.0, 0.0]).bounds, None);
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
