//! Tables of a report.

use super::{
    numbers::Numbers,
    overview::{ControllerFlown, Part},
    words::{
        NONE, bold, code, integer, interval, number, optional, or_none, percent, probability, signed, wins,
    },
};
use crate::{
    campaign::{
        rows::PARAMETER,
        statistics::{Cluster, Comparison, Measure, Third},
    },
    document::Table,
};

/// Failures that are shown.
pub(super) const FAILURES: usize = 20;
/// Craft whose names are shown; of more there are the first and the last.
const CRAFT: usize = 4;
/// Probability of an error in any comparison below which a difference is significant.
const LEVEL: f64 = 0.05;
/// Name of the line on all scenarios.
const ALL: &str = "all";

pub(super) fn introduction(numbers: &Numbers) -> String {
    let about = &numbers.campaign;
    let n_cases: usize = numbers.cases.iter().map(|case| case.craft.len()).sum();
    let lasting = about
        .duration_s
        .map_or(String::new(), |seconds| format!(" of at most {seconds} s"));
    format!(
        "Campaign `{}`, seed {}: {} scenarios, {n_cases} cases (scenarios with a craft), {} replicates of each; {} runs{lasting} (of at most \
         {} runs); {} failed. The reference is `{}`. Digest of the rows: `{}`.",
        about.name,
        about.seed,
        numbers.cases.len(),
        integer(about.replicates),
        integer(about.n_rows),
        integer(about.n_runs_at_most),
        integer(about.n_failed),
        about.reference,
        about.digest,
    ) + &repeated(&about.repeated)
}

/// That replicates are no observations where nothing is drawn.
fn repeated(cases: &[String]) -> String {
    if cases.is_empty() {
        return String::new();
    }
    let named = cases.iter().map(|case| code(case)).collect::<Vec<_>>().join(", ");
    format!(
        " **All replicates are the same mission** in {named}: nothing is drawn there, and only the first one counts. Give the scenario \
         noise or distributions, or the campaign `[[parameters]]`, or ask for one replicate."
    )
}

pub(super) fn controllers(numbers: &Numbers) -> Table {
    let part = |controller: &ControllerFlown| match controller.part {
        Part::Reference => "reference",
        Part::Compared => "compared",
        Part::KnowsMore => "compared; knows more than the scenario grants",
    };
    Table::of(3, &numbers.controllers)
        .column("controller", |c| code(&c.name))
        .column("information", |c| c.information.clone())
        .column("part", |c| part(c).to_owned())
        .column("runs", |c| integer(c.n_runs))
        .column("failed", |c| integer(c.n_failed))
        .table
}

pub(super) fn cases(numbers: &Numbers) -> Table {
    let names = |craft: &[String]| match craft {
        [first, .., last] if CRAFT < craft.len() => format!("{} from {first} to {last}", craft.len()),
        few => few.join(", "),
    };
    Table::of(3, &numbers.cases)
        .column("scenario", |case| code(&case.scenario))
        .column("title", |case| case.title.clone())
        .column("craft", |case| names(&case.craft))
        .table
}

pub(super) fn parameters(numbers: &Numbers) -> Table {
    let values = |values: &[f64]| {
        values
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(", ")
    };
    Table::of(2, &numbers.parameters)
        .column("parameter", |drawn| code(&drawn.key))
        .column("drawn from", |drawn| match (&drawn.uniform, &drawn.choice) {
            (Some([least, most]), _) => format!("{least} to {most}, uniform"),
            (None, Some(choice)) => format!("{}, equally likely", values(choice)),
            (None, None) => NONE.to_owned(),
        })
        .table
}

/// A column for each metric behind the first.
fn by_metric<T>(
    numbers: &Numbers,
    words: usize,
    heading: &str,
    rows: &[T],
    name: &dyn Fn(&T) -> String,
    cell: &dyn Fn(&T, &str) -> String,
) -> Table {
    let columns = std::iter::once(heading).chain(numbers.metrics.iter().map(String::as_str));
    let row = |item: &T| {
        let cells = numbers.metrics.iter().map(|metric| cell(item, metric));
        std::iter::once(name(item)).chain(cells).collect()
    };
    Table {
        words,
        columns: columns.map(str::to_owned).collect(),
        rows: rows.iter().map(row).collect(),
    }
}

