//! The source paper's figures, from missions flown here.
//!
//! Where the paper shows its line-of-sight law, a figure also shows the planner on the same scenario and
//! seed. [`PaperMissions`] flies, [`page()`] draws and compares the paper's numbers with the measured ones.

use sim::record::Record;

use crate::{
    chart::{Panel, Sheet},
    document::{Block, Document},
};

mod missions;
mod over_time;
mod stated;
mod tracks;

pub use missions::{Both, PaperMissions};

/// A page with the nine figures in the paper's order and the paper's numbers beside the measured ones, and these numbers as a
/// Markdown table.
#[must_use]
pub fn page(missions: &PaperMissions) -> (String, String) {
    let PaperMissions {
        path_following: alone,
        tracking,
        intermittent,
        midpoint,
    } = missions;
    let (above, in_turn, between) = (&tracking.planner, &intermittent.planner, &midpoint.planner);
    let figures: [(u8, &Record, &str, usize, Vec<Panel>); 9] = [
        (
            3,
            alone,
            "An AUV finds its lawn-mower path and stays on it.",
            1,
            tracks::alone(alone),
        ),
        (
            4,
            alone,
            "Its depth: a sawtooth between two limits.",
            1,
            over_time::depth(alone),
        ),
        (
            5,
            alone,
            "Its distance from the point of the path that it follows.",
            1,
            over_time::path_error(alone),
        ),
        (
            6,
            alone,
            "References of its inner loops, and what they do.",
            1,
            over_time::inner_loops(alone),
        ),
        (
            8,
            above,
            "A surface craft above one AUV.",
            2,
            tracks::both(tracking),
        ),
        (
            9,
            above,
            "The surface craft's place relative to the AUV, along and across the AUV's course.",
            1,
            over_time::relative(tracking),
        ),
        (
            10,
            above,
            "Surge, pitch and heading of both craft; the surface craft has no pitch to steer.",
            2,
            over_time::both_craft(tracking),
        ),
        (
            14,
            in_turn,
            "A surface craft that looks after two AUVs in turn.",
            2,
            tracks::both(intermittent),
        ),
        (
            15,
            between,
            "A surface craft that keeps to the midpoint of two AUVs.",
            2,
            tracks::both_with_goal(midpoint),
        ),
    ];
    let numbers = stated::stated(missions);
    let mut blocks = vec![
        Block::Heading(1, "The paper's figures, flown again".to_owned()),
        Block::Paragraph(
            "Dots mark where a track begins. The paper steers by line of sight; the planner is drawn beside it.".to_owned(),
        ),
    ];
    for (number, record, caption, columns, panels) in figures {
        let title = format!("Fig. {number}: {}, seed {}", record.scenario, record.seed);
        blocks.push(Block::Sheet(Sheet {
            title,
            columns,
            panels,
        }));
        blocks.push(Block::Paragraph(caption.to_owned()));
    }
    blocks.extend([
        Block::Heading(2, "The paper's numbers and the measured ones".to_owned()),
        Block::Table(numbers.clone()),
    ]);
    (
        Document(blocks).html(),
        Document(vec![Block::Table(numbers)]).markdown(),
    )
}
