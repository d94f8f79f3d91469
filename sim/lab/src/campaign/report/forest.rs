//! Ratios with their intervals as SVG, a panel a controller and a row a scenario: a forest plot.
//!
//! The charts of [`crate::chart`] have numbers on both axes and no logarithms; this one has names on one axis.

use maud::{Markup, html};

use super::tables::{ALL, is_significant};
use crate::{
    campaign::statistics::{Comparison, Measure},
    chart::{BLACK_INK, BLUE, Colour, VERMILION},
};

/// What is not told apart from the reference; darker than the chart's grey, as thin lines are drawn in it.
const UNDECIDED: Colour = "#5F6B76";
const GRID: Colour = "#E2E6EA";

/// Units of the document.
const WIDTH: f64 = 1600.0;
const MARGIN: f64 = 20.0;
const FONT: f64 = 22.0;
/// Width of a letter over the font size.
const LETTER_WIDTH: f64 = 0.62;
const LEGEND_HEIGHT: f64 = 84.0;
const HEADING_HEIGHT: f64 = 48.0;
const ROW_HEIGHT: f64 = 40.0;
const AXIS_HEIGHT: f64 = 84.0;
/// Panels beside each other.
const COLUMNS: usize = 3;
/// Room between panels.
const GAP: f64 = 36.0;
/// Half the height of a bracket of the bootstrap, and of a mark.
const BRACKET: f64 = 11.0;
const MARK: f64 = 8.0;

/// Intervals that reach further than this factor beyond every estimate are cut, and end in arrows.
const REACH: f64 = 3.0;
/// Room beyond the outermost values, as a share of the axis.
const ROOM: f64 = 0.05;
/// An axis that spans less than this factor has evenly spaced ticks.
const NARROW: f64 = 4.0;

/// The picture of one metric's comparisons; none without a ratio.
pub(super) fn picture(all: &[&Comparison], metric: &str, reference: &str) -> Option<String> {
    let ratios: Vec<&Comparison> = all
        .iter()
        .copied()
        .filter(|found| found.measure == Measure::Ratio && found.estimate.is_some())
        .collect();
    let axis = Axis::of(&ratios)?;
    let (controllers, scenarios) = (
        distinct(all.iter().map(|found| found.controller.as_str())),
        distinct(all.iter().map(|found| name(found))),
    );
    let letters = scenarios
        .iter()
        .map(|name| name.chars().count())
        .max()
        .unwrap_or(0);
    let left = MARGIN + f64::from(u32::try_from(letters).unwrap_or(u32::MAX)) * LETTER_WIDTH * FONT + MARGIN;
    let columns = COLUMNS.min(controllers.len());
    let n_columns = f64::from(u32::try_from(columns).unwrap_or(1));
    let width = (WIDTH - left - MARGIN - (n_columns - 1.0) * GAP) / n_columns;
    let n_rows = f64::from(u32::try_from(scenarios.len()).unwrap_or(u32::MAX));
    let band = HEADING_HEIGHT + n_rows * ROW_HEIGHT + AXIS_HEIGHT;
    let n_bands = f64::from(u32::try_from(controllers.len().div_ceil(columns)).unwrap_or(1));
    let height = LEGEND_HEIGHT + n_bands * band;
    let title = format!("{metric}: ratio to {reference}, by scenario");
    let bands = (0_u32..).zip(controllers.chunks(columns));
    let picture = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {WIDTH} {height}")) role="img" aria-label=(title)
            font-family="DejaVu Sans, Verdana, sans-serif" font-size=(FONT) fill=(BLACK_INK) {
            rect width="100%" height="100%" fill="#FFFFFF" {}
            (legend(&title))
            @for (k, names) in bands {
                g transform=(format!("translate(0 {})", LEGEND_HEIGHT + f64::from(k) * band)) {
                    @for (i, scenario) in (0_u32..).zip(&scenarios) {
                        text x=(left - MARGIN) y=(row(i)) text-anchor="end" dominant-baseline="central"
                            font-weight=[(*scenario == ALL).then_some("bold")] { (scenario) }
                    }
                    @for (i, controller) in (0_u32..).zip(names) {
                        g transform=(format!("translate({} 0)", place(left + f64::from(i) * (width + GAP)))) {
                            (Panel { controller, scenarios: &scenarios, axis, width }.drawn(all))
                        }
                    }
                }
            }
        }
    };
    Some(picture.into_string())
}

/// The row of a comparison.
fn name(found: &Comparison) -> &str {
    found.scenario.as_deref().unwrap_or(ALL)
}

