//! The effect of a parameter on a comparison.

use std::collections::BTreeMap;

use serde::Serialize;

use super::student::{mean, student_beyond};
use super::{
    compare::{Measure, Question},
    run_table::RunTable,
};

/// Values that differ by less than this share of the largest are equal.
const SAME: f64 = 1e-12;

/// The correlation of a comparison with a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Effect {
    pub(crate) controller: String,
    pub(crate) reference: String,
    pub(crate) metric: String,
    /// The parameter's column.
    pub(crate) parameter: String,
    pub(crate) measure: Measure,
    /// Unit of the estimates and of their intervals.
    pub(crate) unit: &'static str,
    /// Replicates, each with one value of the parameter.
    pub(crate) n_replicates: usize,
    /// Spearman's rank correlation of parameter and comparison; none if one of them is constant.
    pub(crate) spearman: Option<f64>,
    /// Its p-value.
    pub(crate) p: Option<f64>,
    /// The p-value, adjusted for all effects of the report.
    pub(crate) p_holm: Option<f64>,
    /// The comparison in the lowest, middle and highest third of the parameter's values.
    pub(crate) thirds: [Option<Third>; 3],
}

/// The replicates of a third.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Third {
    /// Least and largest value of the parameter, in its unit.
    pub(crate) parameter: [f64; 2],
    /// Number of replicates.
    pub(crate) n_replicates: usize,
    /// Geometric mean of the ratios, or mean of the differences.
    pub(crate) estimate: f64,
    /// Its 95 % interval by Student's distribution.
    pub(crate) student_95: Option<[f64; 2]>,
}

/// The effect of `parameter` on a comparison; none if no pair has it.
///
/// All groups of a replicate have the same parameters, so each replicate is one observation:
///
/// ```text
/// y_r = x̄ + mean over groups g of (d_{g,r} − x̄_g)                     x̄_g: mean of d in group g;  x̄: mean of x̄_g
/// ```
/// A group whose mission failed in a replicate is left out there; as group means are subtracted, this adds no bias.
pub(crate) fn effect(runs: &RunTable, question: Question<'_>, parameter: &str) -> Option<Effect> {
    let Question {
        controller,
        reference,
        metric,
        scenario,
        objective: _,
    } = question;
    let pairing = runs.pairing([controller, reference], metric, scenario);
    let measure = pairing.measure();
    let mut groups: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let mut replicates: BTreeMap<u64, (f64, Vec<(usize, f64)>)> = BTreeMap::new();
    for pair in &pairing.pairs {
        let Some(drawn) = runs.value(parameter, pair.rows.0) else {
            continue;
        };
        let value = measure.of(pair.values);
        groups.entry(pair.group).or_default().push(value);
        let (_, values) = replicates.entry(pair.replicate).or_insert((drawn, vec![]));
        values.push((pair.group, value));
    }
    let means: BTreeMap<usize, f64> = groups
        .iter()
        .map(|(&group, values)| (group, mean(values).centre))
        .collect();
    if means.is_empty() {
        return None;
    }
    let overall = mean(&means.values().copied().collect::<Vec<_>>()).centre;
    let (drawn, values): (Vec<f64>, Vec<f64>) = replicates
        .into_values()
        .map(|(drawn, values)| {
            let apart: Vec<f64> = values.iter().map(|(group, value)| value - means[group]).collect();
            (drawn, overall + mean(&apart).centre)
        })
        .unzip();
    let (spearman, p) = spearman(&drawn, &without_rounding(&values));
    Some(Effect {
        controller: controller.to_owned(),
        reference: reference.to_owned(),
        metric: metric.to_owned(),
        parameter: parameter.to_owned(),
        measure,
        unit: measure.unit(metric),
        n_replicates: drawn.len(),
        spearman,
        p,
        p_holm: None,
        thirds: thirds(&drawn, &values, measure),
    })
}

/// `values` without rounding errors, which must not be ranked.
fn without_rounding(values: &[f64]) -> Vec<f64> {
    let size = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let unit = if size == 0.0 { 1.0 } else { SAME * size };
    values.iter().map(|value| (value / unit).round()).collect()
}

/// Spearman's rank correlation of two lists of equal length, ties at their mean rank, and its p-value.
///
/// ```text
/// ρ = Pearson's correlation of the ranks;   t = ρ √((n − 2) / (1 − ρ²)), of n − 2 degrees of freedom
/// ```
/// Source: M. G. Kendall, A. Stuart, The Advanced Theory of Statistics, vol. 2 (1973), 31.19.
pub(super) fn spearman(a: &[f64], b: &[f64]) -> (Option<f64>, Option<f64>) {
    let centred = |values: &[f64]| {
        let ranks = ranks(values);
        let middle = mean(&ranks).centre;
        ranks.iter().map(|rank| rank - middle).collect::<Vec<f64>>()
    };
    if a.len() < 3 {
        return (None, None);
    }
    let (a, b) = (centred(a), centred(b));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (dot(&a, &a) * dot(&b, &b)).sqrt();
    if size == 0.0 {
        return (None, None);
    }
    let rho = (dot(&a, &b) / size).clamp(-1.0, 1.0);
    let freedom = a.len() - 2;
    #[expect(clippy::cast_precision_loss, reason = "millions of replicates, not 2⁵³")]
    let t = rho * (freedom as f64 / (1.0 - rho * rho)).sqrt();
    let p = if t.is_finite() {
        student_beyond(t, freedom)
    } else {
        Some(0.0)
    };
    (Some(rho), p)
}

/// Ranks from 1 on; equal values have their mean rank.
#[expect(clippy::cast_precision_loss, reason = "millions of replicates, not 2⁵³")]
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &k| values[i].total_cmp(&values[k]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for tie in order.chunk_by(|&i, &k| values[i] == values[k]) {
        let rank = first as f64 + 0.5 * (tie.len() + 1) as f64;
        for &i in tie {
            ranks[i] = rank;
        }
        first += tie.len();
    }
    ranks
}

/// The comparison by thirds of the parameter's ranks. Equal values are in the same third, so a third may be empty.
fn thirds(drawn: &[f64], values: &[f64], measure: Measure) -> [Option<Third>; 3] {
    let ranks = ranks(drawn);
    let third = |number: u32| {
        #[expect(clippy::cast_precision_loss, reason = "millions of replicates, not 2⁵³")]
        let n = drawn.len() as f64;
        let is_in = |rank: f64| (3.0 * (rank - 0.5) / n).floor().min(2.0) == f64::from(number);
        let within: Vec<usize> = (0..drawn.len()).filter(|&i| is_in(ranks[i])).collect();
        let inside: Vec<f64> = within.iter().map(|&i| values[i]).collect();
        if inside.is_empty() {
            return None;
        }
        let interval = mean(&inside);
        let limits = within
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &i| {
                [low.min(drawn[i]), high.max(drawn[i])]
            });
        Some(Third {
            parameter: limits,
            n_replicates: inside.len(),
            estimate: measure.out(interval.centre),
            student_95: interval.bounds.map(|ends| ends.map(|end| measure.out(end))),
        })
    };
    [third(0), third(1), third(2)]
}
