//! Quantities over time, one below the other on one time axis.

use plotly::{
    Layout, Plot, Scatter,
    common::{Anchor, DashType, Line, Mode, Orientation, Visible},
    layout::{Axis, AxisRange, HoverMode, Legend, Margin},
};
use sim::record::{DiverRow, Record, SurfaceCraftRow};

use super::{
    Shown, escaped,
    map::{DIVERS, configuration, rounded},
};
use crate::unwrap::unwrapped;

/// Height of one panel, pixels.
const PANEL_HEIGHT: usize = 230;

/// One pair of axes.
struct Panel {
    y_label: &'static str,
    down: bool,
    lines: Vec<NamedLine>,
}

struct NamedLine {
    name: String,
    colour: &'static str,
    dash: DashType,
    visible: Visible,
    time: Vec<f64>,
    values: Vec<f64>,
}

pub(super) fn plot(runs: &[Shown]) -> Plot {
    let panels: Vec<Panel> = [
        distance(runs),
        speed(runs),
        heading(runs),
        under_water(runs, "cross-track, m", |diver| diver.cross_track),
        depth(runs),
        answer_time(runs),
    ]
    .into_iter()
    .filter(|panel| panel.lines.iter().any(|line| !line.values.is_empty()))
    .collect();

    let mut plot = Plot::new();
    plot.set_configuration(configuration().scroll_zoom(false));
    plot.set_layout(layout(&panels));
    let mut named: Vec<String> = vec![];
    for (i, panel) in panels.into_iter().enumerate() {
        for line in panel.lines {
            let style = Line::new().color(line.colour).width(1.5).dash(line.dash);
            let values = line.values.into_iter().map(rounded).collect();
            let name = escaped(&line.name);
            let first = !named.contains(&name);
            // One entry shows and hides the line in every panel.
            let trace = Scatter::new(line.time, values)
                .name(&name)
                .legend_group(&name)
                .show_legend(first)
                .mode(Mode::Lines)
                .visible(line.visible)
                .line(style)
                .x_axis("x")
                .y_axis(axis_name(i));
            plot.add_trace(trace);
            named.push(name);
        }
    }
    plot
}

fn layout(panels: &[Panel]) -> Layout {
    /// Share of a panel's height that parts it from the next.
    const GAP: f64 = 0.12;
    #[expect(clippy::cast_precision_loss, reason = "a handful of panels")]
    let share = 1.0 / panels.len().max(1) as f64;
    let mut top = 1.0;
    let mut layout = Layout::new()
        .height(PANEL_HEIGHT * panels.len().max(1) + 120)
        .hover_mode(HoverMode::XUnified)
        .margin(Margin::new().left(72).right(16).top(24).bottom(56))
        .legend(
            Legend::new()
                .orientation(Orientation::Horizontal)
                .y(1.01)
                .y_anchor(Anchor::Bottom),
        );
    for (i, panel) in panels.iter().enumerate() {
        let bottom = (top - share).max(0.0);
        let axis = Axis::new()
            .title(panel.y_label)
            .zero_line(false)
            .domain(&[bottom + GAP * share, top]);
        let axis = if panel.down {
            axis.range(downwards(panel))
        } else {
            axis
        };
        layout = y_axis(layout, i, axis);
        top = bottom;
    }
    // One time axis for all panels, below the last: a zoom into one is a zoom into all.
    let lowest = axis_name(panels.len().saturating_sub(1));
    layout.x_axis(Axis::new().title("time, s").zero_line(false).anchor(lowest))
}

/// From a little below the largest value up to a little above the least.
fn downwards(panel: &Panel) -> AxisRange {
    const FREE: f64 = 0.05;
    let values = || panel.lines.iter().flat_map(|line| &line.values).copied();
    let (least, most) = (
        values().fold(f64::INFINITY, f64::min),
        values().fold(f64::NEG_INFINITY, f64::max),
    );
    let free = FREE * (most - least).max(1.0);
    AxisRange::new(most + free, least - free)
}