/// One metric, by controller and scenario.
pub(super) fn comparisons(all: &[&Comparison]) -> Table {
    Table::of(2, all)
        .column("controller", |found| code(&found.controller))
        .column("scenario", |found| scenario(found.scenario.as_deref()))
        .column("pairs", |found| pairs(found))
        .column("observations", |found| {
            format!("{} {}", integer(found.n_clusters), clusters(found.cluster))
        })
        .column("mean", |found| optional(found.mean))
        .column("reference's", |found| optional(found.reference_mean))
        .column("ratio", |found| bold(&estimate(found), is_significant(found)))
        .column("Student", |found| or_none(interval(found.student_95)))
        .column("median / 90 % / worst", |found| {
            let quantiles = found.quantiles;
            quantiles.map_or(NONE.to_owned(), |values| values.map(number).join(" / "))
        })
        .column("wins", |found| found.wins.map_or(NONE.to_owned(), wins))
        .column("p", |found| probability(found.p))
        .column("p, Holm", |found| probability(found.p_holm))
        .table
}

/// The number of pairs, and the reasons for missing ones.
fn pairs(found: &Comparison) -> String {
    let mut text = integer(found.n_pairs);
    for (n, why) in [
        (found.n_failed, "failed"),
        (found.n_reference_failed, "failed of the reference"),
        (found.n_missing, "without a value"),
    ] {
        if 0 < n {
            text = format!("{text}, {} {why}", integer(n));
        }
    }
    text
}

fn clusters(cluster: Cluster) -> &'static str {
    match cluster {
        Cluster::Replicate => "replicates",
        Cluster::Craft => "craft",
        Cluster::Scenario => "scenarios",
        Cluster::ScenarioAndCraft => "cases",
    }
}

/// Whether the adjusted probability is below [`LEVEL`].
fn is_significant(found: &Comparison) -> bool {
    found.p_holm.is_some_and(|p| p < LEVEL)
}

pub(super) fn claims(numbers: &Numbers) -> Table {
    Table::of(4, &numbers.claims)
        .column("claim", |verdict| verdict.claim.clone())
        .column("scenario", |verdict| {
            verdict.scenario.clone().unwrap_or(ALL.to_owned())
        })
        .column("controller", |verdict| verdict.controller.clone())
        .column("beside", |verdict| verdict.beside.clone().unwrap_or_default())
        .column("measured", |verdict| verdict.words.clone())
        .column("claimed", |verdict| verdict.limit.clone())
        .column("holds", |verdict| {
            if verdict.holds { "yes" } else { "**no**" }.to_owned()
        })
        .table
}

pub(super) fn winners(numbers: &Numbers) -> Table {
    let mut table = by_metric(
        numbers,
        1 + numbers.metrics.len(),
        "scenario",
        &numbers.cases,
        &|case| code(&case.scenario),
        &|case, metric| {
            let mut winners = numbers.winners.iter();
            let found = winners.find(|winner| winner.scenario == case.scenario && winner.metric == metric);
            found.map_or(NONE.to_owned(), |winner| {
                let names = std::iter::once(&winner.controller).chain(&winner.as_good);
                names.map(|name| code(name)).collect::<Vec<_>>().join(" = ")
            })
        },
    );
    table.rows.retain(|row| row[1..].iter().any(|cell| cell != NONE));
    table
}

/// A table for each scenario.
pub(super) fn scores(numbers: &Numbers) -> Vec<(String, Table)> {
    let of = |scenario: &str| {
        let here: Vec<_> = numbers
            .scores
            .iter()
            .filter(|scores| scores.scenario == scenario)
            .collect();
        let mut table = by_metric(
            numbers,
            1,
            "controller",
            &here,
            &|scores| code(&scores.controller),
            &|scores, metric| {
                let mut names = numbers.metrics.iter();
                let k = names.position(|name| name == metric).expect("is one of them");
                let words = match (scores.means[k], scores.half_widths[k]) {
                    (Some(mean), Some(half)) => format!("{} ± {}", number(mean), number(half)),
                    (mean, _) => optional(mean),
                };
                bold(&words, scores.is_least[k])
            },
        );
        table.columns.extend(["beyond".to_owned(), "gains".to_owned()]);
        for (row, scores) in table.rows.iter_mut().zip(&here) {
            let beyond = scores.beyond.iter();
            let beyond = beyond.map(|(name, mean)| format!("{name} {}", number(*mean)));
            row.extend([beyond.collect::<Vec<_>>().join(", "), scores.gains.join("; ")]);
        }
        table
    };
    let all = numbers
        .cases
        .iter()
        .map(|case| (case.scenario.clone(), of(&case.scenario)));
    all.filter(|(_, table)| !table.rows.is_empty()).collect()
}

/// Planners, and the laws' points that no other law's point dominates.
pub(super) fn pareto(numbers: &Numbers, metrics: &[String; 2]) -> Table {
    let shown = numbers.pareto.iter();
    let shown: Vec<_> = shown
        .filter(|point| point.is_planner || !point.beaten_by_its_kind)
        .collect();
    let others = |is_planner: bool| {
        if is_planner {
            "of the laws' points"
        } else {
            "of the planners"
        }
    };
    Table::of(2, &shown)
        .column("scenario", |point| code(&point.scenario))
        .column("controller", |point| code(&point.controller))
        .column(&metrics[0], |point| number(point.means[0]))
        .column(&metrics[1], |point| number(point.means[1]))
        .column("dominated by", |point| {
            format!("{} {}", point.beaten_by, others(point.is_planner))
        })
        .table
}

