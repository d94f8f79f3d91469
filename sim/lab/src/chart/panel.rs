//! One panel: its axes, and the lines in them.

use std::ops::Range;

use plotters::{coord::types::RangedCoordf64, prelude::*};
use serde::Serialize;

use super::{
    Axes, BLACK_INK, BOTTOM_LABELS, Canvas, DASH, FINE, FONT, GRID, HEADING_HEIGHT, IN_MEMORY, LEFT_LABELS,
    Line, MARGIN, Panel, Stroke, font, in_units, left, pixel,
};

/// How much of its colour a filled area keeps.
const FILL: f64 = 0.15;

/// Where the values of one axis are: those at two places of the picture, pixels. In JSON a list of four.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Scale(f64, f64, i32, i32);

/// A panel alone.
pub(super) struct Picture {
    /// A whole SVG document, transparent where nothing is drawn.
    pub(super) svg: String,
    pub(super) x: Scale,
    pub(super) y: Scale,
}

impl Panel {
    /// The panel alone, `width` units wide, over `x` or what its lines need.
    pub(super) fn picture(&self, width: u32, x: Option<Range<f64>>) -> Picture {
        let width = width * FINE;
        let size = (width, self.height(width));
        let mut svg = String::new();
        let (x, y) = {
            let canvas = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            let scales = self.draw(&canvas, x);
            canvas.present().expect(IN_MEMORY);
            scales
        };
        Picture {
            svg: in_units(&svg, size),
            x,
            y,
        }
    }

    pub(super) fn height(&self, width: u32) -> u32 {
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

    /// Draws it into `area`, over `x` or what its lines need; where the values of both axes then are.
    pub(super) fn draw(&self, area: &Canvas<'_>, x: Option<Range<f64>>) -> (Scale, Scale) {
        let (strip, body) = area.split_vertically(self.heading_height());
        let at = (pixel(LEFT_LABELS + MARGIN), pixel(HEADING_HEIGHT / 2));
        strip
            .draw(&Text::new(self.heading.as_str(), at, left(FONT)))
            .expect(IN_MEMORY);

        let (mut x, mut y) = (x.unwrap_or_else(|| self.across()), self.range(|point| point.1));
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
            .build_cartesian_2d(x.clone(), y.clone())
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
            draw_line(&mut chart, line, up);
        }
        let (across, down) = chart.plotting_area().get_pixel_range();
        (
            Scale(x.start, x.end, across.start, across.end),
            Scale(up * y.end, up * y.start, down.start, down.end),
        )
    }

    /// What the lines need from left to right.
    pub(super) fn across(&self) -> Range<f64> {
        self.range(|point| point.0)
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

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws `line` with its values times `up`.
fn draw_line(chart: &mut Chart<'_, '_>, line: &Line, up: f64) {
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
        Stroke::Filled => {
            let corners: Vec<_> = points.clone().collect();
            let inside = Polygon::new(corners.clone(), line.colour.mix(FILL));
            chart.draw_series([inside]).expect(IN_MEMORY);
            chart
                .draw_series([PathElement::new(corners, style)])
                .expect(IN_MEMORY);
        }
        Stroke::Dots => {}
    }
    let dots = match line.stroke {
        Stroke::Dots => usize::MAX,
        Stroke::Track => 1,
        Stroke::Wide | Stroke::Solid | Stroke::Dashed | Stroke::Filled => 0,
    };
    chart
        .draw_series(points.take(dots).map(|at| line.dot(at)))
        .expect(IN_MEMORY);
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
    fn a_scale_leads_from_a_value_to_the_pixel_where_it_is_drawn() {
        let at = |Scale(from, to, start, end): Scale, value: f64| {
            f64::from(start) + f64::from(end - start) * (value - from) / (to - from)
        };
        for axes in [Axes::Time(300), Axes::Depth(300)] {
            let panel = Panel {
                heading: String::new(),
                x_label: "x",
                y_label: "y",
                axes,
                lines: vec![Line {
                    name: "a".into(),
                    colour: BLACK_INK,
                    stroke: Stroke::Dots,
                    points: vec![(0.0, 2.0), (10.0, 2.0), (3.0, 7.0)],
                }],
            };
            let Picture { svg, x, y } = panel.picture(1000, None);
            let (cx, cy) = (at(x, 3.0), at(y, 7.0));
            let drawn = svg.match_indices("<circle cx=\"").map(|(i, tag)| {
                let mut numbers = svg[i + tag.len()..].split('"').step_by(2);
                [numbers.next(), numbers.next()]
                    .map(|number| number.and_then(|text| text.parse::<f64>().ok()))
            });
            let last = drawn.last().expect("three dots");
            let [Some(drawn_x), Some(drawn_y)] = last else {
                panic!("{last:?}")
            };
            // The library rounds to whole pixels.
            assert!(
                (cx - drawn_x).abs() < 1.0 && (cy - drawn_y).abs() < 1.0,
                "{cx} {cy} {last:?}"
            );
        }
    }
}
