//! The scoreboard for people and for programs: claims, winners, tables, runs.

use std::num::NonZeroUsize;

use crate::bench::{
    Board, Contender, Entry, Family, Match, Metric, TUNING_SEED,
    statistics::{Interval, mean, paired_difference, paired_ratio},
    strangers::StrangersBoard,
};
use planner::los::{LosLaw, LosTuning};

mod claims;
mod document;
mod pareto;
mod runs;
mod strangers;
#[cfg(test)]
mod tests;
mod variations;
mod verdict;
mod worst;

use claims::{best_tuned_law, verdicts};
pub use document::{Block, Document, Table};
pub use pareto::PICTURE as PARETO_PICTURE;
pub(crate) use runs::SCORES;
pub use runs::write_runs;
pub use strangers::{write_breakdowns, write_strangers};
pub use worst::{WorstRun, worst_document, worst_runs};

/// Name of the clairvoyant in tables.
const CLAIRVOYANT: &str = "clairvoyant";

/// What a board is of.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The command that makes it again.
    pub command: String,
    /// The commit it came from, if known.
    pub commit: Option<String>,
    /// How many seeds gains were found on.
    pub tuning_seeds: u64,
}

/// All that was run.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    /// Every controller in every scenario.
    pub board: Board,
    /// The planner at several prices of energy beside every gain of every law, if asked for.
    pub pareto: Option<Board>,
    /// Every law and the planner on another plant, if asked for.
    pub other_plant: Option<Board>,
    /// The planner without its parts, if asked for.
    pub ablations: Option<Board>,
    /// The planner under other circumstances, if asked for.
    pub sensitivity: Option<Board>,
    /// The planner and the best-tuned law on craft that were drawn, if asked for.
    pub strangers: Option<StrangersBoard>,
}

/// All of it as a document.
#[must_use]
pub fn document(results: &Results, provenance: &Provenance) -> Document {
    let board = &results.board;
    let mut blocks = vec![Block::Heading(1, "Benchmark".to_owned())];
    if board.matches.is_empty() {
        blocks.push(Block::Paragraph(format!("{}.", made_by(provenance))));
    } else {
        blocks.extend([
            Block::Paragraph(introduction(board, provenance)),
            Block::Heading(2, "Who knows what".to_owned()),
            Block::Table(information(board)),
            Block::Heading(2, "Claims".to_owned()),
            Block::Paragraph(CLAIMS.to_owned()),
            Block::Table(claims_table(results)),
            Block::Heading(2, "Winners".to_owned()),
            Block::Paragraph(WINNERS.to_owned()),
            Block::Table(winners(board)),
        ]);
    }
    blocks.extend(results.pareto.iter().flat_map(pareto::section));
    blocks.extend(results.other_plant.iter().flat_map(other_plant));
    blocks.extend(results.ablations.iter().flat_map(variations::ablations));
    blocks.extend(results.sensitivity.iter().flat_map(variations::sensitivity));
    blocks.extend(results.strangers.iter().flat_map(strangers::strangers));
    if !board.matches.is_empty() {
        blocks.push(Block::Heading(2, "Scenarios".to_owned()));
        blocks.push(Block::Paragraph(SCENARIOS.to_owned()));
    }
    for found in &board.matches {
        blocks.push(Block::Heading(3, found.scenario.clone()));
        blocks.push(Block::Paragraph(format!("{}.", found.title)));
        blocks.push(Block::Table(scores(found)));
    }
    Document(blocks)
}

const CLAIMS: &str = "Claims about energy at several prices and about another plant are decided on the seeds that stand in their sections \
    below, all others on the seeds above. A ratio is the geometric mean over seeds, each seed paired with itself, and in brackets its \
    95 % interval (Student's, of the logarithms). The best-tuned law is the one with the least mean RMS distance on the \
    very seeds that are scored, which favours it; beside it stand its gains for nearness, in effort too.";

const WINNERS: &str = "The least mean of each metric among those that know no more than the scenario grants, \
    `printed_los` excepted. After `=` stand those that the paired ratio to it does not tell from it with 95 % \
    confidence (the paired difference, where a value may be 0). A law is judged in energy, and in steering, at gains found for just that.";

