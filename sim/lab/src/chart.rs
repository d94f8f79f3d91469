//! Lines on axes as an SVG document: title, one legend for all panels, panels in columns.

use plotters::{
    coord::Shift,
    element::DashedPathElement,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

mod on_page;
mod palette;
mod panel;

pub(crate) use on_page::{Moving, SCRIPT, legend, map, over_time, style};
pub(crate) use palette::{AUVS, BOUND, GOAL, PATH, RUNS};

/// Colours that colour-blind readers tell apart. Source: M. Okabe, K. Ito, "Color Universal Design", 2008.
pub(crate) const BLACK_INK: RGBColor = RGBColor(0, 0, 0);
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(crate) const VERMILION: RGBColor = RGBColor(213, 94, 0);
pub(crate) const PURPLE: RGBColor = RGBColor(204, 121, 167);
/// For paths, which lie under what follows them.
pub(crate) const GREY: RGBColor = RGBColor(165, 172, 180);
const GRID: RGBColor = RGBColor(226, 230, 234);

/// Pixels to a unit of the document. The library rounds coordinates to whole pixels, which shows on curves.
const FINE: u32 = 4;
/// Pixels.
const WIDTH: u32 = 1600 * FINE;
const TITLE_HEIGHT: u32 = 60 * FINE;
const LEGEND_ROW_HEIGHT: u32 = 40 * FINE;
const HEADING_HEIGHT: u32 = 44 * FINE;
const LEFT_LABELS: u32 = 104 * FINE;
const BOTTOM_LABELS: u32 = 76 * FINE;
const MARGIN: u32 = 20 * FINE;
const DOT_RADIUS: u32 = 8 * FINE;
/// Length of a dash and of the gap after it, pixels.
const DASH: (i32, i32) = (44, 28);
/// Font sizes in the unit of the library, 1.24 of a pixel size.
const TITLE_FONT: u32 = 36 * FINE;
const FONT: u32 = 28 * FINE;
/// Width of a letter over the font size: DejaVu Sans, wider than most, has 0.6 of a pixel size on average.
const LETTER_WIDTH: f64 = 0.52;

/// A page of panels.
pub(crate) struct Sheet {
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

/// Axes and what is drawn in them.
pub(crate) struct Panel {
    pub(crate) heading: String,
    pub(crate) x_label: &'static str,
    pub(crate) y_label: &'static str,
    pub(crate) axes: Axes,
    pub(crate) lines: Vec<Line>,
}

impl Panel {
    /// Without a heading, over time in seconds.
    pub(crate) fn over_time(y_label: &'static str, axes: Axes, lines: Vec<Line>) -> Self {
        Self {
            heading: String::new(),
            x_label: "time, s",
            y_label,
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

/// A line and its name in the legend. Equal names share an entry.
#[derive(Clone)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) colour: RGBColor,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<(f64, f64)>,
}

/// How a line is drawn.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Stroke {
    /// Thick, for what others are drawn upon.
    Wide,
    Solid,
    Dashed,
    /// Solid, with a dot where it begins.
    Track,
    /// No line, a dot at each point.
    Dots,
    /// A closed line and what it surrounds.
    Filled,
}

impl Stroke {
    fn width(self) -> u32 {
        match self {
            Self::Wide => 8 * FINE,
            Self::Solid | Self::Track | Self::Dots => 3 * FINE,
            Self::Dashed | Self::Filled => 2 * FINE,
        }
    }
}

/// What the library says of a document in memory: nothing, because nothing in it can fail.
const IN_MEMORY: &str = "a drawing in memory has nothing to fail on";

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Sheet {
    /// The document.
    pub(crate) fn svg(&self, title: &str) -> String {
        let entries = self.legend();
        let rows = entries.last().map_or(0, |entry| entry.row + 1);
        let header = TITLE_HEIGHT + rows * LEGEND_ROW_HEIGHT;
        let heights: Vec<u32> = self
            .panels
            .chunks(self.columns)
            .map(|row| {
                row.iter()
                    .map(|panel| panel.height(self.panel_width()))
                    .max()
                    .unwrap_or(0)
            })
            .collect();
        let mut text = String::new();
        let size = (WIDTH, header + heights.iter().sum::<u32>());
        {
            let canvas = SVGBackend::with_string(&mut text, size).into_drawing_area();
            canvas.fill(&WHITE).expect(IN_MEMORY);
            let (head, mut rest) = canvas.split_vertically(header);
            let at = (pixel(MARGIN), pixel(TITLE_HEIGHT / 2));
            head.draw(&Text::new(title, at, left(TITLE_FONT)))
                .expect(IN_MEMORY);
            for entry in &entries {
                entry.draw(&head);
            }
            for (panels, height) in self.panels.chunks(self.columns).zip(heights) {
                let (row, below) = rest.split_vertically(height);
                rest = below;
                for (area, panel) in row.split_evenly((1, self.columns)).iter().zip(panels) {
                    panel.draw(area, None);
                }
            }
            canvas.present().expect(IN_MEMORY);
        }
        in_units(&text, size)
    }

    fn panel_width(&self) -> u32 {
        WIDTH / u32::try_from(self.columns.max(1)).unwrap_or(1)
    }

    fn legend(&self) -> Vec<Entry<'_>> {
        let mut entries: Vec<Entry<'_>> = vec![];
        let (mut x, mut row) = (MARGIN, 0);
        for line in self.panels.iter().flat_map(|panel| &panel.lines) {
            if entries.iter().any(|entry| entry.line.name == line.name) {
                continue;
            }
            let width = Entry::width(&line.name);
            if MARGIN < x && WIDTH < x + width {
                (x, row) = (MARGIN, row + 1);
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
    x: u32,
    row: u32,
}

impl Entry<'_> {
    const SAMPLE: u32 = 56 * FINE;
    const GAP: u32 = 12 * FINE;

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "names have tens of letters, and the cast saturates"
    )]
    fn width(name: &str) -> u32 {
        let letters = name.chars().count() as f64 * LETTER_WIDTH * f64::from(FONT);
        Self::SAMPLE + Self::GAP + letters as u32 + 2 * Self::GAP
    }

    fn draw(&self, head: &Canvas<'_>) {
        let y = pixel(TITLE_HEIGHT + self.row * LEGEND_ROW_HEIGHT + LEGEND_ROW_HEIGHT / 2);
        let (from, to) = (pixel(self.x), pixel(self.x + Self::SAMPLE));
        let style = self.line.colour.stroke_width(self.line.stroke.width());
        let sample = [(from, y), (to, y)];
        match self.line.stroke {
            Stroke::Dashed => head.draw(&DashedPathElement::new(sample, DASH.0, DASH.1, style)),
            Stroke::Wide | Stroke::Solid | Stroke::Track | Stroke::Filled => {
                head.draw(&PathElement::new(sample, style))
            }
            Stroke::Dots => head.draw(&self.line.dot((i32::midpoint(from, to), y))),
        }
        .expect(IN_MEMORY);
        let at = (to + pixel(Self::GAP), y);
        head.draw(&Text::new(self.line.name.as_str(), at, left(FONT)))
            .expect(IN_MEMORY);
    }
}

impl Line {
    fn dot<Coordinates>(&self, at: Coordinates) -> Circle<Coordinates, u32> {
        Circle::new(at, DOT_RADIUS, self.colour.filled())
    }

    fn finite(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
        self.points.iter().copied().filter(finite)
    }
}

/// The document of `size` pixels with its extent in units. The view box keeps the pixels.
fn in_units(svg: &str, size: (u32, u32)) -> String {
    let extent = |pixels: u32| format!("width=\"{}\" height=\"{}\"", size.0 / pixels, size.1 / pixels);
    svg.replacen(&extent(1), &extent(FINE), 1)
}

fn font(size: u32) -> TextStyle<'static> {
    ("DejaVu Sans, Verdana, sans-serif", size)
        .into_font()
        .color(&BLACK_INK)
}

/// Text that begins at its place.
fn left(size: u32) -> TextStyle<'static> {
    font(size).pos(Pos::new(HPos::Left, VPos::Center))
}

fn pixel(pixels: u32) -> i32 {
    i32::try_from(pixels).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_of_nothing_is_still_a_picture() {
        let panel = Panel {
            heading: "a < b & c".into(),
            x_label: "x",
            y_label: "y",
            axes: Axes::Map,
            lines: vec![],
        };
        let sheet = Sheet {
            columns: 1,
            panels: vec![panel],
        };
        let svg = sheet.svg("<title>");
        assert!(
            svg.contains("a &lt; b &amp; c") && svg.contains("&lt;title&gt;"),
            "{svg}"
        );
        assert!(
            svg.contains("width=\"1600\"") && svg.contains("viewBox=\"0 0 6400 "),
            "{svg}"
        );
        assert!(svg.trim_end().ends_with("</svg>"));
    }
}
