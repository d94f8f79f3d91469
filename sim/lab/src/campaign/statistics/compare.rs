//! Comparison of two controllers: ratio, intervals, wins, test.

use serde::Serialize;

use super::run_table::{Pair, Pairing, RunTable, objective};
use super::student::{mean, median, quantile, student_test};

/// The two-sided 95 % point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// A comparison to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Question<'a> {
    /// The controller.
    pub(crate) controller: &'a str,
    /// The controller that it is compared with.
    pub(crate) reference: &'a str,
    /// The column.
    pub(crate) metric: &'a str,
    /// The scenario; none for all.
    pub(crate) scenario: Option<&'a str>,
    /// The objective whose gains count for laws; the metric's own if none.
    pub(crate) objective: Option<&'a str>,
}

/// How two values are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Measure {
    /// a/b, by its logarithm.
    #[default]
    Ratio,
    /// a − b, if a value is 0 or below.
    Difference,
}

/// What counts as one observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Cluster {
    /// A replicate of the one scenario and craft.
    Replicate,
    /// The mean of a craft's replicates, in the one scenario.
    Craft,
    /// The mean of a scenario's replicates, with the one craft.
    Scenario,
    /// The mean of the replicates of a scenario with a craft.
    ScenarioAndCraft,
}

/// The share of pairs in which the controller has less than the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Wins {
    /// Share of the pairs; a tie counts half.
    pub(crate) share: f64,
    /// Its 95 % interval by Wilson, as if pairs were independent.
    pub(crate) wilson_95: [f64; 2],
}

/// The answer to a [`Question`]. Ratios are 1, differences in the metric's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Comparison {
    pub(crate) controller: String,
    pub(crate) reference: String,
    pub(crate) metric: String,
    /// None for all.
    pub(crate) scenario: Option<String>,
    pub(crate) measure: Measure,
    /// Unit of the estimate and of its intervals.
    pub(crate) unit: &'static str,
    /// Worlds with both values.
    pub(crate) n_pairs: usize,
    /// Worlds in which the controller's mission failed.
    pub(crate) n_failed: usize,
    /// Worlds in which the reference's mission failed.
    pub(crate) n_reference_failed: usize,
    /// Worlds in which neither failed and a value is missing.
    pub(crate) n_missing: usize,
    /// Means over the pairs of both values, in the metric's unit; none of no pair.
    pub(crate) mean: Option<f64>,
    pub(crate) reference_mean: Option<f64>,
    /// What counts as one observation.
    pub(crate) cluster: Cluster,
    pub(crate) n_clusters: usize,
    /// Geometric mean of the ratios, or mean of the differences; none of no pair.
    pub(crate) estimate: Option<f64>,
    /// Its 95 % interval by Student's distribution; none of one cluster, as for the members below.
    pub(crate) student_95: Option<[f64; 2]>,
    pub(crate) wins: Option<Wins>,
    /// Median, 90th percentile and largest value over the pairs; none of no pair.
    pub(crate) quantiles: Option<[f64; 3]>,
    /// The p-value of the two-sided paired t-test.
    pub(crate) p: Option<f64>,
    /// The p-value, adjusted for all comparisons of the report; see [`holm`].
    pub(crate) p_holm: Option<f64>,
}

/// Answers `question`.
pub(crate) fn compare(runs: &RunTable, question: Question<'_>) -> Comparison {
    let Question {
        controller,
        reference,
        metric,
        scenario,
        objective: asked,
    } = question;
    let pairing = runs.pairing_at(
        asked.unwrap_or(objective(metric)),
        [controller, reference],
        metric,
        scenario,
    );
    let measure = pairing.measure();
    let (cluster, values) = pairing.clusters(runs, scenario.is_some());
    let out = |value: f64| measure.out(value);
    let student = (!values.is_empty()).then(|| mean(&values));
    let student_95 = student.and_then(|interval| interval.bounds);
    Comparison {
        controller: controller.to_owned(),
        reference: reference.to_owned(),
        metric: metric.to_owned(),
        scenario: scenario.map(str::to_owned),
        measure,
        unit: measure.unit(metric),
        n_pairs: pairing.pairs.len(),
        n_failed: pairing.failed.0,
        n_reference_failed: pairing.failed.1,
        n_missing: pairing.missing,
        mean: pairing.mean(|values| values.0),
        reference_mean: pairing.mean(|values| values.1),
        cluster,
        n_clusters: values.len(),
        estimate: student.map(|interval| out(interval.centre)),
        student_95: student_95.map(|ends| ends.map(out)),
        wins: pairing.wins(),
        quantiles: pairing.quantiles(),
        p: student_test(&values),
        p_holm: None,
    }
}

/// Unit of a column by the end of its name; 1 if it names none.
pub(crate) fn unit(column: &str) -> &'static str {
    let units = [
        ("reference_jerk", "m/s³"),
        ("_mps", "m/s"),
        ("_percent", "%"),
        ("_rad", "rad"),
        ("_m", "m"),
        ("_s", "s"),
        ("_j", "J"),
    ];
    let ends = |(end, _): &(&str, &str)| column.ends_with(end);
    units.into_iter().find(ends).map_or("1", |(_, unit)| unit)
}