const SCENARIOS: &str = "Means over seeds ± half of the 95 % interval; **least** in bold, in a tie the least alone. \
    `× best-tuned` is the RMS distance beside that of the best-tuned law, paired, with its interval. `beyond` counts \
    episodes per run in which the craft was beyond a limit or bound: speed, reference, turn rate, keep-out, area, \
    range, energy. Gains are look-ahead, m / along-track, 1/s / integral, m/s, for nearness; economy; steering.";

const OTHER_PLANT: &str = "Every controller on an Otter instead of a MEDUSA: heavier, slower to turn, with its own limits. The planner flies \
    under the policy that was tuned for the MEDUSA, the laws at gains that were found on the Otter. Columns as under \
    Scenarios below.";

/// The board of [`crate::bench::other_plant`].
fn other_plant(board: &Board) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(2, "On another plant".to_owned()),
        Block::Paragraph(seeded(OTHER_PLANT, board)),
    ];
    for found in board.matches.iter().filter(|found| !found.entries.is_empty()) {
        blocks.push(Block::Heading(3, format!("{} on an Otter", found.scenario)));
        blocks.push(Block::Table(scores(found)));
    }
    blocks
}

/// By which command, and from which commit.
fn made_by(provenance: &Provenance) -> String {
    let commit = provenance.commit.as_ref();
    let commit = commit.map_or(String::new(), |commit| format!(" from commit `{commit}`"));
    format!("Made by `{}`{commit}", provenance.command)
}

fn introduction(board: &Board, provenance: &Provenance) -> String {
    format!(
        "{}: {} scenarios, seeds 1 to {}; gains of the laws found on {} others, from {TUNING_SEED} on, by \
         grid search for each scenario, law and family of metrics (nearness by RMS distance, economy by energy, \
         steering by heading travel). The planner's own numbers are the same everywhere; they were chosen on these \
         scenarios, on seeds from 1 on. Distances are true ones, over the whole mission, from its very start. The same \
         command gives the same numbers on any number of threads.",
        made_by(provenance),
        board.matches.len(),
        board.seeds.len(),
        provenance.tuning_seeds,
    )
}

/// `text`, and on which seeds.
fn seeded(text: &str, board: &Board) -> String {
    format!("{text} Seeds 1 to {}.", board.seeds.len())
}

fn information(board: &Board) -> Table {
    let mut table = Table::new(2, &["controller", "information, and its use"]);
    let mut named: Vec<&Contender> = vec![];
    for entry in board.matches.iter().flat_map(|found| &found.entries) {
        if named
            .iter()
            .all(|contender| contender.name != entry.contender.name)
        {
            named.push(&entry.contender);
        }
    }
    for contender in named {
        table
            .rows
            .push(vec![format!("`{}`", contender.name), contender.information()]);
    }
    table.rows.push(vec![
        format!("`{CLAIRVOYANT}`"),
        "the truth and the whole future; a bound that no craft of that hull can beat, not a controller"
            .to_owned(),
    ]);
    table
}

fn claims_table(results: &Results) -> Table {
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
    let mut verdicts = verdicts(results);
    // Stable: within a claim the order of the scenarios stays.
    verdicts.sort_by_key(|verdict| verdict.claim);
    for verdict in verdicts {
        table.rows.push(vec![
            verdict.claim.to_owned(),
            verdict.scenario,
            verdict.controller,
            verdict.beside,
            verdict.measured,
            verdict.limit,
            if verdict.holds { "yes" } else { "**no**" }.to_owned(),
        ]);
    }
    table
}

fn winners(board: &Board) -> Table {
    let metrics = Metric::ALL.map(Metric::name);
    let mut table = Table::new(metrics.len() + 1, &[["scenario"].as_slice(), &metrics].concat());
    for found in &board.matches {
        let mut row = vec![found.scenario.clone()];
        row.extend(Metric::ALL.map(|metric| winner(found, metric)));
        table.rows.push(row);
    }
    table
}

