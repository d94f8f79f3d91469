//! Nearness against energy.

use crate::bench::{Board, Match, Metric};
use planner::los::LosLaw;

use crate::chart::{Axes, BLACK_INK, BLUE, GREEN, Line, PURPLE, Panel, Sheet, Stroke, VERMILION};

/// Height of a panel, units.
const HEIGHT: u32 = 620;
const COLUMNS: usize = 2;

/// Laws farther off than so many times the nearest of them are left out, so that the others can be distinguished.
const SHOWN: f64 = 2.0;

/// Mean energy over mean root mean square distance, a panel a scenario, as SVG: every gain of every law a dot, the
/// planner's prices of energy joined by a line in their order.
#[must_use]
pub fn pareto_chart(board: &Board, title: &str) -> String {
    let sheet = Sheet {
        columns: COLUMNS,
        panels: board.matches.iter().map(panel).collect(),
    };
    sheet.svg(title)
}

fn panel(found: &Match) -> Panel {
    let points = |law: Option<LosLaw>| -> Vec<(f64, f64)> {
        let entries = found.entries.iter();
        entries
            .filter(|entry| entry.contender.law_flown() == law)
            .map(|entry| (entry.mean(Metric::Rms), entry.mean(Metric::Energy)))
            .collect()
    };
    let laws = LosLaw::ALL.into_iter().filter(|law| law.may_win());
    let nearest = laws.clone().flat_map(|law| points(Some(law))).map(|(rms, _)| rms);
    let farthest = SHOWN * nearest.fold(f64::INFINITY, f64::min);
    let mut lines: Vec<Line> = laws
        .zip([BLUE, GREEN, VERMILION, PURPLE])
        .map(|(law, colour)| Line {
            name: law.name().to_owned(),
            colour,
            stroke: Stroke::Dots,
            points: points(Some(law))
                .into_iter()
                .filter(|(rms, _)| *rms <= farthest)
                .collect(),
        })
        .collect();
    for stroke in [Stroke::Solid, Stroke::Dots] {
        lines.push(Line {
            name: "planner, at prices of energy from 0 on".to_owned(),
            colour: BLACK_INK,
            stroke,
            points: points(None),
        });
    }
    Panel {
        heading: found.scenario.clone(),
        x_label: "root mean square distance, m",
        y_label: "energy, J",
        axes: Axes::Time(HEIGHT),
        lines,
    }
}
