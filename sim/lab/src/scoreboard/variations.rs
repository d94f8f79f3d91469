//! The planner without its parts and under other circumstances, as tables.

use crate::bench::{
    AUTO, Board, Contender, Entry, Match, Metric,
    statistics::{mean, paired_ratio},
};

use super::{Block, Table, beyond, ratio, seeded, with_half_width};

const ABLATIONS: &str = "The planner of `mpc auto` without each of its parts in turn: values beside those of the whole \
    planner, paired by seed, with 95 % intervals. Above 1 the part earns its place, and where it keeps limits that \
    would be broken without it. A dash stands where a part does not take part.";

const LIMITS: &str = "Episodes per run beyond a limit, where there were any.";

const SENSITIVITY: &str = "The planner of `mpc auto` under circumstances that its policy was not tuned for, and with other \
    horizons, grids and intervals: RMS distance beside that of the undisturbed planner, then beside the nearer of two \
    laws under the same circumstance, which are tuned for it. Paired by seed, with 95 % intervals.";

/// Tables of [`crate::bench::ablations`].
pub(super) fn ablations(board: &Board) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(2, "Ablations".to_owned()),
        Block::Paragraph(seeded(ABLATIONS, board)),
    ];
    for metric in [Metric::Rms, Metric::Energy, Metric::HeadingTravel] {
        blocks.push(Block::Heading(
            3,
            format!("`{}` without each part", metric.name()),
        ));
        blocks.push(Block::Table(beside_the_whole(board, metric)));
    }
    let limits = limits(board);
    if !limits.rows.is_empty() {
        blocks.push(Block::Heading(3, "Limits without each part".to_owned()));
        blocks.push(Block::Paragraph(LIMITS.to_owned()));
        blocks.push(Block::Table(limits));
    }
    blocks
}

/// What each breaks, the whole planner first.
fn limits(board: &Board) -> Table {
    let varied = varied(board);
    let names: Vec<&str> = varied.iter().map(|contender| contender.name.as_str()).collect();
    let columns = [["scenario", AUTO].as_slice(), &names].concat();
    let mut table = Table::new(columns.len(), &columns);
    for found in &board.matches {
        let broken = columns[1..]
            .iter()
            .map(|name| found.entry(name).map_or_else(missing, beyond));
        let row: Vec<String> = [found.scenario.clone()].into_iter().chain(broken).collect();
        if row[1..]
            .iter()
            .any(|broken| !broken.is_empty() && *broken != missing())
        {
            table.rows.push(row);
        }
    }
    table
}

/// Tables of [`crate::bench::sensitivity`].
pub(super) fn sensitivity(board: &Board) -> Vec<Block> {
    vec![
        Block::Heading(2, "Sensitivity".to_owned()),
        Block::Paragraph(seeded(SENSITIVITY, board)),
        Block::Heading(3, "Beside the undisturbed planner".to_owned()),
        Block::Table(beside_the_whole(board, Metric::Rms)),
        Block::Heading(3, "Beside the nearer law".to_owned()),
        Block::Table(beside_the_law(board)),
    ]
}

/// The planners on the board but the whole one, in order.
fn varied(board: &Board) -> Vec<&Contender> {
    let mut varied: Vec<&Contender> = vec![];
    for entry in board.matches.iter().flat_map(|found| &found.entries) {
        let contender = &entry.contender;
        let known = varied.iter().any(|other| other.name == contender.name);
        if !known && contender.name != AUTO && !contender.is_baseline() {
            varied.push(contender);
        }
    }
    varied
}

fn beside_the_whole(board: &Board, metric: Metric) -> Table {
    let varied = varied(board);
    let names: Vec<&str> = varied.iter().map(|contender| contender.name.as_str()).collect();
    let mut table = Table::new(1, &[["scenario", AUTO].as_slice(), &names].concat());
    for found in &board.matches {
        let Some(whole) = found.entry(AUTO) else { continue };
        let values = whole.values(metric);
        let mut row = vec![found.scenario.clone(), with_half_width(&mean(&values))];
        row.extend(
            names
                .iter()
                .map(|name| beside(found.entry(name), &values, metric)),
        );
        table.rows.push(row);
    }
    table
}

fn beside_the_law(board: &Board) -> Table {
    let disturbed: Vec<&Contender> = varied(board)
        .into_iter()
        .filter(|contender| {
            board
                .matches
                .iter()
                .any(|found| nearest_under(contender, found).is_some())
        })
        .collect();
    let names: Vec<&str> = disturbed
        .iter()
        .map(|contender| contender.name.as_str())
        .collect();
    let mut table = Table::new(1, &[["scenario"].as_slice(), &names].concat());
    for found in &board.matches {
        let mut row = vec![found.scenario.clone()];
        row.extend(
            disturbed
                .iter()
                .map(|contender| match nearest_under(contender, found) {
                    Some(law) => beside(
                        found.entry(&contender.name),
                        &law.values(Metric::Rms),
                        Metric::Rms,
                    ),
                    None => missing(),
                }),
        );
        table.rows.push(row);
    }
    table
}

/// The best-tuned law under the circumstance of `contender`; none for one under none.
fn nearest_under<'a>(contender: &Contender, found: &'a Match) -> Option<&'a Entry> {
    let variation = contender.variation?;
    found.least(Metric::Rms, |law| {
        law.is_baseline() && law.variation == Some(variation)
    })
}

fn beside(entry: Option<&Entry>, values: &[f64], metric: Metric) -> String {
    entry
        .and_then(|entry| paired_ratio(&entry.values(metric), values))
        .as_ref()
        .map_or_else(missing, ratio)
}

fn missing() -> String {
    "–".to_owned()
}