/// Middle of the row of that number.
fn row(number: u32) -> f64 {
    HEADING_HEIGHT + (f64::from(number) + 0.5) * ROW_HEIGHT
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut all = vec![];
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

fn legend(title: &str) -> Markup {
    let y = 62.0;
    let entry = |x: f64, colour: Colour, words: &str| {
        html! {
            circle cx=(x) cy=(y) r=(MARK) fill=(colour) {}
            text x=(x + 18.0) y=(y) dominant-baseline="central" { (words) }
        }
    };
    html! {
        text x=(MARGIN) y="24" dominant-baseline="central" font-size="27" { (title) }
        (entry(MARGIN + MARK, BLUE, "less than the reference"))
        (entry(360.0, VERMILION, "more"))
        (entry(480.0, UNDECIDED, "not told apart (Holm, 5 %)"))
        line x1="860" x2="930" y1=(y) y2=(y) stroke=(BLACK_INK) stroke-width="3" {}
        text x="944" y=(y) dominant-baseline="central" { "95 %, Student" }
        path d=(format!("M1160 {} v{} M1200 {} v{}", y - BRACKET, 2.0 * BRACKET, y - BRACKET, 2.0 * BRACKET))
            stroke=(BLACK_INK) stroke-width="2" fill="none" {}
        text x="1216" y=(y) dominant-baseline="central" { "95 %, bootstrap" }
    }
}

/// A controller beside the reference.
struct Panel<'a> {
    controller: &'a str,
    scenarios: &'a [&'a str],
    axis: Axis,
    width: f64,
}

impl Panel<'_> {
    fn drawn(&self, all: &[&Comparison]) -> Markup {
        let n_rows = u32::try_from(self.scenarios.len()).unwrap_or(u32::MAX);
        let bottom = HEADING_HEIGHT + f64::from(n_rows) * ROW_HEIGHT;
        let x = |ratio: f64| place(self.axis.share(ratio) * self.width);
        html! {
            text x=(place(self.width / 2.0)) y=(HEADING_HEIGHT / 2.0) text-anchor="middle" dominant-baseline="central"
                font-weight="bold" { (self.controller) }
            @for (ratio, label) in self.axis.ticks(self.width) {
                line x1=(x(ratio)) x2=(x(ratio)) y1=(HEADING_HEIGHT) y2=(bottom) stroke=(GRID) {}
                text x=(x(ratio)) y=(bottom + 28.0) text-anchor="middle" { (label) }
            }
            line x1=(x(1.0)) x2=(x(1.0)) y1=(HEADING_HEIGHT) y2=(bottom) stroke=(BLACK_INK) stroke-width="2" {}
            rect x="0" y=(HEADING_HEIGHT) width=(place(self.width)) height=(bottom - HEADING_HEIGHT) fill="none" stroke=(GRID) {}
            text x="0" y=(bottom + 62.0) fill=(UNDECIDED) { "← less" }
            text x=(place(self.width)) y=(bottom + 62.0) text-anchor="end" fill=(UNDECIDED) { "more →" }
            @for (i, scenario) in (0_u32..).zip(self.scenarios) {
                @let found = all.iter().find(|found| found.controller == self.controller && name(found) == *scenario);
                @if let Some(found) = found { (self.comparison(found, row(i))) }
            }
        }
    }

    fn comparison(&self, found: &Comparison, y: f64) -> Markup {
        let (Some(estimate), Measure::Ratio) = (found.estimate, found.measure) else {
            let words = match found.measure {
                Measure::Difference => "0 or below: see the table",
                Measure::Ratio => "no pair",
            };
            return html! {
                text x=(place(self.width / 2.0)) y=(y) text-anchor="middle" dominant-baseline="central" fill=(UNDECIDED) font-size="18" { (words) }
            };
        };
        let colour = match (is_significant(found), estimate < 1.0) {
            (false, _) => UNDECIDED,
            (true, true) => BLUE,
            (true, false) => VERMILION,
        };
        let x = |ratio: f64| place(self.axis.share(ratio).clamp(0.0, 1.0) * self.width);
        let student = found.student_95.unwrap_or([estimate; 2]);
        let bracket = |ratio: f64| {
            let inside = (0.0..=1.0).contains(&self.axis.share(ratio));
            inside.then(|| format!("M{} {} v{}", x(ratio), y - BRACKET, 2.0 * BRACKET))
        };
        let brackets: Vec<String> = found
            .bootstrap_95
            .into_iter()
            .flatten()
            .filter_map(bracket)
            .collect();
        let overall = found.scenario.is_none();
        html! {
            line x1=(x(student[0])) x2=(x(student[1])) y1=(y) y2=(y) stroke=(colour) stroke-width="3" {}
            @if self.axis.share(student[0]) < 0.0 { (arrow(0.0, y, 1.0, colour)) }
            @if 1.0 < self.axis.share(student[1]) { (arrow(place(self.width), y, -1.0, colour)) }
            path d=(brackets.join(" ")) stroke=(colour) stroke-width="2" fill="none" {}
            @if overall { path d=(format!("M{} {} l{r} {r} l-{r} {r} l-{r} -{r} z", x(estimate), y - MARK - 3.0, r = MARK + 3.0)) fill=(colour) {} }
            @else { circle cx=(x(estimate)) cy=(y) r=(MARK) fill=(colour) {} }
        }
    }
}

