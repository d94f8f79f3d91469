//! Tables of a report.

use super::{
    numbers::{Numbers, Part},
    words::{NONE, bold, code, integer, interval, number, or_none, percent, probability, signed, wins},
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
/// What is told apart: the probability of an error in any comparison.
const LEVEL: f64 = 0.05;
/// Name of the line on all scenarios.
pub(super) const ALL: &str = "all";

pub(super) fn introduction(numbers: &Numbers) -> String {
    let about = &numbers.campaign;
    let n_arenas: usize = numbers.arenas.iter().map(|arena| arena.craft.len()).sum();
    let lasting = about
        .duration_s
        .map_or(String::new(), |seconds| format!(" of {seconds} s at most"));
    format!(
        "Campaign `{}`, seed {}: {} scenarios, {n_arenas} with their craft, {} replicates of each; {} runs{lasting}, of {} at most; {} \
         failed. The reference is `{}`. Digest of the rows: `{}`.",
        about.name,
        about.seed,
        numbers.arenas.len(),
        integer(about.replicates),
        integer(about.n_rows),
        integer(about.n_runs_at_most),
        integer(about.n_failed),
        about.reference,
        about.digest,
    )
}

pub(super) fn controllers(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        3,
        &["controller", "information, and its use", "part", "runs", "failed"],
    );
    for controller in &numbers.controllers {
        let part = match controller.part {
            Part::Reference => "reference",
            Part::Compared => "compared",
            Part::KnowsMore => "compared; knows more than the scenario grants",
            Part::Shown => "shown as it was printed; never wins",
        };
        table.rows.push(vec![
            code(&controller.name),
            controller.information.clone(),
            part.to_owned(),
            integer(controller.n_runs),
            integer(controller.n_failed),
        ]);
    }
    table
}

pub(super) fn arenas(numbers: &Numbers) -> Table {
    let mut table = Table::new(3, &["scenario", "what happens", "craft"]);
    for arena in &numbers.arenas {
        let names = match &arena.craft[..] {
            [first, .., last] if CRAFT < arena.craft.len() => {
                format!("{} from {first} to {last}", arena.craft.len())
            }
            few => few.join(", "),
        };
        table
            .rows
            .push(vec![code(&arena.scenario), arena.title.clone(), names]);
    }
    table
}

pub(super) fn parameters(numbers: &Numbers) -> Table {
    let mut table = Table::new(2, &["parameter", "drawn from"]);
    for drawn in &numbers.parameters {
        let from = match (&drawn.uniform, &drawn.choice) {
            (Some([least, most]), _) => format!("{least} to {most}, evenly"),
            (None, Some(values)) => {
                let values: Vec<String> = values.iter().map(ToString::to_string).collect();
                format!("{}, each as likely", values.join(", "))
            }
            (None, None) => NONE.to_owned(),
        };
        table.rows.push(vec![code(&drawn.key), from]);
    }
    table
}

/// Everyone in every metric, on all scenarios.
pub(super) fn overall(numbers: &Numbers) -> Table {
    let mut columns = vec!["controller".to_owned()];
    let known = || numbers.metrics.iter().filter(|metric| metric.known);
    columns.extend(known().map(|metric| metric.name.clone()));
    let mut table = Table {
        words: 1,
        columns,
        rows: vec![],
    };
    for controller in &numbers.controllers {
        if controller.part == Part::Reference {
            continue;
        }
        let mut row = vec![code(&controller.name)];
        row.extend(known().map(|metric| {
            let found = numbers.comparisons.iter().find(|found| {
                found.controller == controller.name && found.metric == metric.name && found.scenario.is_none()
            });
            found.map_or(NONE.to_owned(), |found| {
                let interval = interval(found.student_95);
                bold(
                    format!("{} {interval}", estimate(found)).trim(),
                    is_told_apart(found, controller.part),
                )
            })
        }));
        table.rows.push(row);
    }
    table
}

/// One metric, by controller and scenario.
pub(super) fn comparisons(all: &[&Comparison], numbers: &Numbers) -> Table {
    let mut table = Table::new(
        2,
        &[
            "controller",
            "scenario",
            "pairs",
            "observations",
            "mean",
            "reference's",
            "ratio",
            "Student",
            "bootstrap",
            "median / 90 % / worst",
            "wins",
            "p",
            "p, Holm",
        ],
    );
    for found in all {
        let part = numbers
            .controllers
            .iter()
            .find(|controller| controller.name == found.controller)
            .map_or(Part::Compared, |controller| controller.part);
        let differs = if found.intervals_differ { " ≠" } else { "" };
        table.rows.push(vec![
            code(&found.controller),
            found
                .scenario
                .as_ref()
                .map_or(ALL.to_owned(), |scenario| code(scenario)),
            pairs(found),
            format!("{} {}", integer(found.n_clusters), clusters(found.cluster)),
            found.mean.map_or(NONE.to_owned(), number),
            found.reference_mean.map_or(NONE.to_owned(), number),
            bold(&estimate(found), is_told_apart(found, part)),
            or_none(interval(found.student_95)),
            or_none(interval(found.bootstrap_95) + differs),
            found
                .quantiles
                .map_or(NONE.to_owned(), |values| values.map(number).join(" / ")),
            found.wins.map_or(NONE.to_owned(), wins),
            probability(found.p),
            probability(found.p_holm),
        ]);
    }
    table
}