impl Measure {
    /// Unit of what is shown.
    pub(super) fn unit(self, metric: &str) -> &'static str {
        match self {
            Self::Ratio => "1",
            Self::Difference => unit(metric),
        }
    }

    /// The averaged quantity of two values.
    pub(super) fn of(self, (a, b): (f64, f64)) -> f64 {
        match self {
            Self::Ratio => (a / b).ln(),
            Self::Difference => a - b,
        }
    }

    /// a/b, or a − b.
    pub(crate) fn between(self, values: (f64, f64)) -> f64 {
        self.out(self.of(values))
    }

    /// The shown value of an average.
    pub(super) fn out(self, value: f64) -> f64 {
        match self {
            Self::Ratio => value.exp(),
            Self::Difference => value,
        }
    }
}

impl Pairing {
    /// A ratio if all values are positive.
    pub(crate) fn measure(&self) -> Measure {
        let positive = |pair: &Pair| 0.0 < pair.values.0 && 0.0 < pair.values.1;
        if self.pairs.iter().all(positive) {
            Measure::Ratio
        } else {
            Measure::Difference
        }
    }

    /// The observations and their kind; see the [module](super).
    fn clusters(&self, runs: &RunTable, in_one_scenario: bool) -> (Cluster, Vec<f64>) {
        let measure = self.measure();
        let mut groups: Vec<(usize, f64, f64)> = vec![];
        for pair in &self.pairs {
            let value = measure.of(pair.values);
            match groups.last_mut().filter(|(group, ..)| *group == pair.group) {
                Some((_, sum, n)) => (*sum, *n) = (*sum + value, *n + 1.0),
                None => groups.push((pair.group, value, 1.0)),
            }
        }
        if groups.len() <= 1 {
            let each = self.pairs.iter().map(|pair| measure.of(pair.values));
            return (Cluster::Replicate, each.collect());
        }
        let first = &runs.groups[groups[0].0];
        let of_groups = || groups.iter().map(|(group, ..)| &runs.groups[*group]);
        let cluster = if in_one_scenario || of_groups().all(|group| group.scenario == first.scenario) {
            Cluster::Craft
        } else if of_groups().all(|group| group.craft == first.craft) {
            Cluster::Scenario
        } else {
            Cluster::ScenarioAndCraft
        };
        (cluster, groups.iter().map(|(_, sum, n)| sum / n).collect())
    }

    fn mean(&self, of: fn((f64, f64)) -> f64) -> Option<f64> {
        let values: Vec<f64> = self.pairs.iter().map(|pair| of(pair.values)).collect();
        (!values.is_empty()).then(|| mean(&values).centre)
    }

    fn quantiles(&self) -> Option<[f64; 3]> {
        let measure = self.measure();
        let all: Vec<f64> = self
            .pairs
            .iter()
            .map(|pair| measure.between(pair.values))
            .collect();
        Some([median(&all)?, quantile(&all, 0.9)?, quantile(&all, 1.0)?])
    }

    fn wins(&self) -> Option<Wins> {
        let wins: f64 = self
            .pairs
            .iter()
            .map(|Pair { values: (a, b), .. }| match a.total_cmp(b) {
                _ if a == b => 0.5,
                std::cmp::Ordering::Less => 1.0,
                std::cmp::Ordering::Equal | std::cmp::Ordering::Greater => 0.0,
            })
            .sum();
        #[expect(clippy::cast_precision_loss, reason = "millions of pairs, not 2⁵³")]
        let n = self.pairs.len() as f64;
        (0.0 < n).then(|| Wins {
            share: wins / n,
            wilson_95: wilson(wins, n),
        })
    }
}

/// Wilson's 95 % interval of the share `wins` of `n`; `n` is positive.
///
/// ```text
/// (p̂ + z²/2n ± z √(p̂(1 − p̂)/n + z²/4n²)) / (1 + z²/n)
/// ```
/// Source: E. B. Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", J. Am. Stat. Assoc. 22 (1927),
/// 209–212, doi:10.1080/01621459.1927.10502953.
pub(super) fn wilson(wins: f64, n: f64) -> [f64; 2] {
    let share = wins / n;
    let middle = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let end = |value: f64| (value / (1.0 + Z * Z / n)).clamp(0.0, 1.0);
    [end(middle - half), end(middle + half)]
}

/// Holm's adjustment of p-values, in their order; unknown ones are not counted. If each is compared with 5 %, the probability that
/// any true null hypothesis is rejected is at most 5 %, however they depend on each other.
///
/// ```text
/// p̃₍ᵢ₎ = max_{j ≤ i} min(1, (m − j + 1) p₍ⱼ₎)                         p₍₁₎ ≤ … ≤ p₍ₘ₎
/// ```
/// Source: S. Holm, "A Simple Sequentially Rejective Multiple Test Procedure", Scand. J. Stat. 6 (1979), 65–70.
pub(crate) fn holm(all: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut order: Vec<usize> = (0..all.len()).filter(|&i| all[i].is_some()).collect();
    let at = |i: usize| all[i].unwrap_or(1.0);
    order.sort_by(|&i, &k| at(i).total_cmp(&at(k)));
    let mut adjusted = vec![None; all.len()];
    let (mut least, mut left) = (0.0_f64, order.len());
    for i in order {
        #[expect(clippy::cast_precision_loss, reason = "hundreds of comparisons")]
        let factor = left as f64;
        least = least.max((factor * at(i)).min(1.0));
        adjusted[i] = Some(least);
        left -= 1;
    }
    adjusted
}
