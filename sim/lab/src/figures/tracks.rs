//! Maps: paths and tracks, north up.

use nalgebra::Vector2;
use sim::record::{Record, SurfaceCraftRow};

use super::Both;
use crate::chart::{Axes, BLACK_INK, BLUE, GREEN, GREY, Line, PURPLE, Panel, Sheet, Stroke, VERMILION};

/// Fig. 3: underwater vehicles and their paths.
pub(super) fn alone(record: &Record) -> Sheet {
    sheet(vec![map(record.title.clone(), under_water(record))])
}

/// Figs. 8 and 14: the same under the surface craft, with either controller.
pub(super) fn both(both: &Both) -> Sheet {
    beside(both, |_| None)
}

/// Fig. 15: with the goal, which is none of the vehicles.
pub(super) fn both_with_goal(both: &Both) -> Sheet {
    beside(both, |record| Some(goal(record, "midpoint")))
}

/// A map for each controller, with the line that `more` makes.
fn beside(both: &Both, more: impl Fn(&Record) -> Option<Line>) -> Sheet {
    let maps = sides(both).map(|(heading, record)| {
        let mut lines = under_water(record);
        lines.extend(more(record));
        lines.push(surface_craft(record));
        map(heading.to_owned(), lines)
    });
    sheet(maps.into())
}

fn goal(record: &Record, name: &str) -> Line {
    Line {
        name: name.to_owned(),
        colour: PURPLE,
        stroke: Stroke::Wide,
        points: craft_points(record, |craft| craft.goal),
    }
}

fn sides(both: &Both) -> [(&'static str, &Record); 2] {
    [
        ("planner", &both.planner),
        ("line of sight, tuned", &both.line_of_sight),
    ]
}

fn sheet(panels: Vec<Panel>) -> Sheet {
    Sheet {
        columns: panels.len(),
        panels,
    }
}

fn map(heading: String, lines: Vec<Line>) -> Panel {
    Panel {
        heading,
        x_label: "east, m".into(),
        y_label: "north, m".into(),
        axes: Axes::Map,
        lines,
    }
}

fn under_water(record: &Record) -> Vec<Line> {
    let paths = record.paths.iter().map(|path| Line {
        name: "path".into(),
        colour: GREY,
        stroke: Stroke::Wide,
        points: path.iter().map(east_north).collect(),
    });
    let tracks = record.auv_ids.iter().enumerate().map(|(i, id)| Line {
        name: id.clone(),
        colour: [BLUE, GREEN, VERMILION][i % 3],
        stroke: Stroke::Track,
        points: record
            .rows
            .iter()
            .filter_map(|row| row.auvs.get(i))
            .map(|auv| east_north(&auv.position))
            .collect(),
    });
    paths.chain(tracks).collect()
}

fn surface_craft(record: &Record) -> Line {
    Line {
        name: "surface craft".into(),
        colour: BLACK_INK,
        stroke: Stroke::Track,
        points: craft_points(record, |craft| craft.position),
    }
}

fn craft_points(record: &Record, of: fn(&SurfaceCraftRow) -> Vector2<f64>) -> Vec<(f64, f64)> {
    let craft = record.rows.iter().filter_map(|row| row.surface_craft.as_ref());
    craft.map(|craft| east_north(&of(craft))).collect()
}

fn east_north(point: &Vector2<f64>) -> (f64, f64) {
    (point.y, point.x)
}
