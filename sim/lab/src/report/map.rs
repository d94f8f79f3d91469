//! The map: bounds, paths, goal and tracks, a metre as long north as east.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{angle::direction, snapshot::KeepOut};
use sim::record::{Record, Row};

use super::Shown;
use crate::chart::{AUVS, Axes, BOUND, GOAL, Line, Moving, PATH, Panel, Stroke};

/// The map of `runs`, its tracks last.
pub(super) fn panel(runs: &[Shown]) -> Panel {
    let mut lines = vec![];
    if let Some(first) = runs.first().map(|run| run.record) {
        lines.extend(bounds(first));
        lines.extend(first.paths.iter().map(|path| Line {
            name: "path".into(),
            colour: PATH,
            stroke: Stroke::Wide,
            points: path.iter().map(east_north).collect(),
        }));
        lines.extend(tracks(runs).map(|(line, _)| line));
    }
    Panel {
        heading: String::new(),
        x_label: "east, m",
        y_label: "north, m",
        axes: Axes::Map,
        lines,
    }
}

/// The tracks of `panel`, which is the map of `runs`, with their times.
pub(super) fn moving<'a>(runs: &[Shown], panel: &'a Panel) -> Vec<Moving<'a>> {
    let times: Vec<Vec<f64>> = tracks(runs).map(|(_, time)| time).collect();
    let lines = &panel.lines[panel.lines.len() - times.len()..];
    let pairs = lines.iter().zip(times);
    pairs.map(|(line, time)| Moving { line, time }).collect()
}

/// Goal, underwater vehicles and surface craft, each with the times of its points. Goal and underwater vehicles are
/// the same in every run: nothing that the craft does disturbs them.
fn tracks<'a>(runs: &'a [Shown]) -> impl Iterator<Item = (Line, Vec<f64>)> + 'a {
    let first = runs.first().map(|run| run.record).into_iter();
    let goal = first.clone().map(|record| {
        track(record, "goal", GOAL, Stroke::Dashed, |row| {
            Some(row.surface_craft.as_ref()?.goal)
        })
    });
    let auvs = first.flat_map(|record| {
        record.auv_ids.iter().enumerate().map(move |(i, id)| {
            let colour = AUVS[i % AUVS.len()];
            track(record, id, colour, Stroke::Track, |row| {
                Some(row.auvs.get(i)?.position)
            })
        })
    });
    let craft = runs.iter().map(|run| {
        track(run.record, &run.record.guide, run.colour, Stroke::Track, |row| {
            Some(row.surface_craft.as_ref()?.position)
        })
    });
    goal.chain(auvs)
        .chain(craft)
        .filter(|(line, _)| !line.points.is_empty())
}

fn track(
    record: &Record,
    name: &str,
    colour: plotters::style::RGBColor,
    stroke: Stroke,
    of: impl Fn(&Row) -> Option<Vector2<f64>>,
) -> (Line, Vec<f64>) {
    let samples = record
        .rows
        .iter()
        .filter_map(|row| Some((east_north(&of(row)?), row.time)));
    let (points, time) = samples.unzip();
    let line = Line {
        name: name.to_owned(),
        colour,
        stroke,
        points,
    };
    (line, time)
}

fn bounds(record: &Record) -> Vec<Line> {
    let area = &record.bounds.area;
    let mut lines = vec![];
    if let Some(first) = area.first() {
        lines.push(Line {
            name: "area".into(),
            colour: BOUND,
            stroke: Stroke::Dashed,
            points: area.iter().chain([first]).map(east_north).collect(),
        });
    }
    lines.extend(record.bounds.keep_outs.iter().map(|disc| Line {
        name: "keep out".into(),
        colour: BOUND,
        stroke: Stroke::Filled,
        points: circle(disc).iter().map(east_north).collect(),
    }));
    lines
}

fn circle(disc: &KeepOut) -> Vec<Vector2<f64>> {
    /// Enough to look round.
    const CORNERS: u32 = 72;
    let corner = |k| disc.centre + direction(f64::from(k) / f64::from(CORNERS) * TAU) * disc.radius;
    (0..=CORNERS).map(corner).collect()
}

fn east_north(point: &Vector2<f64>) -> (f64, f64) {
    (point.y, point.x)
}
