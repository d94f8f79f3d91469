//! What a log says of a craft, as one page that needs no network and no other file.

use maud::{Markup, PreEscaped, html};
use plotters::style::RGBColor;

use super::{Identification, Parameter, Traces};
use crate::{
    chart::{self, Axes, Line, Panel, RUNS, SCRIPT, Stroke},
    page::one_file,
};

/// Height of one panel, units.
const HEIGHT: u32 = 340;
const MEASURED: RGBColor = RUNS[0];
const SIMULATED: RGBColor = RUNS[1];
const REFERENCE: RGBColor = RUNS[4];
/// Digits of estimates: four of six are noise already.
const DIGITS: usize = 4;

/// A page about what was `found` in the log called `name`.
#[must_use]
pub fn page(name: &str, found: &Identification) -> String {
    let craft = serde_json::to_string_pretty(&wire::Craft::from(&found.description()))
        .expect("strings, numbers and objects only");
    let panels = panels(&found.traces);
    let body = html! {
        header { h1 { (name) } p { "the craft as its log shows it" } }
        main {
            section.numbers { h2 { "Parameters, with 95\u{a0}% intervals" } (table(found)) }
            section {
                h2 { "What the log does not show" } (missing(found))
                h2 { "Craft file" } pre { (craft) }
            }
            (chart::legend(&panels))
            section #residuals.wide { (chart::over_time(&panels)) }
        }
        script { (PreEscaped(SCRIPT)) }
    };
    let style = chart::style() + include_str!("../report/report.css") + include_str!("page.css");
    one_file(&format!("{name}: the craft"), &style, &body)
}

/// A line of the table: whether it is uncertain, name, estimate and interval, remark.
struct Row<'a>(bool, &'a str, [String; 3], &'a str);

fn table(found: &Identification) -> Markup {
    html! {
        table {
            thead {
                tr { th.name { "parameter" } th { "estimate" } th { "from" } th { "to" } th.name {} }
            }
            tbody {
                @for Row(open, name, cells, remark) in rows(found) {
                    tr.open[open] {
                        td.name { (name) } @for cell in cells { td { (cell) } } td.name { (remark) }
                    }
                }
            }
        }
    }
}

fn rows(found: &Identification) -> Vec<Row<'static>> {
    let parameter = |parameter: &Parameter| {
        let Parameter {
            quantity,
            estimate,
            low,
            high,
            identified,
        } = *parameter;
        let remark = if identified { "" } else { "not identified" };
        Row(
            !identified,
            quantity.name(),
            [estimate, low, high].map(digits),
            remark,
        )
    };
    let mut rows: Vec<Row> = found.parameters.iter().map(parameter).collect();
    let one = |name, text, remark| Row(false, name, [text, String::new(), String::new()], remark);
    let craft = serde_json::to_value(wire::Craft::from(&found.description())).expect("JSON");
    for name in ["speed_held", "heading_held"] {
        rows.push(one(name, craft[name].as_str().unwrap_or("open").to_owned(), ""));
    }
    for (name, number) in [
        ("residual of heading, rad", found.heading_residual),
        ("residual of surge, m/s", found.surge_residual),
    ] {
        rows.push(one(name, digits(number), "RMS"));
    }
    let nuisance = |name, (value, sigma): (f64, f64)| {
        let half = 1.96 * sigma;
        Row(
            false,
            name,
            [value, value - half, value + half].map(digits),
            "nuisance",
        )
    };
    if let Some([north, east]) = found.current {
        rows.push(nuisance("mean current northward, m/s", north));
        rows.push(nuisance("mean current eastward, m/s", east));
    }
    if let Some(bias) = found.compass_bias {
        rows.push(nuisance("compass bias, rad", bias));
    }
    rows
}

fn missing(found: &Identification) -> Markup {
    let missing = found.missing();
    html! {
        @if missing.is_empty() {
            p { "Nothing: every parameter is in the craft file." }
        } @else {
            ul { @for quantity in missing { li { b { (quantity.name()) } ": log " (quantity.manoeuvre()) "." } } }
        }
    }
}

/// A number with as many digits as mean something.
#[must_use]
pub fn digits(number: f64) -> String {
    if number.is_infinite() {
        return "∞".to_owned();
    }
    if number == 0.0 {
        return "0".to_owned();
    }
    #[expect(clippy::cast_possible_truncation, reason = "the exponent of a double")]
    let exponent = number.abs().log10().floor() as i32;
    let decimals = i32::try_from(DIGITS)
        .map_or(0, |digits| digits - 1 - exponent)
        .clamp(0, 9);
    let decimals = usize::try_from(decimals).expect("clamped");
    format!("{number:.decimals$}")
}

fn panels(traces: &Traces) -> Vec<Panel> {
    let all = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
    let headings = [&traces.heading, &traces.heading_model, &traces.heading_reference];
    let [heading, heading_model, heading_reference] = headings.map(|values| {
        values
            .iter()
            .map(|value| Some(value.to_degrees()))
            .collect::<Vec<_>>()
    });
    [
        (
            "heading, °",
            "residual, °",
            heading,
            heading_model,
            Some(heading_reference),
        ),
        (
            "surge, m/s",
            "residual, m/s",
            traces.surge.clone(),
            all(&traces.surge_model),
            Some(all(&traces.speed_reference)),
        ),
        (
            "sway, m/s",
            "residual, m/s",
            traces.sway.clone(),
            all(&traces.sway_model),
            None,
        ),
    ]
    .into_iter()
    .flat_map(|(y_label, residual_label, measured, simulated, reference)| {
        let residual: Vec<Option<f64>> = measured
            .iter()
            .zip(&simulated)
            .map(|(measured, simulated)| Some((*measured)? - (*simulated)?))
            .collect();
        let line = |name, colour, stroke, values| line(&traces.time, name, colour, stroke, values);
        let mut lines = vec![
            line("measured", MEASURED, Stroke::Solid, measured),
            line("simulated", SIMULATED, Stroke::Solid, simulated),
        ];
        lines.extend(reference.map(|values| line("reference", REFERENCE, Stroke::Dashed, values)));
        let residual = line("measured less simulated", MEASURED, Stroke::Solid, residual);
        [(y_label, lines), (residual_label, vec![residual])]
            .map(|(y_label, lines)| Panel::over_time(y_label, Axes::Time(HEIGHT), lines))
    })
    .collect()
}

fn line(time: &[f64], name: &str, colour: RGBColor, stroke: Stroke, values: Vec<Option<f64>>) -> Line {
    let points = time.iter().zip(values);
    Line {
        name: name.to_owned(),
        colour,
        stroke,
        points: points.filter_map(|(time, value)| Some((*time, value?))).collect(),
    }
}
