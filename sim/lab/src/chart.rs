//! Lines on axes as an SVG document: title, one legend for all panels, panels in columns.
//!
//! For places where no script runs: a Markdown file, a paper. What is looked at in a browser is drawn by the page's own code (crate
//! `page`), to which [`Panel`]s go as JSON.

use std::{borrow::Cow, fmt::Write as _};

use maud::{Markup, html};
use serde::Serialize;

mod axis;

use axis::{Axis, ticks};

/// A colour as SVG and style sheets write it.
pub(crate) type Colour = &'static str;

/// Colours that colour-blind readers tell apart. Source: M. Okabe, K. Ito, "Color Universal Design", 2008.
pub(crate) const BLACK_INK: Colour = "#000000";
pub(crate) const BLUE: Colour = "#0072B2";
pub(crate) const GREEN: Colour = "#009E73";
pub(crate) const VERMILION: Colour = "#D55E00";
pub(crate) const PURPLE: Colour = "#CC79A7";
/// For paths, which lie under what follows them.
pub(crate) const GREY: Colour = "#A5ACB4";
const GRID: Colour = "#E2E6EA";

/// Units of the document.
const WIDTH: f64 = 1600.0;
const TITLE_HEIGHT: f64 = 60.0;
const LEGEND_ROW_HEIGHT: f64 = 40.0;
const HEADING_HEIGHT: f64 = 44.0;
const LEFT_LABELS: f64 = 104.0;
const BOTTOM_LABELS: f64 = 76.0;
const MARGIN: f64 = 20.0;
const SAMPLE: f64 = 56.0;
const DOT_RADIUS: f64 = 8.0;
const FONT: f64 = 23.0;
const TITLE_FONT: f64 = 29.0;
/// Width of a letter over the font size: DejaVu Sans is wider than most.
const LETTER_WIDTH: f64 = 0.62;
/// A strip is still a map, and a tower still fits a page.
const MAP_HEIGHTS: std::ops::RangeInclusive<f64> = 300.0..=1000.0;

/// A page of panels.
pub(crate) struct Sheet {
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

/// Axes and what is drawn in them.
#[derive(Serialize)]
pub(crate) struct Panel {
    pub(crate) heading: String,
    pub(crate) x_label: Cow<'static, str>,
    pub(crate) y_label: Cow<'static, str>,
    pub(crate) axes: Axes,
    pub(crate) lines: Vec<Line>,
}

impl Panel {
    /// Without a heading, over time in seconds.
    pub(crate) fn over_time(y_label: impl Into<Cow<'static, str>>, axes: Axes, lines: Vec<Line>) -> Self {
        Self {
            heading: String::new(),
            x_label: "time, s".into(),
            y_label: y_label.into(),
            axes,
            lines,
        }
    }
}

/// How the axes run.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Axes {
    /// One metre is as long up as across.
    Map,
    /// Up is more; the panel's height, units.
    Time(u32),
    /// Down is more; the panel's height, units.
    Depth(u32),
}

impl Serialize for Axes {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Self::Map => "map",
            Self::Time(_) => "up",
            Self::Depth(_) => "down",
        })
    }
}

