//! The report as a document: headings, texts, tables, pictures.

use super::{numbers::Numbers, pareto, tables, words::integer};
use crate::document::{Block, Document, Table};

const METHOD: &str = "Controllers are compared under the same conditions: same start, water, noise and parameters. A ratio is the geometric \
    mean of the paired ratios to the reference; below 1 is better. Brackets hold 95 % intervals. The interval is Student's, of the mean \
    logarithm. With one scenario and \
    one craft, each replicate is an observation. With several craft or scenarios, the mean of each case (a scenario with a craft) is \
    one observation: the interval then describes other scenarios and craft, not more replicates. Where a value is 0 or \
    below, a difference replaces the ratio, marked Δ. Wins are the share of pairs in which the controller has less (a tie counts \
    half), with Wilson's interval. p is that of the paired t-test on the same observations; Holm's correction covers all \
    comparisons of this report. **Bold** marks a significant difference from the reference (5 %, after the correction).";

const CLAIMS: &str = "The claims of the campaign file, decided for each controller and scenario. `beside` is the controller, of those that the \
    claim names, with the least mean of the first objective under the scored conditions, which favours it. A controller that \
    does not use paths which the scenario grants is not judged there. Intervals are Student's.";

const WINNERS: &str = "The least mean of each metric among controllers that know no more than the scenario grants. After `=` follow those \
    that a paired 95 % interval does not distinguish from it. A law is judged at the gains that were tuned for the metric's objective, if \
    the file asks for them.";

const SCORES: &str = "Means ± half of their 95 % interval (Student): over replicates of one craft, or over craft where there are several. **Bold** marks the \
    least (the first of equals). `beyond` counts episodes per run beyond a limit or bound. Gains of tuned laws are look-ahead, m / along-track, 1/s / \
    integral, m/s.";

const PARETO: &str = "Means over the conditions of a scenario. The table lists the planners and those points of the laws that no other law's \
    point dominates. The picture shows all points that are at most twice as far off as the nearest.";

const ESTIMATED: &str = "What the planner learnt of its craft after 300 s, compared with step tests of the craft. The error is the absolute \
    difference. The stated interval is ± 1.96 standard deviations and should contain the step test in 95 % of the runs.";

const ALARMS: &str = "An alarm is `craft_does_not_follow`; it is false wherever nothing breaks. `noticed` counts runs with a new alarm after \
    the breakdown.";

const WORST: &str = "For each planner, the ten conditions with the largest ratio to the reference. `pilotfish campaign replay DIR RUN` flies a run again \
    and writes its page; DIR is the campaign's directory.";

const EFFECTS: &str = "Spearman's rank correlation between a parameter and the ratio to the reference: below 0, a larger parameter favours the \
    controller. Each replicate is one observation, as its parameters are the same in all cases. Holm's correction covers all \
    rows of this table. Thirds are by the parameter's value; each cell shows the range, the ratio and its Student interval.";

/// The document.
pub(super) fn document(numbers: &Numbers) -> Document {
    let about = &numbers.campaign;
    let mut blocks = vec![
        heading(1, &about.title),
        paragraph(&tables::introduction(numbers)),
    ];
    blocks.extend(section(
        "Controllers, scenarios, parameters",
        "",
        tables::controllers(numbers),
    ));
    blocks.push(Block::Table(tables::cases(numbers)));
    if !numbers.parameters.is_empty() {
        blocks.push(Block::Table(tables::parameters(numbers)));
    }
    blocks.extend(section("Claims", CLAIMS, tables::claims(numbers)));
    if 1 < numbers.controllers.len() {
        blocks.extend(section("Winners", WINNERS, tables::winners(numbers)));
    }
    if let Some(metrics) = &numbers.pareto_metrics
        && !numbers.pareto.is_empty()
    {
        blocks.extend([
            heading(2, &format!("{} and {}", metrics[0], metrics[1])),
            paragraph(PARETO),
            Block::Sheet(pareto::picture(&numbers.pareto, metrics)),
            Block::Table(tables::pareto(numbers, metrics)),
        ]);
    }
    if !numbers.comparisons.is_empty() {
        blocks.extend([
            heading(2, &format!("Beside {}", about.reference)),
            paragraph(METHOD),
        ]);
    }
    for metric in &numbers.metrics {
        let comparisons = numbers.comparisons.iter();
        let of_it: Vec<_> = comparisons.filter(|found| found.metric == *metric).collect();
        if of_it.is_empty() {
            continue;
        }
        blocks.extend([heading(3, metric), Block::Table(tables::comparisons(&of_it))]);
    }
    blocks.extend(section("Worst runs", WORST, tables::worst(numbers)));
    blocks.extend(section("Effect of parameters", EFFECTS, tables::effects(numbers)));
    blocks.extend(section(
        "Learning the craft",
        ESTIMATED,
        tables::estimated(numbers),
    ));
    blocks.extend(section(
        "Detection of breakdowns",
        ALARMS,
        tables::alarms(numbers),
    ));
    let scores = tables::scores(numbers);
    if !scores.is_empty() {
        blocks.extend([heading(2, "Scenarios"), paragraph(SCORES)]);
    }
    for (scenario, table) in scores {
        blocks.extend([heading(3, &scenario), Block::Table(table)]);
    }
    if !numbers.failures.is_empty() {
        let shown = numbers.failures.len().min(tables::FAILURES);
        let text = format!(
            "{} of {} missions failed; {shown} are listed. They are in no ratio.",
            integer(numbers.failures.len()),
            integer(about.n_rows)
        );
        blocks.extend(section("Failures", &text, tables::failures(numbers)));
    }
    Document(blocks)
}

fn heading(level: usize, words: &str) -> Block {
    Block::Heading(level, words.to_owned())
}

fn paragraph(words: &str) -> Block {
    Block::Paragraph(words.to_owned())
}

/// A heading, a text and a table; nothing if the table has no rows.
fn section(name: &str, text: &str, table: Table) -> Vec<Block> {
    if table.rows.is_empty() {
        return vec![];
    }
    let mut blocks = vec![heading(2, name)];
    if !text.is_empty() {
        blocks.push(paragraph(text));
    }
    blocks.push(Block::Table(table));
    blocks
}