fn axis_name(i: usize) -> &'static str {
    ["y", "y2", "y3", "y4", "y5", "y6"][i.min(5)]
}

fn y_axis(layout: Layout, i: usize, axis: Axis) -> Layout {
    match i {
        0 => layout.y_axis(axis),
        1 => layout.y_axis2(axis),
        2 => layout.y_axis3(axis),
        3 => layout.y_axis4(axis),
        4 => layout.y_axis5(axis),
        _ => layout.y_axis6(axis),
    }
}

fn up(y_label: &'static str, lines: Vec<NamedLine>) -> Panel {
    Panel {
        y_label,
        down: false,
        lines,
    }
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
        lines = divers(runs, |diver| diver.surge);
        lines.extend(
            divers(runs, |diver| diver.reference.surge)
                .into_iter()
                .map(reference),
        );
    }
    up("speed, m/s", lines)
}

fn heading(runs: &[Shown]) -> Panel {
    let mut pairs = vec![];
    for run in runs {
        pairs.push([
            craft(run, |craft| craft.reference.heading.radians()),
            craft(run, |craft| craft.heading),
        ]);
    }
    if !has_surface_craft(runs) {
        let told = divers(runs, |diver| diver.reference.heading);
        let is = divers(runs, |diver| diver.heading);
        pairs = told.into_iter().zip(is).map(|(told, is)| [told, is]).collect();
    }
    let lines = pairs.into_iter().flat_map(|[mut told, mut is]| {
        [told.values, is.values] = unwrapped(&told.values, &is.values);
        [reference(told), is]
    });
    up("heading, °", lines.collect())
}

fn under_water(runs: &[Shown], y_label: &'static str, of: fn(&DiverRow) -> f64) -> Panel {
    up(y_label, divers(runs, of))
}

fn depth(runs: &[Shown]) -> Panel {
    Panel {
        down: true,
        ..under_water(runs, "depth, m", |diver| diver.depth)
    }
}

fn answer_time(runs: &[Shown]) -> Panel {
    let line = |run: &Shown| {
        let times = run.record.rows.iter().filter_map(|row| {
            let craft = row.surface_craft.as_ref()?;
            Some((row.time, craft.solve_ms?))
        });
        let (time, values) = times.unzip();
        NamedLine {
            time,
            values,
            ..craft(run, |_| 0.0)
        }
    };
    up("solve time, ms", runs.iter().map(line).collect())
}

fn has_surface_craft(runs: &[Shown]) -> bool {
    runs.iter().any(|run| run.record.limits.is_some())
}

fn reference(line: NamedLine) -> NamedLine {
    NamedLine {
        name: format!("{}, reference", line.name),
        dash: DashType::Dot,
        ..line
    }
}

fn craft(run: &Shown, of: fn(&SurfaceCraftRow) -> f64) -> NamedLine {
    let rows = run.record.rows.iter();
    let (time, values) = rows
        .filter_map(|row| Some((row.time, of(row.surface_craft.as_ref()?))))
        .unzip();
    NamedLine {
        name: run.record.guide.clone(),
        colour: run.colour,
        dash: DashType::Solid,
        visible: run.visible.clone(),
        time,
        values,
    }
}

/// Of the first run: the underwater vehicles do the same in all of them.
fn divers(runs: &[Shown], of: fn(&DiverRow) -> f64) -> Vec<NamedLine> {
    let line = |record: &Record, i: usize| {
        let rows = record.rows.iter();
        let (time, values) = rows
            .filter_map(|row| Some((row.time, of(row.divers.get(i)?))))
            .unzip();
        NamedLine {
            name: record.diver_ids[i].clone(),
            colour: DIVERS[i % DIVERS.len()],
            dash: DashType::Solid,
            visible: Visible::True,
            time,
            values,
        }
    };
    let records = runs.first().map(|run| run.record).into_iter();
    records
        .flat_map(|record| (0..record.diver_ids.len()).map(move |i| line(record, i)))
        .collect()
}
