//! Panels on a page of HTML: one legend that shows and hides lines, one cursor for all.

use std::ops::Range;

use maud::{Markup, PreEscaped, html};
use plotters::style::RGBColor;
use serde::Serialize;

use super::{
    Line, Panel,
    palette::{dark_style, hex},
    panel::{Picture, Scale},
};

/// Width of a panel across the page, units: letters are then as large as those of the page beside it.
const WIDTH: u32 = 1900;
/// What the name of a reference ends in: it is shown and hidden with what it is the reference of.
const REFERENCE: &str = ", reference";

/// What the legend and the cursor do.
pub(crate) const SCRIPT: &str = include_str!("on_page.js");

/// How charts look.
pub(crate) fn style() -> String {
    include_str!("on_page.css").to_owned() + &dark_style()
}

/// A track on a map that the cursor follows.
pub(crate) struct Moving<'a> {
    pub(crate) line: &'a Line,
    /// Time of each of its points, s.
    pub(crate) time: Vec<f64>,
}

/// What the script reads of a chart.
#[derive(Serialize)]
struct Data<'a> {
    x: Scale,
    y: Scale,
    lines: Vec<DataLine<'a>>,
}

#[derive(Serialize)]
struct DataLine<'a> {
    name: &'a str,
    colour: String,
    /// Time and value; on a map time, right and up.
    points: Vec<Vec<f64>>,
}

/// Names of the colours in `panels`, each with a switch. A colour has one entry in all of them.
pub(crate) fn legend<'a>(panels: impl IntoIterator<Item = &'a Panel>) -> Markup {
    let mut entries: Vec<(RGBColor, Vec<&str>)> = vec![];
    for line in panels.into_iter().flat_map(|panel| &panel.lines) {
        let name = line.name.strip_suffix(REFERENCE).unwrap_or(&line.name);
        match entries.iter_mut().find(|(colour, _)| *colour == line.colour) {
            Some((_, names)) if !names.contains(&name) => names.push(name),
            Some(_) => {}
            None => entries.push((line.colour, vec![name])),
        }
    }
    html! {
        nav.legend {
            @for (colour, names) in entries {
                @let colour = hex(colour);
                label {
                    input type="checkbox" checked value=(colour);
                    svg viewBox="0 0 24 10" aria-hidden="true" {
                        line x1="0" y1="5" x2="24" y2="5" stroke-width="4" stroke=(colour) {}
                    }
                    (names.join(", "))
                }
            }
        }
    }
}

/// Panels over one time axis, one below the other.
pub(crate) fn over_time(panels: &[Panel]) -> Markup {
    let ranges = panels.iter().map(Panel::across);
    let x = ranges.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
    html! { @for panel in panels { (time_chart(panel, x.clone())) } }
}

fn time_chart(panel: &Panel, x: Option<Range<f64>>) -> Markup {
    let Picture { svg, x, y } = panel.picture(WIDTH, x);
    let line = |line| DataLine::new(line, line.finite().map(|(time, value)| vec![time, value]));
    let lines = panel.lines.iter().map(line).collect();
    figure("over-time", panel.y_label, &svg, &Data { x, y, lines })
}

/// A map with the tracks that the cursor follows, as wide as the `share` of the page.
pub(crate) fn map(panel: &Panel, moving: &[Moving], share: f64) -> Markup {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of some thousands, and the cast saturates"
    )]
    let width = (f64::from(WIDTH) * share) as u32;
    let Picture { svg, x, y } = panel.picture(width, None);
    let lines = moving.iter().map(|Moving { line, time }| {
        let points = time.iter().zip(&line.points);
        DataLine::new(line, points.map(|(time, (right, up))| vec![*time, *right, *up]))
    });
    let lines = lines.collect();
    figure("map", "map", &svg, &Data { x, y, lines })
}

fn figure(class: &str, label: &str, svg: &str, data: &Data) -> Markup {
    let data = serde_json::to_string(data).expect("strings, numbers and lists only");
    html! {
        figure class=(class) data-chart=(data) role="img" aria-label=(label) tabindex="0" {
            // The library has escaped its texts.
            (PreEscaped(svg))
        }
    }
}

impl<'a> DataLine<'a> {
    fn new(line: &'a Line, points: impl Iterator<Item = Vec<f64>>) -> Self {
        Self {
            name: &line.name,
            colour: hex(line.colour),
            points: points
                .map(|point| point.into_iter().map(rounded).collect())
                .collect(),
        }
    }
}

/// Thousandths are below what anyone sees, and short to write.
fn rounded(value: f64) -> f64 {
    const THOUSAND: f64 = 1e3;
    (value * THOUSAND).round() / THOUSAND
}