/// How many pairs there are, and why there are no more.
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
        Cluster::ScenarioAndCraft => "arenas",
    }
}

/// Whether it is less or more than the reference at [`LEVEL`]. The law as printed is not judged.
fn is_told_apart(found: &Comparison, part: Part) -> bool {
    part != Part::Shown && is_significant(found)
}

/// Whether the adjusted probability is below [`LEVEL`].
pub(super) fn is_significant(found: &Comparison) -> bool {
    found.p_holm.is_some_and(|p| p < LEVEL)
}

pub(super) fn claims(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        4,
        &[
            "claim",
            "scenario",
            "controller",
            "beside",
            "measured",
            "claimed",
            "holds",
        ],
    );
    for verdict in &numbers.claims {
        table.rows.push(vec![
            verdict.claim.clone(),
            verdict.scenario.clone().unwrap_or(ALL.to_owned()),
            verdict.controller.clone(),
            verdict.beside.clone().unwrap_or_default(),
            verdict.words.clone(),
            verdict.limit.clone(),
            if verdict.holds { "yes" } else { "**no**" }.to_owned(),
        ]);
    }
    table
}

pub(super) fn winners(numbers: &Numbers) -> Table {
    let known = || numbers.metrics.iter().filter(|metric| metric.known);
    let mut columns = vec!["scenario".to_owned()];
    columns.extend(known().map(|metric| metric.name.clone()));
    let mut table = Table {
        words: columns.len(),
        columns,
        rows: vec![],
    };
    for arena in &numbers.arenas {
        let mut row = vec![code(&arena.scenario)];
        row.extend(known().map(|metric| {
            let mut winners = numbers.winners.iter();
            let found =
                winners.find(|winner| winner.scenario == arena.scenario && winner.metric == metric.name);
            found.map_or(NONE.to_owned(), |winner| {
                let names = std::iter::once(&winner.controller).chain(&winner.as_good);
                names.map(|name| code(name)).collect::<Vec<_>>().join(" = ")
            })
        }));
        if row[1..].iter().any(|cell| cell != NONE) {
            table.rows.push(row);
        }
    }
    table
}

/// A table a scenario.
pub(super) fn scores(numbers: &Numbers) -> Vec<(String, Table)> {
    let known = || numbers.metrics.iter().filter(|metric| metric.known);
    let mut columns = vec!["controller".to_owned()];
    columns.extend(known().map(|metric| metric.name.clone()));
    columns.extend(["beyond".to_owned(), "gains".to_owned()]);
    let mut tables = vec![];
    for arena in &numbers.arenas {
        let here = numbers
            .scores
            .iter()
            .filter(|scores| scores.scenario == arena.scenario);
        let rows = here.map(|scores| {
            let mut row = vec![code(&scores.controller)];
            for ((mean, half), least) in scores.means.iter().zip(&scores.half_widths).zip(&scores.is_least) {
                let words = match (mean, half) {
                    (Some(mean), Some(half)) => format!("{} ± {}", number(*mean), number(*half)),
                    (Some(mean), None) => number(*mean),
                    (None, _) => NONE.to_owned(),
                };
                row.push(bold(&words, *least));
            }
            let beyond: Vec<String> = scores
                .beyond
                .iter()
                .map(|(name, mean)| format!("{name} {}", number(*mean)))
                .collect();
            row.push(beyond.join(", "));
            row.push(scores.gains.join("; "));
            row
        });
        let rows: Vec<Vec<String>> = rows.collect();
        if !rows.is_empty() {
            let table = Table {
                words: 1,
                columns: columns.clone(),
                rows,
            };
            tables.push((arena.scenario.clone(), table));
        }
    }
    tables
}

/// Planners, and the laws' points that no other of theirs beats.
pub(super) fn pareto(numbers: &Numbers, metrics: &[String; 2]) -> Table {
    let mut table = Table::new(
        2,
        &["scenario", "controller", &metrics[0], &metrics[1], "beaten by"],
    );
    for point in &numbers.pareto {
        if !point.is_planner && point.beaten_by_its_kind {
            continue;
        }
        let whose = if point.is_planner {
            "of the laws' points"
        } else {
            "of the planners"
        };
        table.rows.push(vec![
            code(&point.scenario),
            code(&point.controller),
            number(point.means[0]),
            number(point.means[1]),
            format!("{} {whose}", point.beaten_by),
        ]);
    }
    table
}

pub(super) fn estimated(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        2,
        &[
            "controller",
            "estimate",
            "runs",
            "error, median, s",
            "error, 90 %, s",
            "interval holds",
        ],
    );
    for found in &numbers.estimated {
        table.rows.push(vec![
            code(&found.controller),
            code(found.quantity),
            integer(found.n_runs),
            number(found.error_median_s),
            number(found.error_90_s),
            percent(found.held),
        ]);
    }
    table
}

