//! Maps: paths and tracks, north up.

use nalgebra::Vector2;
use sim::record::{Record, SurfaceCraftRow};

use super::Both;
use crate::chart::{Axes, BLACK_INK, BLUE, GREEN, GREY, Line, PURPLE, Panel, Stroke, VERMILION};

/// Fig. 3: underwater vehicles and their paths.
pub(super) fn alone(record: &Record) -> Vec<Panel> {
    vec![map(record.title.clone(), under_water(record))]
}

/// Figs. 8 and 14: the same under the surface craft, with either controller.
pub(super) fn both(both: &Both) -> Vec<Panel> {
    beside(both, |_| None)
}

/// Fig. 15: with the goal, which is not at a vehicle.
pub(super) fn both_with_goal(both: &Both) -> Vec<Panel> {
    beside(both, |record| {
        let goal = craft_points(record, |craft| craft.goal);
        Some(Line::new("midpoint", PURPLE, Stroke::Wide, goal))
    })
}

/// A map for each controller, with the line that `more` makes.
fn beside(both: &Both, more: impl Fn(&Record) -> Option<Line>) -> Vec<Panel> {
    let sides = [
        ("planner", &both.planner),
        ("line of sight, tuned", &both.line_of_sight),
    ];
    let maps = sides.map(|(heading, record)| {
        let mut lines = under_water(record);
        lines.extend(more(record));
        let track = craft_points(record, |craft| craft.position);
        lines.push(Line::new("surface craft", BLACK_INK, Stroke::Track, track));
        map(heading.to_owned(), lines)
    });
    maps.into()
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
    let paths = record.paths.iter();
    let paths = paths.map(|path| Line::new("path", GREY, Stroke::Wide, path.iter().map(east_north)));
    let tracks = record.auv_ids.iter().enumerate().map(|(i, id)| {
        let auvs = record.rows.iter().filter_map(|row| row.auvs.get(i));
        let colour = [BLUE, GREEN, VERMILION][i % 3];
        Line::new(
            id,
            colour,
            Stroke::Track,
            auvs.map(|auv| east_north(&auv.position)),
        )
    });
    paths.chain(tracks).collect()
}

fn craft_points(record: &Record, of: fn(&SurfaceCraftRow) -> Vector2<f64>) -> Vec<(f64, f64)> {
    let craft = record.rows.iter().filter_map(|row| row.surface_craft.as_ref());
    craft.map(|craft| east_north(&of(craft))).collect()
}

fn east_north(point: &Vector2<f64>) -> (f64, f64) {
    (point.y, point.x)
}
