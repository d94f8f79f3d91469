//! Lines on axes as an SVG document: title, one legend for all panels, panels in columns.

use std::ops::Range;

use plotters::{
    coord::Shift,
    element::DashedPathElement,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

/// Colours that colour-blind readers tell apart. Source: M. Okabe, K. Ito, "Color Universal Design", 2008.
pub(super) const BLACK_INK: RGBColor = RGBColor(0, 0, 0);
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const VERMILION: RGBColor = RGBColor(213, 94, 0);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);
/// For paths, which lie under what follows them.
pub(super) const GREY: RGBColor = RGBColor(165, 172, 180);
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
pub(super) struct Sheet {
    pub(super) columns: usize,
    pub(super) panels: Vec<Panel>,
}

/// Axes and what is drawn in them.
pub(super) struct Panel {
    pub(super) heading: String,
    pub(super) x_label: &'static str,
    pub(super) y_label: &'static str,
    pub(super) axes: Axes,
    pub(super) lines: Vec<Line>,
}

/// How the axes run.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Axes {
    /// One metre is as long up as across.
    Map,
    /// Up is more; the panel's height, units.
    Time(u32),
    /// Down is more; the panel's height, units.
    Depth(u32),
}

/// A line and its name in the legend. Equal names share an entry.
#[derive(Clone)]
pub(super) struct Line {
    pub(super) name: String,
    pub(super) colour: RGBColor,
    pub(super) stroke: Stroke,
    pub(super) points: Vec<(f64, f64)>,
}

/// How a line is drawn.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Stroke {
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
    fn width(self) -> u32 {
        match self {
            Self::Wide => 8 * FINE,
            Self::Solid | Self::Track | Self::Dots => 3 * FINE,
            Self::Dashed => 2 * FINE,
        }
    }
}

/// What the library says of a document in memory: nothing, because nothing in it can fail.
const IN_MEMORY: &str = "a drawing in memory has nothing to fail on";

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Sheet {
    /// The document.
    pub(super) fn svg(&self, title: &str) -> String {
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
            let style = font(TITLE_FONT).pos(Pos::new(HPos::Left, VPos::Center));
            head.draw(&Text::new(title, (pixel(MARGIN), pixel(TITLE_HEIGHT / 2)), style))
                .expect(IN_MEMORY);
            for entry in &entries {
                entry.draw(&head);
            }
            for (panels, height) in self.panels.chunks(self.columns).zip(heights) {
                let (row, below) = rest.split_vertically(height);
                rest = below;
                for (area, panel) in row.split_evenly((1, self.columns)).iter().zip(panels) {
                    panel.draw(area);
                }
            }
            canvas.present().expect(IN_MEMORY);
        }
        // The view box keeps the pixels.
        text.replacen(&extent(1, size), &extent(FINE, size), 1)
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
            Stroke::Wide | Stroke::Solid | Stroke::Track => head.draw(&PathElement::new(sample, style)),
            Stroke::Dots => head.draw(&self.line.dot((i32::midpoint(from, to), y))),
        }
        .expect(IN_MEMORY);
        let style = font(FONT).pos(Pos::new(HPos::Left, VPos::Center));
        let at = (to + pixel(Self::GAP), y);
        head.draw(&Text::new(self.line.name.as_str(), at, style))
            .expect(IN_MEMORY);
    }
}