/// A line and its name in the legend. Equal names share an entry.
#[derive(Clone, Serialize)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) colour: Colour,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Line {
    fn finite(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
        self.points.iter().copied().filter(finite)
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Stroke {
    /// Thick, for what others are drawn upon.
    Wide,
    Solid,
    Dashed,
    /// Solid, with a dot where it begins.
    Track,
    /// No line, a dot at each point.
    Dots,
}

impl Stroke {
    fn width(self) -> f64 {
        match self {
            Self::Wide => 8.0,
            Self::Solid | Self::Track | Self::Dots => 3.0,
            Self::Dashed => 2.0,
        }
    }
}

impl Sheet {
    /// The document.
    pub(crate) fn svg(&self, title: &str) -> String {
        let entries = self.legend();
        let rows = entries.last().map_or(0.0, |entry| entry.row + 1.0);
        let mut top = TITLE_HEIGHT + rows * LEGEND_ROW_HEIGHT;
        let columns = f64::from(u32::try_from(self.columns.max(1)).unwrap_or(1));
        let width = WIDTH / columns;
        let mut placed = vec![];
        for row in self.panels.chunks(self.columns.max(1)) {
            for (k, panel) in (0_u32..).zip(row) {
                placed.push((panel, f64::from(k) * width, top));
            }
            top += row.iter().map(|panel| panel.height(width)).fold(0.0, f64::max);
        }
        let picture = html! {
            svg xmlns="http://www.w3.org/2000/svg" width=(WIDTH) height=(top) viewBox=(format!("0 0 {WIDTH} {top}"))
                font-family="DejaVu Sans, Verdana, sans-serif" font-size=(FONT) fill=(BLACK_INK) {
                rect width="100%" height="100%" fill="#FFFFFF" {}
                text x=(MARGIN) y=(TITLE_HEIGHT / 2.0) dominant-baseline="central" font-size=(TITLE_FONT) { (title) }
                @for entry in &entries { (entry.drawn()) }
                @for (panel, x, y) in placed { g transform=(format!("translate({x} {y})")) { (panel.drawn(width)) } }
            }
        };
        picture.into_string() + "\n"
    }

    fn legend(&self) -> Vec<Entry<'_>> {
        let mut entries: Vec<Entry<'_>> = vec![];
        let (mut x, mut row) = (MARGIN, 0.0);
        for line in self.panels.iter().flat_map(|panel| &panel.lines) {
            if entries.iter().any(|entry| entry.line.name == line.name) {
                continue;
            }
            let letters = u32::try_from(line.name.chars().count()).unwrap_or(u32::MAX);
            let width = SAMPLE + 12.0 + f64::from(letters) * LETTER_WIDTH * FONT + 24.0;
            if MARGIN < x && WIDTH < x + width {
                (x, row) = (MARGIN, row + 1.0);
            }
            entries.push(Entry { line, x, row });
            x += width;
        }
        entries
    }
}

/// A line's name, and where it stands in the legend.
struct Entry<'a> {
    line: &'a Line,
    x: f64,
    row: f64,
}

impl Entry<'_> {
    fn drawn(&self) -> Markup {
        let y = TITLE_HEIGHT + (self.row + 0.5) * LEGEND_ROW_HEIGHT;
        let ends = [(self.x, y), (self.x + SAMPLE, y)];
        html! {
            @if self.line.stroke == Stroke::Dots { (dot(self.line, (self.x + SAMPLE / 2.0, y))) } @else { (stroked(self.line, ends.into_iter())) }
            text x=(self.x + SAMPLE + 12.0) y=(y) dominant-baseline="central" { (self.line.name) }
        }
    }
}

impl Panel {
    /// Height in a column of that width.
    fn height(&self, width: f64) -> f64 {
        let heading = if self.heading.is_empty() {
            0.0
        } else {
            HEADING_HEIGHT
        };
        match self.axes {
            Axes::Time(height) | Axes::Depth(height) => f64::from(height),
            Axes::Map => {
                let [east, north] = self.limits();
                let plot = (width - LEFT_LABELS - 2.0 * MARGIN) * (north.1 - north.0) / (east.1 - east.0);
                plot.clamp(*MAP_HEIGHTS.start(), *MAP_HEIGHTS.end()) + BOTTOM_LABELS + MARGIN + heading
            }
        }
    }

    /// What the lines need across and up.
    fn limits(&self) -> [(f64, f64); 2] {
        let points = || self.lines.iter().flat_map(Line::finite);
        [
            axis::range(points().map(|p| p.0)),
            axis::range(points().map(|p| p.1)),
        ]
    }