pub(super) fn alarms(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        1,
        &[
            "controller",
            "runs",
            "alarms an hour",
            "runs with an alarm",
            "noticed",
            "after, median / longest, s",
        ],
    );
    for found in &numbers.alarms {
        let after = match (found.noticed_after_median_s, found.noticed_after_worst_s) {
            (Some(middle), Some(longest)) => format!("{} / {}", number(middle), number(longest)),
            _ => NONE.to_owned(),
        };
        table.rows.push(vec![
            code(&found.controller),
            integer(found.n_runs),
            number(found.per_hour),
            percent(found.alarmed),
            if found.breaks {
                format!("{} of {}", integer(found.n_noticed), integer(found.n_runs))
            } else {
                NONE.to_owned()
            },
            after,
        ]);
    }
    table
}

pub(super) fn answers(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        1,
        &[
            "controller",
            "answers",
            "MPC",
            "previous plan",
            "saturated LOS",
            "hold",
            "median solve, ms",
            "worst p99, ms",
        ],
    );
    for controller in &numbers.controllers {
        let share = |share: Option<f64>| share.map_or(NONE.to_owned(), percent);
        table.rows.push(vec![
            code(&controller.name),
            integer(controller.n_answers),
            share(controller.answers_mpc),
            share(controller.answers_previous_plan),
            share(controller.answers_saturated_los),
            share(controller.answers_hold),
            controller.solve_ms_p50_median.map_or(NONE.to_owned(), number),
            controller.solve_ms_p99_worst.map_or(NONE.to_owned(), number),
        ]);
    }
    table
}

pub(super) fn worst(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        3,
        &[
            "controller",
            "scenario, craft",
            "again",
            "run",
            "value",
            "reference's run",
            "its value",
            "ratio",
        ],
    );
    for worst in &numbers.worst {
        let delta = if worst.measure == Some(Measure::Difference) {
            "Δ "
        } else {
            ""
        };
        table.rows.push(vec![
            code(&worst.controller),
            format!("`{}`, {}", worst.scenario, worst.craft),
            format!("`pilotfish campaign replay DIR {}`", worst.run),
            worst.run.to_string(),
            number(worst.value),
            worst.reference_run.map_or(NONE.to_owned(), |run| run.to_string()),
            worst.reference_value.map_or(NONE.to_owned(), number),
            worst
                .by
                .map_or(NONE.to_owned(), |by| format!("{delta}{}", number(by))),
        ]);
    }
    table
}

pub(super) fn effects(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        3,
        &[
            "parameter",
            "controller",
            "metric",
            "replicates",
            "Spearman",
            "p",
            "p, Holm",
            "lowest third",
            "middle third",
            "highest third",
        ],
    );
    for effect in &numbers.effects {
        let third = |third: Option<Third>| {
            third.map_or(NONE.to_owned(), |third| {
                let [least, most] = third.parameter.map(number);
                let delta = if effect.measure == Measure::Difference {
                    "Δ "
                } else {
                    ""
                };
                let (estimate, interval) = (number(third.estimate), interval(third.student_95));
                format!("{least} to {most}: {delta}{estimate} {interval}")
                    .trim_end()
                    .to_owned()
            })
        };
        let mut row = vec![
            code(effect.parameter.trim_start_matches(PARAMETER)),
            code(&effect.controller),
            code(&effect.metric),
            integer(effect.n_replicates),
            effect
                .spearman
                .map_or(NONE.to_owned(), |rho| signed(&format!("{rho:.2}"))),
            probability(effect.p),
            probability(effect.p_holm),
        ];
        row.extend(effect.thirds.map(third));
        table.rows.push(row);
    }
    table
}

pub(super) fn regret(numbers: &Numbers) -> Table {
    let mut table = Table::new(
        2,
        &[
            "controller",
            "scenario",
            "runs",
            "RMS distance, m",
            "bound, m",
            "beyond it, m",
            "at worst, m",
            "run",
        ],
    );
    for regret in &numbers.regret {
        table.rows.push(vec![
            code(&regret.controller),
            regret
                .scenario
                .as_ref()
                .map_or(ALL.to_owned(), |scenario| code(scenario)),
            integer(regret.n_runs),
            number(regret.rms_m),
            number(regret.bound_rms_m),
            number(regret.beyond_bound_m),
            number(regret.beyond_bound_worst_m),
            regret.worst_run.to_string(),
        ]);
    }
    table
}

pub(super) fn failures(numbers: &Numbers) -> Table {
    let mut table = Table::new(4, &["controller", "scenario, craft", "failure", "again", "run"]);
    for failure in numbers.failures.iter().take(FAILURES) {
        table.rows.push(vec![
            code(&failure.controller),
            format!("`{}`, {}", failure.scenario, failure.craft),
            failure.reason.clone(),
            format!("`pilotfish campaign replay DIR {}`", failure.run),
            failure.run.to_string(),
        ]);
    }
    table
}

fn estimate(found: &Comparison) -> String {
    let Some(estimate) = found.estimate else {
        return NONE.to_owned();
    };
    match found.measure {
        Measure::Ratio => number(estimate),
        Measure::Difference => format!("Δ {} {}", number(estimate), found.unit),
    }
}
