//! Quantities over time, one below the other on one time axis.

use sim::record::{AuvRow, SurfaceCraftRow};

use super::Shown;
use crate::{
    chart::{AUVS, Axes, Line, Panel, Stroke},
    unwrap::unwrap,
};

/// Height of one panel, units.
const HEIGHT: u32 = 360;

/// The panels of `runs` that have something to show.
pub(super) fn panels(runs: &[Shown]) -> Vec<Panel> {
    let panels = [
        distance(runs),
        speed(runs),
        heading(runs),
        up("cross-track, m", auvs(runs, |auv| auv.cross_track)),
        depth(runs),
        solve_time(runs),
    ];
    let shows = |panel: &Panel| panel.lines.iter().any(|line| !line.points.is_empty());
    panels.into_iter().filter(shows).collect()
}

fn up(y_label: &'static str, lines: Vec<Line>) -> Panel {
    Panel::over_time(y_label, Axes::Time(HEIGHT), lines)
}

fn distance(runs: &[Shown]) -> Panel {
    let line = |run| craft(run, SurfaceCraftRow::distance);
    up("distance to goal, m", runs.iter().map(line).collect())
}

fn speed(runs: &[Shown]) -> Panel {
    let mut lines = vec![];
    for run in runs {
        lines.push(craft(run, |craft| craft.surge));
        lines.push(reference(craft(run, |craft| craft.reference.speed)));
    }
    if !has_surface_craft(runs) {
        lines = auvs(runs, |auv| auv.surge);
        lines.extend(auvs(runs, |auv| auv.reference.surge).into_iter().map(reference));
    }
    up("speed, m/s", lines)
}

fn heading(runs: &[Shown]) -> Panel {
    let pairs: Vec<[Line; 2]> = if has_surface_craft(runs) {
        let pair = |run| {
            [
                craft(run, |craft| craft.reference.heading.radians()),
                craft(run, |craft| craft.heading),
            ]
        };
        runs.iter().map(pair).collect()
    } else {
        let references = auvs(runs, |auv| auv.reference.heading);
        let headings = auvs(runs, |auv| auv.heading);
        references.into_iter().zip(headings).map(Into::into).collect()
    };
    let lines = pairs.into_iter().flat_map(|mut pair| {
        unwrap(&mut pair);
        let [wanted, actual] = pair;
        [reference(wanted), actual]
    });
    up("heading, °", lines.collect())
}

fn depth(runs: &[Shown]) -> Panel {
    Panel::over_time("depth, m", Axes::Depth(HEIGHT), auvs(runs, |auv| auv.depth))
}

fn solve_time(runs: &[Shown]) -> Panel {
    let line = |run| craft_where(run, |craft| craft.solve_ms);
    up("solve time, ms", runs.iter().map(line).collect())
}

fn has_surface_craft(runs: &[Shown]) -> bool {
    runs.iter().any(|run| run.record.limits.is_some())
}

fn reference(line: Line) -> Line {
    Line {
        name: format!("{}, reference", line.name),
        stroke: Stroke::Dashed,
        ..line
    }
}

fn craft(run: &Shown, of: fn(&SurfaceCraftRow) -> f64) -> Line {
    craft_where(run, |craft| Some(of(craft)))
}

fn craft_where(run: &Shown, of: impl Fn(&SurfaceCraftRow) -> Option<f64>) -> Line {
    let rows = run.record.rows.iter();
    Line {
        name: run.record.guide.clone(),
        colour: run.colour,
        stroke: Stroke::Solid,
        points: rows
            .filter_map(|row| Some((row.time, of(row.surface_craft.as_ref()?)?)))
            .collect(),
    }
}

/// Of the first run: the underwater vehicles do the same in all of them.
fn auvs(runs: &[Shown], of: fn(&AuvRow) -> f64) -> Vec<Line> {
    let Some(record) = runs.first().map(|run| run.record) else {
        return vec![];
    };
    let line = |(i, id): (usize, &String)| Line {
        name: id.clone(),
        colour: AUVS[i % AUVS.len()],
        stroke: Stroke::Solid,
        points: record
            .rows
            .iter()
            .filter_map(|row| Some((row.time, of(row.auvs.get(i)?))))
            .collect(),
    };
    record.auv_ids.iter().enumerate().map(line).collect()
}