impl Panel {
    fn height(&self, width: u32) -> u32 {
        /// A strip is still a map, and a tower still fits a page.
        const PLOT_HEIGHTS: Range<u32> = 300 * FINE..1000 * FINE;
        match self.axes {
            Axes::Time(height) | Axes::Depth(height) => height * FINE,
            Axes::Map => {
                let (east, north) = (self.range(|point| point.0), self.range(|point| point.1));
                let plot = f64::from(width - LEFT_LABELS - 2 * MARGIN) * span(&north) / span(&east);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "clamped to hundreds, and the cast saturates"
                )]
                let plot = (plot as u32).clamp(PLOT_HEIGHTS.start, PLOT_HEIGHTS.end);
                plot + self.heading_height() + BOTTOM_LABELS + MARGIN
            }
        }
    }

    fn heading_height(&self) -> u32 {
        if self.heading.is_empty() {
            MARGIN
        } else {
            HEADING_HEIGHT
        }
    }

    fn draw(&self, area: &Canvas<'_>) {
        let (strip, body) = area.split_vertically(self.heading_height());
        let at = (pixel(LEFT_LABELS + MARGIN), pixel(HEADING_HEIGHT / 2));
        let style = font(FONT).pos(Pos::new(HPos::Left, VPos::Center));
        strip
            .draw(&Text::new(self.heading.as_str(), at, style))
            .expect(IN_MEMORY);

        let (mut x, mut y) = (self.range(|point| point.0), self.range(|point| point.1));
        if self.axes == Axes::Map {
            let (width, height) = body.dim_in_pixel();
            let plot = (
                f64::from(width.saturating_sub(LEFT_LABELS + 2 * MARGIN)),
                f64::from(height.saturating_sub(BOTTOM_LABELS + MARGIN)),
            );
            (x, y) = equal(x, y, plot);
        }
        let up = if matches!(self.axes, Axes::Depth(_)) {
            -1.0
        } else {
            1.0
        };
        if up < 0.0 {
            y = -y.end..-y.start;
        }
        let (x_decimals, y_decimals) = (decimals(&x), decimals(&y));
        let mut chart = ChartBuilder::on(&body)
            .margin_left(MARGIN)
            .margin_right(MARGIN)
            .margin_top(MARGIN / 2)
            .margin_bottom(MARGIN / 2)
            .set_label_area_size(LabelAreaPosition::Left, LEFT_LABELS)
            .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM_LABELS)
            .build_cartesian_2d(x, y)
            .expect(IN_MEMORY);
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .set_all_tick_mark_size(5 * FINE)
            .axis_style(BLACK_INK.stroke_width(FINE))
            .x_labels(12)
            .y_labels(7)
            .x_label_formatter(&|value| label(*value, x_decimals))
            .y_label_formatter(&|value| label(up * value, y_decimals))
            .label_style(font(FONT))
            .axis_desc_style(font(FONT))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(FINE))
            .draw()
            .expect(IN_MEMORY);
        for line in &self.lines {
            let style = line.colour.stroke_width(line.stroke.width());
            let points = line.finite().map(|(x, y)| (x, up * y));
            match line.stroke {
                Stroke::Dashed => {
                    let dashes = DashedLineSeries::new(points.clone(), DASH.0, DASH.1, style);
                    chart.draw_series(dashes).expect(IN_MEMORY);
                }
                Stroke::Wide | Stroke::Solid | Stroke::Track => {
                    chart
                        .draw_series(LineSeries::new(points.clone(), style))
                        .expect(IN_MEMORY);
                }
                Stroke::Dots => {}
            }
            let dots = match line.stroke {
                Stroke::Dots => usize::MAX,
                Stroke::Track => 1,
                Stroke::Wide | Stroke::Solid | Stroke::Dashed => 0,
            };
            chart
                .draw_series(points.take(dots).map(|at| line.dot(at)))
                .expect(IN_MEMORY);
        }
    }

    fn range(&self, of: fn((f64, f64)) -> f64) -> Range<f64> {
        /// Share of the span that stays free at either end.
        const FREE: f64 = 0.04;
        let values = || self.lines.iter().flat_map(Line::finite).map(of);
        let (least, most) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        if most < least {
            return 0.0..1.0;
        }
        // A constant still needs an axis with two ends.
        let free = FREE * (most - least).max(0.1);
        least - free..most + free
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

/// The attributes that give a document of `size` pixels its extent, so many pixels to a unit.
fn extent(pixels: u32, size: (u32, u32)) -> String {
    format!("width=\"{}\" height=\"{}\"", size.0 / pixels, size.1 / pixels)
}

/// Widens one of the ranges until both have the same metres to a pixel of `plot` (width, height).
fn equal(x: Range<f64>, y: Range<f64>, plot: (f64, f64)) -> (Range<f64>, Range<f64>) {
    let metres = (span(&x) / plot.0).max(span(&y) / plot.1);
    let widened = |range: Range<f64>, pixels: f64| {
        let (centre, half) = (0.5 * (range.start + range.end), 0.5 * metres * pixels);
        centre - half..centre + half
    };
    (widened(x, plot.0), widened(y, plot.1))
}

fn span(range: &Range<f64>) -> f64 {
    range.end - range.start
}

/// Decimals that tell the labels of some eight ticks apart.
fn decimals(range: &Range<f64>) -> usize {
    match span(range) {
        span if 8.0 <= span => 0,
        span if 0.8 <= span => 1,
        span if 0.08 <= span => 2,
        _ => 3,
    }
}

fn label(value: f64, decimals: usize) -> String {
    // Not "-0".
    format!("{:.decimals$}", value + 0.0).replace('-', "\u{2212}")
}

fn font(size: u32) -> TextStyle<'static> {
    ("DejaVu Sans, Verdana, sans-serif", size)
        .into_font()
        .color(&BLACK_INK)
}

fn pixel(pixels: u32) -> i32 {
    i32::try_from(pixels).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metre_is_as_long_north_as_east_and_nothing_is_cut_off() {
        let (x, y) = equal(-5.0..5.0, 0.0..40.0, (600.0, 300.0));
        assert!((span(&x) / 600.0 - span(&y) / 300.0).abs() < 1e-12);
        assert!(x.start <= -5.0 && 5.0 <= x.end && y.start <= 0.0 && 40.0 <= y.end);
    }

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