/// The end of an interval that reaches beyond the axis.
fn arrow(x: f64, y: f64, inwards: f64, colour: Colour) -> Markup {
    let back = place(x + 14.0 * inwards);
    html! { path d=(format!("M{x} {y} L{back} {} L{back} {} z", y - MARK, y + MARK)) fill=(colour) {} }
}

/// A logarithmic axis.
#[derive(Clone, Copy)]
struct Axis {
    /// Logarithms of its ends.
    low: f64,
    high: f64,
}

impl Axis {
    /// What the estimates need, 1 and most of the intervals; none without an estimate.
    fn of(all: &[&Comparison]) -> Option<Self> {
        let finite = |value: &f64| value.is_finite();
        let centres = || {
            all.iter()
                .filter_map(|found| found.estimate)
                .map(f64::ln)
                .filter(finite)
        };
        let least = centres().reduce(f64::min)?.min(0.0);
        let most = centres().reduce(f64::max)?.max(0.0);
        let ends = || {
            all.iter()
                .filter_map(|found| found.student_95)
                .flatten()
                .map(f64::ln)
                .filter(finite)
        };
        let low = ends().fold(least, f64::min).max(least - REACH.ln());
        let high = ends().fold(most, f64::max).min(most + REACH.ln());
        let room = (ROOM * (high - low)).max(0.01);
        Some(Self {
            low: low - room,
            high: high + room,
        })
    }

    /// Where a ratio is, as a share of the axis.
    fn share(self, ratio: f64) -> f64 {
        (ratio.ln() - self.low) / (self.high - self.low)
    }

    /// Ratios to be named, with their names, as many as a panel of that width has room for.
    fn ticks(self, width: f64) -> Vec<(f64, String)> {
        let (low, high) = (self.low.exp(), self.high.exp());
        let room = width / (4.5 * LETTER_WIDTH * FONT);
        let mut step = 10_f64.powf((high - low).log10().floor() - 1.0);
        let even = |step: f64| {
            let first = (low / step).ceil();
            let all = (0..100_u32).map(move |k| (first + f64::from(k)) * step);
            all.take_while(|value| *value <= high).collect::<Vec<f64>>()
        };
        let mut values = decades(low, high);
        if high < NARROW * low {
            for factor in [2.0, 2.5, 2.0].into_iter().cycle().take(6) {
                values = even(step);
                #[expect(clippy::cast_precision_loss, reason = "a hundred ticks")]
                if values.len() as f64 <= room {
                    break;
                }
                step *= factor;
            }
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and 6"
        )]
        let decimals = |value: f64| (-value.log10().floor()).clamp(0.0, 6.0) as usize;
        let digits = if high < NARROW * low { decimals(step) } else { 0 };
        let named = values.into_iter().map(|value| {
            let digits = digits.max(decimals(value * 1.000_001));
            (value, format!("{value:.digits$}"))
        });
        named.collect()
    }
}

/// 1, 2 and 5 times powers of ten; powers of ten alone where these are many.
fn decades(low: f64, high: f64) -> Vec<f64> {
    let (first, last) = (low.log10().floor(), high.log10().ceil());
    let factors: &[f64] = if last - first <= 3.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let powers = (0..40_u32)
        .map(|k| first + f64::from(k))
        .take_while(|power| *power <= last);
    powers
        .flat_map(|power| factors.iter().map(move |factor| factor * 10_f64.powf(power)))
        .filter(|value| (low..=high).contains(value))
        .collect()
}

/// A coordinate with the digits that can be seen.
fn place(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}
