//! The report as a document: headings, sentences, tables, pictures.

use super::{
    forest,
    numbers::{Numbers, Part},
    pareto, tables,
    words::integer,
};
use crate::{
    campaign::statistics::Comparison,
    document::{Block, Document, Table},
};

const METHOD: &str = "Controllers are compared in the same worlds: same start, water, noise and parameters. A ratio is the geometric mean \
    of the paired ratios to the reference; below 1 is better. In brackets stand 95 % intervals. Student's is that of \
    the mean logarithm. The bootstrap is BCa; ≠ marks one that differs from Student's by more than a fifth of its width. One scenario \
    with one craft takes replicates as observations. Several craft or scenarios take the mean of each arena, a scenario with a craft, as \
    one observation: that interval is about other scenarios and craft, not about more replicates. Where a value is 0 or \
    below, a difference stands instead of the ratio, marked Δ. Wins are the share of pairs in which the controller has less \
    (a tie is half of one), with Wilson's interval. p is that of the paired t-test on the same observations; Holm's correction takes all \
    comparisons of this report together. **Bold** is distinguished from the reference at 5 % after it.";

const CLAIMS: &str = "What the campaign file claims, decided controller by controller and scenario by scenario. Beside stands, of those that the file \
    names, the one with the least mean of the first objective, on the very worlds that are scored, which favours it. A controller that \
    leaves paths unused which the scenario grants is not judged there. Intervals are Student's.";

const WINNERS: &str = "The least mean of each metric among those that know no more than the scenario grants, laws as printed excepted. After `=` stand those \
    that a paired 95 % interval does not distinguish from it. A law is judged at gains that were found for the metric's objective, where the file asks \
    for them.";

const SCORES: &str = "Means ± half of their 95 % interval, Student's: over replicates of one craft, over craft where there are several. **Least** in bold, in \
    a tie the first alone. `beyond` counts episodes a run beyond a limit or bound. Gains of tuned laws are look-ahead, m / along-track, 1/s / integral, \
    m/s.";

const PARETO: &str = "Means over the worlds of a scenario. Of the laws' points only those are listed that no other point of a law beats: in neither worse, and \
    better in one. The picture shows all that are at most twice as far off as the nearest.";

const ESTIMATED: &str = "What planners make of their craft after 300 s, beside step tests of it. The error is the size of the difference. The stated interval \
    is ± 1.96 standard deviations and should hold the truth in 95 %.";

const ALARMS: &str = "`craft_does_not_follow` is false wherever nothing breaks. Noticed is an alarm that is raised anew after something broke.";

const ANSWERS: &str = "Shares of all answers of a controller's runs. A run has a median and a 99th percentile of its solve times; the table has \
    the median of the former and the largest of the latter. They depend on the machine.";

const WORST: &str = "The ten worlds with the largest ratio to the reference, for each planner. `pilotfish campaign replay DIR RUN` flies a run again \
    and writes its page; DIR is the campaign's directory.";

const EFFECTS: &str = "Spearman's rank correlation between a parameter and the ratio to the reference: below 0, a larger parameter favours the \
    controller. A replicate is one observation: its parameters are the same in every scenario and with every craft. Holm's correction takes all \
    rows of this table together. Thirds are by the parameter's values, whose range stands before the ratio and its Student interval.";

const REGRET: &str = "The bound is the RMS distance below which no craft of that hull could have come with the whole future known. Means over runs whose \
    bound is known.";

/// The document.
pub(super) fn document(numbers: &Numbers) -> Document {
    let about = &numbers.campaign;
    let mut blocks = vec![
        heading(1, &about.title),
        paragraph(&tables::introduction(numbers)),
    ];
    if about.reference_replaced {
        blocks.push(paragraph(
            "The file asks for another reference: a law as printed, which is shown and never is one.",
        ));
    }
    blocks.extend(section("What was flown", "", tables::controllers(numbers)));
    blocks.push(Block::Table(tables::arenas(numbers)));
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
            Block::Drawing(
                pareto::picture(&numbers.pareto, metrics),
                format!(
                    "Mean `{}` over mean `{}`, scenario by scenario.",
                    metrics[1], metrics[0]
                ),
            ),
            Block::Table(tables::pareto(numbers, metrics)),
        ]);
    }
    blocks.extend(section(
        &format!("Beside {}", about.reference),
        METHOD,
        tables::overall(numbers),
    ));
    for metric in &numbers.metrics {
        blocks.push(heading(3, &metric.name));
        if !metric.known {
            blocks.push(paragraph(&format!("The rows have no column `{}`.", metric.name)));
            continue;
        }
        let comparisons = numbers.comparisons.iter();
        let of_it: Vec<_> = comparisons.filter(|found| found.metric == metric.name).collect();
        let drawn: Vec<_> = of_it
            .iter()
            .copied()
            .filter(|found| is_drawn(numbers, found))
            .collect();
        if let Some(svg) = forest::picture(&drawn, &metric.name, &about.reference) {
            let shows = format!(
                "Paired ratio of `{}` to that of `{}` by scenario, with 95 % intervals, on a logarithmic axis.",
                metric.name, about.reference
            );
            blocks.push(Block::Drawing(svg, shows));
        }
        blocks.push(Block::Table(tables::comparisons(&of_it, numbers)));
    }
    blocks.extend(section("Who answered", ANSWERS, tables::answers(numbers)));
    blocks.extend(section("Worst runs", WORST, tables::worst(numbers)));
    blocks.extend(section("What parameters do", EFFECTS, tables::effects(numbers)));
    blocks.extend(section(
        "Learning the craft",
        ESTIMATED,
        tables::estimated(numbers),
    ));
    blocks.extend(section(
        "Noticing that the craft does not follow",
        ALARMS,
        tables::alarms(numbers),
    ));
    blocks.extend(section("Distance to the bound", REGRET, tables::regret(numbers)));
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
            "{} of {} missions failed; here are {shown}. They are in no ratio.",
            integer(numbers.failures.len()),
            integer(about.n_rows)
        );
        blocks.extend(section("Failures", &text, tables::failures(numbers)));
    }
    Document(blocks)
}

/// The law as printed is in the tables alone: it never wins, and others would be told apart no more on an axis that it fits on.
fn is_drawn(numbers: &Numbers, found: &Comparison) -> bool {
    let controllers = numbers.controllers.iter();
    let mut shown = controllers.filter(|controller| controller.part == Part::Shown);
    shown.all(|controller| controller.name != found.controller)
}

fn heading(level: usize, words: &str) -> Block {
    Block::Heading(level, words.to_owned())
}

fn paragraph(words: &str) -> Block {
    Block::Paragraph(words.to_owned())
}

/// Nothing where the table has no rows.
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