/// The least, and those as good.
fn winner(found: &Match, metric: Metric) -> String {
    let Some(least) = found.least(metric, Contender::may_win) else {
        return String::new();
    };
    let as_good = |entry: &&Entry| {
        let other = entry.contender.name != least.contender.name;
        let (values, least) = (entry.values(metric), least.values(metric));
        let tie = match paired_ratio(&values, &least) {
            Some(ratio) => ratio.holds(1.0),
            None => paired_difference(&values, &least).holds(0.0),
        };
        other && entry.contender.may_win() && tie
    };
    let others: Vec<&str> = found
        .entries
        .iter()
        .filter(as_good)
        .map(|entry| entry.contender.name.as_str())
        .collect();
    let name = &least.contender.name;
    if others.is_empty() {
        name.clone()
    } else {
        format!("{name} = {}", others.join(" = "))
    }
}

fn scores(found: &Match) -> Table {
    let metrics = Metric::ALL.map(Metric::name);
    let mut table = Table::new(
        1,
        &[
            ["controller"].as_slice(),
            &metrics,
            &["× best-tuned", "beyond", "gains"],
        ]
        .concat(),
    );
    let law = best_tuned_law(found);
    for entry in &found.entries {
        let mut row = vec![format!("`{}`", entry.contender.name)];
        for metric in Metric::ALL {
            let text = with_half_width(&mean(&entry.values(metric)));
            let least = found.least(metric, Contender::may_win);
            let won = least.is_some_and(|least| least.contender.name == entry.contender.name);
            row.push(if won { format!("**{text}**") } else { text });
        }
        let beside = law.and_then(|law| paired_ratio(&entry.values(Metric::Rms), &law.values(Metric::Rms)));
        row.push(beside.as_ref().map_or(String::new(), ratio));
        row.push(beyond(entry));
        row.push(gains(entry));
        table.rows.push(row);
    }
    if let Some(bound) = &found.bound_rms_m {
        let mut row = vec![String::new(); table.columns.len()];
        row[0] = format!("`{CLAIRVOYANT}`");
        row[1] = with_half_width(&mean(bound));
        table.rows.push(row);
    }
    table
}

/// Episodes beyond limits and bounds, per run, by limit; nothing where there are none.
fn beyond(entry: &Entry) -> String {
    let scores = &entry.of(Family::Nearness).scores;
    let names = [
        "speed",
        "reference",
        "turn rate",
        "keep-out",
        "area",
        "range",
        "energy",
    ];
    let mut counts = [0_usize; 7];
    for score in scores {
        let found = &score.metrics.violations;
        let by_limit = [
            found.speed,
            score.reference,
            found.turn_rate,
            found.keep_out,
            found.area,
            found.range,
            found.energy,
        ];
        for (count, violation) in counts.iter_mut().zip(by_limit) {
            *count += violation.count;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "thousands of episodes, not 2⁵³")]
    let per_run = |count: usize| format!("{:.1}", count as f64 / scores.len() as f64);
    let broken = names.iter().zip(counts).filter(|(_, count)| 0 < *count);
    let texts: Vec<String> = broken
        .map(|(name, count)| format!("{name} {}", per_run(count)))
        .collect();
    texts.join(", ")
}

fn gains(entry: &Entry) -> String {
    let texts: Vec<String> = Family::ALL
        .into_iter()
        .filter_map(|family| entry.of(family).tuning)
        .map(
            |LosTuning {
                 law,
                 gains,
                 integral_gain,
             }| {
                let both = format!("{} / {}", gains.look_ahead, gains.along_track_gain);
                if law == LosLaw::Integral {
                    format!("{both} / {integral_gain}")
                } else {
                    both
                }
            },
        )
        .collect();
    texts.join("; ")
}

/// Four digits or so.
fn number(value: f64) -> String {
    let decimals = match value.abs() {
        size if size < 10.0 => 3,
        size if size < 100.0 => 2,
        size if size < 1000.0 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}").replace('-', "−")
}

fn with_half_width(interval: &Interval) -> String {
    match interval.bounds {
        Some((_, upper)) => format!(
            "{} ± {}",
            number(interval.centre),
            number(upper - interval.centre)
        ),
        None => number(interval.centre),
    }
}

fn ratio(interval: &Interval) -> String {
    match interval.bounds {
        Some((low, high)) => format!("{} [{}, {}]", number(interval.centre), number(low), number(high)),
        None => number(interval.centre),
    }
}

/// As many runs at once as there are processors.
#[must_use]
pub fn threads() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
