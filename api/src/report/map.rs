//! The map: bounds, paths, goal and tracks, a metre as long north as east.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::{angle::direction, snapshot::KeepOut};
use plotly::{
    Configuration, Layout, Plot, Scatter,
    common::{DashType, Fill, HoverInfo, Line, Mode},
    layout::{Axis, HoverMode, Legend, Margin},
};
use sim::record::Record;

use super::{Shown, escaped};

/// Colours of the runs' surface craft, the first two those of the service's page.
pub(super) const CRAFT: [&str; 6] = ["#0b6bb0", "#d4571b", "#10202c", "#b59a00", "#8f9aa5", "#c2185b"];
/// Colours of the underwater vehicles.
pub(super) const DIVERS: [&str; 4] = ["#1d7f5f", "#8a5a00", "#56b4e9", "#cc79a7"];
const GOAL: &str = "#7a5bb5";
const PATH: &str = "#b9c4ce";
const BAD: &str = "#b3261e";

pub(super) fn plot(runs: &[Shown]) -> Plot {
    let mut plot = Plot::new();
    plot.set_configuration(configuration());
    plot.set_layout(
        Layout::new()
            .hover_mode(HoverMode::Closest)
            .margin(Margin::new().left(64).right(16).top(24).bottom(68))
            .legend(
                Legend::new()
                    .x(0.01)
                    .y(0.99)
                    .background_color("rgba(255,255,255,0.8)"),
            )
            .x_axis(Axis::new().title("east, m").zero_line(false))
            .y_axis(Axis::new().title("north, m").zero_line(false).scale_anchor("x")),
    );
    let Some(first) = runs.first().map(|run| run.record) else {
        return plot;
    };
    draw_bounds(&mut plot, first);
    for (i, path) in first.paths.iter().enumerate() {
        let trace = outline(path, "path").legend_group("path").show_legend(i == 0);
        plot.add_trace(trace.line(Line::new().color(PATH).width(6.0)));
    }
    // The goal is the same in every run: it follows the underwater vehicles, which nobody disturbs.
    let goal = tracks(first, |row| Some(row.surface_craft.as_ref()?.goal));
    if !goal.is_empty() {
        plot.add_trace(
            track(&goal, "goal", GOAL).line(Line::new().color(GOAL).width(1.5).dash(DashType::Dot)),
        );
    }
    for (i, id) in first.diver_ids.iter().enumerate() {
        let points = tracks(first, |row| Some(row.divers.get(i)?.position));
        plot.add_trace(track(&points, id, DIVERS[i % DIVERS.len()]));
    }
    for run in runs {
        let points = tracks(run.record, |row| Some(row.surface_craft.as_ref()?.position));
        if !points.is_empty() {
            let trace = track(&points, &run.record.guide, run.colour);
            plot.add_trace(trace.visible(run.visible.clone()));
        }
    }
    plot
}

/// No logo: its link would leave the page.
pub(crate) fn configuration() -> Configuration {
    Configuration::new()
        .responsive(true)
        .scroll_zoom(true)
        .display_logo(false)
}

/// Thousandths are below what anybody sees, and short to write.
pub(crate) fn rounded(value: f64) -> f64 {
    const THOUSAND: f64 = 1e3;
    (value * THOUSAND).round() / THOUSAND
}

struct Point {
    time: f64,
    position: Vector2<f64>,
}

fn tracks(record: &Record, of: impl Fn(&sim::record::Row) -> Option<Vector2<f64>>) -> Vec<Point> {
    let points = record.rows.iter().map(|row| {
        Some(Point {
            time: row.time,
            position: of(row)?,
        })
    });
    points.flatten().collect()
}

fn track(points: &[Point], name: &str, colour: &'static str) -> Box<Scatter<f64, f64>> {
    let (east, north) = east_north(points.iter().map(|point| point.position));
    Scatter::new(east, north)
        .name(escaped(name))
        .mode(Mode::Lines)
        .line(Line::new().color(colour).width(2.0))
        .custom_data(points.iter().map(|point| rounded(point.time)).collect::<Vec<_>>())
        .hover_template("%{customdata} s<br>north %{y:.2f} m<br>east %{x:.2f} m")
}

fn outline(points: &[Vector2<f64>], name: &str) -> Box<Scatter<f64, f64>> {
    let (east, north) = east_north(points.iter().copied());
    Scatter::new(east, north)
        .name(name)
        .mode(Mode::Lines)
        .hover_info(HoverInfo::Skip)
}

fn draw_bounds(plot: &mut Plot, record: &Record) {
    let line = || Line::new().color(BAD).width(1.5);
    let area = &record.bounds.area;
    if let Some(first) = area.first() {
        let closed: Vec<_> = area.iter().chain([first]).copied().collect();
        plot.add_trace(outline(&closed, "area").line(line().dash(DashType::Dash)));
    }
    for (i, disc) in record.bounds.keep_outs.iter().enumerate() {
        let trace = outline(&circle(disc), "keep out").line(line());
        let trace = trace.legend_group("keep out").show_legend(i == 0);
        plot.add_trace(trace.fill(Fill::ToSelf).fill_color("rgba(179,38,30,0.15)"));
    }
}

fn circle(disc: &KeepOut) -> Vec<Vector2<f64>> {
    /// Enough to look round.
    const CORNERS: u32 = 72;
    let corner = |k| disc.centre + direction(f64::from(k) / f64::from(CORNERS) * TAU) * disc.radius;
    (0..=CORNERS).map(corner).collect()
}

fn east_north(points: impl Iterator<Item = Vector2<f64>>) -> (Vec<f64>, Vec<f64>) {
    points.map(|point| (rounded(point.y), rounded(point.x))).unzip()
}
