//! The Pareto front of nearness and energy: what the planner reaches at each price of energy, beside every gain of every law.

use crate::bench::{Board, Entry, Match, Metric, statistics::mean};

use super::{Block, Table, seeded, verdict::Verdict, with_half_width};

/// Name of the picture beside the document.
pub const PICTURE: &str = "pareto.svg";

const TEXT: &str = "The planner of `mpc auto`, whose price of propulsion energy is 0, and at higher prices, beside every law \
    that may win at every gain of its grid: mean RMS distance and mean energy. Of the laws' points only those are \
    listed that no other point of a law beats in both; the picture shows all that are at most twice as far off as the nearest. \
    Of scenarios those in which the goal is known and jumps, turns about or stops: nothing is claimed where it moves \
    steadily, or where fixes are noisy, in which laws are cheaper.";

/// Table, and where the picture is.
pub(super) fn section(board: &Board) -> Vec<Block> {
    let mut table = Table::new(2, &["scenario", "controller", "rms_m", "energy_j", "beaten by"]);
    for found in &board.matches {
        let (planners, laws) = (planners(found), laws(found));
        let best = laws.iter().filter(|law| count_better(law, &laws) == 0);
        for (entry, others, whose) in planners
            .iter()
            .map(|entry| (entry, &laws, "of the laws' points"))
            .chain(best.map(|entry| (entry, &planners, "of the planner's")))
        {
            table.rows.push(vec![
                found.scenario.clone(),
                format!("`{}`", entry.contender.name),
                with_half_width(&mean(&entry.values(Metric::Rms))),
                with_half_width(&mean(&entry.values(Metric::Energy))),
                format!("{} {whose}", count_better(entry, others)),
            ]);
        }
    }
    vec![
        Block::Heading(2, "Nearness and energy".to_owned()),
        Block::Paragraph(seeded(TEXT, board)),
        Block::Picture(
            PICTURE.to_owned(),
            "Energy over RMS distance in the transient scenarios".to_owned(),
        ),
        Block::Table(table),
    ]
}

/// That no law at any gain is both nearer and cheaper than the planner at any price.
pub(super) fn undominated(board: &Board) -> Vec<Verdict> {
    let verdicts = board.matches.iter().map(|found| {
        let planners = planners(found);
        let laws = laws(found);
        let beats_one = |law: &&&Entry| planners.iter().any(|entry| count_better(entry, &[**law]) == 1);
        let beaten = laws.iter().filter(beats_one).count();
        Verdict {
            claim: "points of laws that beat one of the planner's in nearness and energy",
            scenario: found.scenario.clone(),
            controller: "mpc auto at each price of energy".to_owned(),
            beside: "all laws at all gains".to_owned(),
            measured: beaten.to_string(),
            limit: "0".to_owned(),
            holds: beaten == 0,
        }
    });
    verdicts.collect()
}

fn planners(found: &Match) -> Vec<&Entry> {
    let entries = found.entries.iter();
    entries.filter(|entry| !entry.contender.is_baseline()).collect()
}

fn laws(found: &Match) -> Vec<&Entry> {
    let entries = found.entries.iter();
    entries.filter(|entry| entry.contender.is_baseline()).collect()
}

/// How many of `others` are in the mean no farther, no dearer, and better in one of both.
fn count_better(entry: &Entry, others: &[&Entry]) -> usize {
    let point = |entry: &Entry| [Metric::Rms, Metric::Energy].map(|metric| entry.mean(metric));
    let [rms, energy] = point(entry);
    let better = |other: &&&Entry| {
        let [other_rms, other_energy] = point(other);
        other_rms <= rms && other_energy <= energy && (other_rms, other_energy) != (rms, energy)
    };
    others.iter().filter(better).count()
}
