//! The table at the end of a campaign. Statistics and claims are `pilotfish.analysis` in Python.

use std::{collections::BTreeMap, fmt::Write as _};

use super::{design::Campaign, rows::Rows};

/// A controller's name, a scenario with a craft, and the bits of a replicate's number.
type RowKey<'a> = (&'a str, [&'a str; 2], u64);

/// A line per controller: runs, failures, and each metric's ratio to the reference, the geometric
/// mean over conditions that both flew. Each scenario with a craft has the same weight. A law with
/// several gains counts at those for the metric, else at its first.
pub fn summary(campaign: &Campaign, rows: &Rows) -> String {
    let (metrics, reference) = (&campaign.file.report.metrics, campaign.reference());
    let values: Vec<_> = metrics.iter().map(|metric| by_key(rows, metric)).collect();
    let controllers = campaign.controllers.iter();
    let names = controllers.map(|controller| controller.name.as_str());
    let width = names.clone().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut text = format!("{:width$}  {:>6}  {:>6}", "", "runs", "failed");
    for metric in metrics {
        write!(text, "  {metric:>8}").expect("a string takes everything");
    }
    for name in names {
        let flown = rows.words("controller").unwrap_or_default().into_iter();
        let flown = flown.zip(rows.words("failure").unwrap_or_default());
        let flown = flown.filter(|(controller, _)| *controller == name);
        let (failed, ended): (Vec<_>, Vec<_>) = flown.partition(|(_, failure)| !failure.is_empty());
        let (runs, failed) = (failed.len() + ended.len(), failed.len());
        write!(text, "\n{name:width$}  {runs:>6}  {failed:>6}").expect("a string takes everything");
        for (metric, values) in metrics.iter().zip(&values) {
            let ratio = ratio(values, name, reference);
            let ratio = ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.3}"));
            write!(text, "  {ratio:>0$}", metric.len().max(8)).expect("a string takes everything");
        }
    }
    text + &format!(
        "\nMetrics are ratios to {reference}, without intervals: python -m pilotfish.analysis report\n"
    )
}

fn by_key<'a>(rows: &'a Rows, metric: &str) -> BTreeMap<RowKey<'a>, f64> {
    let words = |name| rows.words(name).unwrap_or_default();
    let [controllers, scenarios, crafts, objectives, failures] =
        ["controller", "scenario", "craft", "objectives", "failure"].map(words);
    let replicates = rows.numbers("replicate").unwrap_or_default();
    let mut values = BTreeMap::new();
    for (i, value) in rows.numbers(metric).unwrap_or_default().iter().enumerate() {
        let Some(value) = value.filter(|_| failures[i].is_empty()) else { continue };
        let replicate = replicates[i].map_or(0, f64::to_bits);
        let key: RowKey<'_> = (controllers[i], [scenarios[i], crafts[i]], replicate);
        if objectives[i].split(' ').any(|name| name == metric) {
            values.insert(key, value);
        } else {
            values.entry(key).or_insert(value);
        }
    }
    values
}

/// None without pairs, and where a value is not positive.
fn ratio(values: &BTreeMap<RowKey<'_>, f64>, controller: &str, reference: &str) -> Option<f64> {
    let mut groups: BTreeMap<[&str; 2], (f64, f64)> = BTreeMap::new();
    for (&(_, group, replicate), value) in values.iter().filter(|((name, ..), _)| *name == controller) {
        let Some(other) = values.get(&(reference, group, replicate)) else { continue };
        let logarithm = (0.0 < *value && 0.0 < *other).then(|| (value / other).ln())?;
        let (sum, n) = groups.entry(group).or_default();
        (*sum, *n) = (*sum + logarithm, *n + 1.0);
    }
    let n_groups = groups.len() as f64;
    let sum: f64 = groups.values().map(|(sum, n)| sum / n).sum();
    (!groups.is_empty()).then(|| (sum / n_groups).exp())
}