pub(super) fn estimated(numbers: &Numbers) -> Table {
    Table::of(2, &numbers.estimated)
        .column("controller", |found| code(&found.controller))
        .column("estimate", |found| code(found.quantity))
        .column("runs", |found| integer(found.n_runs))
        .column("error, median, s", |found| number(found.error_median_s))
        .column("error, 90 %, s", |found| number(found.error_90_s))
        .column("interval holds", |found| percent(found.held))
        .table
}

pub(super) fn alarms(numbers: &Numbers) -> Table {
    Table::of(1, &numbers.alarms)
        .column("controller", |found| code(&found.controller))
        .column("runs", |found| integer(found.n_runs))
        .column("alarms an hour", |found| number(found.per_hour))
        .column("runs with an alarm", |found| percent(found.alarmed))
        .column("noticed", |found| {
            let share = format!("{} of {}", integer(found.n_noticed), integer(found.n_runs));
            if found.breaks { share } else { NONE.to_owned() }
        })
        .column("after, median / longest, s", |found| {
            match (found.noticed_after_median_s, found.noticed_after_worst_s) {
                (Some(middle), Some(longest)) => format!("{} / {}", number(middle), number(longest)),
                _ => NONE.to_owned(),
            }
        })
        .table
}

pub(super) fn worst(numbers: &Numbers) -> Table {
    Table::of(3, &numbers.worst)
        .column("controller", |worst| code(&worst.controller))
        .column("scenario, craft", |worst| {
            format!("`{}`, {}", worst.scenario, worst.craft)
        })
        .column("replay", |worst| replay(worst.run))
        .column("run", |worst| worst.run.to_string())
        .column("value", |worst| number(worst.value))
        .column("reference's run", |worst| {
            worst.reference_run.map_or(NONE.to_owned(), |run| run.to_string())
        })
        .column("its value", |worst| optional(worst.reference_value))
        .column("ratio", |worst| match (worst.by, worst.measure) {
            (Some(by), Some(measure)) => delta(measure).to_owned() + &number(by),
            _ => NONE.to_owned(),
        })
        .table
}

pub(super) fn effects(numbers: &Numbers) -> Table {
    let third = |third: Option<Third>, measure| {
        third.map_or(NONE.to_owned(), |third| {
            let [least, most] = third.parameter.map(number);
            let text = format!(
                "{least} to {most}: {}{} {}",
                delta(measure),
                number(third.estimate),
                interval(third.student_95)
            );
            text.trim_end().to_owned()
        })
    };
    Table::of(3, &numbers.effects)
        .column("parameter", |effect| {
            code(effect.parameter.trim_start_matches(PARAMETER))
        })
        .column("controller", |effect| code(&effect.controller))
        .column("metric", |effect| code(&effect.metric))
        .column("replicates", |effect| integer(effect.n_replicates))
        .column("Spearman", |effect| {
            effect
                .spearman
                .map_or(NONE.to_owned(), |rho| signed(&format!("{rho:.2}")))
        })
        .column("p", |effect| probability(effect.p))
        .column("p, Holm", |effect| probability(effect.p_holm))
        .column("lowest third", |effect| third(effect.thirds[0], effect.measure))
        .column("middle third", |effect| third(effect.thirds[1], effect.measure))
        .column("highest third", |effect| third(effect.thirds[2], effect.measure))
        .table
}

pub(super) fn failures(numbers: &Numbers) -> Table {
    let shown = numbers.failures.len().min(FAILURES);
    Table::of(4, &numbers.failures[..shown])
        .column("controller", |failure| code(&failure.controller))
        .column("scenario, craft", |failure| {
            format!("`{}`, {}", failure.scenario, failure.craft)
        })
        .column("failure", |failure| failure.reason.clone())
        .column("replay", |failure| replay(failure.run))
        .column("run", |failure| failure.run.to_string())
        .table
}

fn scenario(name: Option<&str>) -> String {
    name.map_or(ALL.to_owned(), code)
}

fn replay(run: u64) -> String {
    format!("`pilotfish campaign replay DIR {run}`")
}

fn delta(measure: Measure) -> &'static str {
    match measure {
        Measure::Ratio => "",
        Measure::Difference => "Δ ",
    }
}

fn estimate(found: &Comparison) -> String {
    match (found.estimate, found.measure) {
        (None, _) => NONE.to_owned(),
        (Some(estimate), Measure::Ratio) => number(estimate),
        (Some(estimate), Measure::Difference) => format!("Δ {} {}", number(estimate), found.unit),
    }
}