    fn drawn(&self, width: f64) -> Markup {
        let heading = if self.heading.is_empty() {
            0.0
        } else {
            HEADING_HEIGHT
        };
        let (left, right) = (LEFT_LABELS, width - MARGIN);
        let (top, bottom) = (heading + MARGIN, self.height(width) - BOTTOM_LABELS);
        let [mut across, mut up] = self.limits();
        if self.axes == Axes::Map {
            axis::as_long_up_as_across(&mut across, &mut up, (right - left) / (bottom - top));
        }
        let x = Axis::new(across, (left, right));
        let y = match self.axes {
            Axes::Depth(_) => Axis::new(up, (top, bottom)),
            Axes::Map | Axes::Time(_) => Axis::new(up, (bottom, top)),
        };
        let at = |(across, up): (f64, f64)| (x.at(across), y.at(up));
        let middle = f64::midpoint(top, bottom);
        html! {
            @if !self.heading.is_empty() { text x=(f64::midpoint(left, right)) y=(HEADING_HEIGHT / 2.0 + 8.0) text-anchor="middle" { (self.heading) } }
            @for (value, label) in ticks(across) {
                line x1=(coordinate(x.at(value))) x2=(coordinate(x.at(value))) y1=(top) y2=(bottom) stroke=(GRID) {}
                text x=(coordinate(x.at(value))) y=(bottom + 28.0) text-anchor="middle" { (label) }
            }
            @for (value, label) in ticks(up) {
                line x1=(left) x2=(right) y1=(coordinate(y.at(value))) y2=(coordinate(y.at(value))) stroke=(GRID) {}
                text x=(left - 8.0) y=(coordinate(y.at(value))) text-anchor="end" dominant-baseline="central" { (label) }
            }
            text x=(f64::midpoint(left, right)) y=(bottom + 60.0) text-anchor="middle" { (self.x_label) }
            text transform=(format!("translate(22 {middle}) rotate(-90)")) text-anchor="middle" { (self.y_label) }
            @for line in &self.lines {
                @if line.stroke == Stroke::Dots { @for point in line.finite() { (dot(line, at(point))) } }
                @else {
                    (stroked(line, line.finite().map(at)))
                    @if line.stroke == Stroke::Track { @if let Some(first) = line.finite().next() { (dot(line, at(first))) } }
                }
            }
        }
    }
}

fn dot(line: &Line, (x, y): (f64, f64)) -> Markup {
    html! { circle cx=(coordinate(x)) cy=(coordinate(y)) r=(DOT_RADIUS) fill=(line.colour) {} }
}

fn stroked(line: &Line, points: impl Iterator<Item = (f64, f64)>) -> Markup {
    let mut list = String::new();
    for (x, y) in points {
        write!(list, "{} {} ", coordinate(x), coordinate(y)).expect("a string takes everything");
    }
    let dashes = (line.stroke == Stroke::Dashed).then_some("11 7");
    html! {
        polyline points=(list.trim_end()) fill="none" stroke=(line.colour) stroke-width=(line.stroke.width())
            stroke-linejoin="round" stroke-dasharray=[dashes] {}
    }
}

/// A coordinate with the digits that can be seen.
fn coordinate(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(axes: Axes, lines: Vec<Line>) -> Panel {
        Panel {
            heading: "a < b & c".into(),
            x_label: "x".into(),
            y_label: "y".into(),
            axes,
            lines,
        }
    }

    fn line(points: Vec<(f64, f64)>) -> Line {
        Line {
            name: "<line>".into(),
            colour: BLUE,
            stroke: Stroke::Track,
            points,
        }
    }

    #[test]
    fn a_sheet_of_nothing_is_still_a_picture() {
        let sheet = Sheet {
            columns: 1,
            panels: vec![panel(Axes::Map, vec![])],
        };
        let svg = sheet.svg("<title>");
        assert!(
            svg.contains("a &lt; b &amp; c") && svg.contains("&lt;title&gt;"),
            "{svg}"
        );
        assert!(svg.contains("width=\"1600\"") && svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_metre_on_a_map_is_as_long_up_as_across_and_nothing_infinite_is_drawn() {
        let points = vec![(0.0, 0.0), (f64::NAN, 3.0), (40.0, 0.0), (40.0, 10.0)];
        let sheet = Sheet {
            columns: 1,
            panels: vec![panel(Axes::Map, vec![line(points)])],
        };
        let svg = sheet.svg("");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let (_, rest) = svg.rsplit_once("<polyline points=\"").expect("a line");
        let (list, _) = rest.split_once('"').expect("an attribute ends");
        let numbers: Vec<f64> = list.split(' ').map(|n| n.parse().expect("a number")).collect();
        let [x0, y0, x1, _, x2, y2] = numbers[..] else {
            panic!("{list}")
        };
        assert!(((x1 - x0) / 40.0 - (y0 - y2) / 10.0).abs() < 0.02, "{list}");
        assert!((x2 - x1).abs() < 0.11);
    }

    #[test]
    fn a_panel_goes_to_the_page_with_every_point() {
        let json =
            serde_json::to_value(panel(Axes::Depth(10), vec![line(vec![(1.0, 2.5)])])).expect("is JSON");
        assert_eq!(json["axes"], "down");
        assert_eq!(json["lines"][0]["stroke"], "track");
        assert_eq!(json["lines"][0]["points"][0][1], 2.5);
    }
}
