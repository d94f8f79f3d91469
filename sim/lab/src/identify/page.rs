//! The identified craft as one page without network access, and its table as Markdown.

use super::{Identification, Parameter, Traces};
use crate::{
    chart::{BLUE, Colour, GREY, Line, Panel, Sheet, Stroke, VERMILION},
    document::{Block, Document, Table},
};

const MEASURED: Colour = BLUE;
const SIMULATED: Colour = VERMILION;
const REFERENCE: Colour = GREY;
/// Digits of estimates: four of six are noise already.
const DIGITS: usize = 4;

/// A page about the craft that was `found` in the log called `name`.
#[must_use]
pub fn page(name: &str, found: &Identification) -> String {
    let craft =
        serde_json::to_string_pretty(&found.description()).expect("strings, numbers and objects only");
    let mut blocks = vec![Block::Heading(1, format!("{name}: identified craft"))];
    blocks.extend(results(found));
    blocks.extend([
        Block::Code("Craft file".to_owned(), craft),
        Block::Sheet(Sheet {
            title: "Measured and simulated motion".to_owned(),
            columns: 2,
            panels: panels(&found.traces),
        }),
    ]);
    Document(blocks).html()
}

/// The parameters with their intervals and the manoeuvres that the log lacks, as Markdown.
#[must_use]
pub fn summary(found: &Identification) -> String {
    Document(results(found)).markdown()
}

fn results(found: &Identification) -> Vec<Block> {
    let mut blocks: Vec<Block> = missing(found).into_iter().map(Block::Paragraph).collect();
    blocks.extend([
        Block::Heading(2, "Parameters, with 95\u{a0}% intervals".to_owned()),
        Block::Table(Table {
            words: 1,
            columns: ["parameter", "estimate", "from", "to", ""]
                .map(str::to_owned)
                .into(),
            rows: rows(found).into_iter().map(Vec::from).collect(),
        }),
    ]);
    blocks
}

/// Lines of the table: name, estimate, interval, remark.
fn rows(found: &Identification) -> Vec<[String; 5]> {
    let line = |name: &str, [estimate, low, high]: [String; 3], remark: &str| {
        [name.to_owned(), estimate, low, high, remark.to_owned()]
    };
    let parameter = |parameter: &Parameter| {
        let numbers = [parameter.estimate, parameter.low, parameter.high].map(digits);
        let name = parameter.quantity.name();
        if parameter.identified {
            line(name, numbers, "")
        } else {
            line(&format!("{name} (open)"), numbers, "not identified")
        }
    };
    let one = |name, text, remark| line(name, [text, String::new(), String::new()], remark);
    let nuisance = |name, (value, sigma): (f64, f64)| {
        let half = 1.96 * sigma;
        line(name, [value, value - half, value + half].map(digits), "nuisance")
    };
    let mut rows: Vec<_> = found.parameters.iter().map(parameter).collect();
    let craft = serde_json::to_value(found.description()).expect("JSON");
    for name in ["speed_held", "heading_held"] {
        rows.push(one(name, craft[name].as_str().unwrap_or("open").to_owned(), ""));
    }
    rows.push(one(
        "residual of heading, rad",
        digits(found.heading_residual),
        "RMS",
    ));
    rows.push(one("residual of surge, m/s", digits(found.surge_residual), "RMS"));
    if let Some([north, east]) = found.current {
        rows.push(nuisance("mean current northward, m/s", north));
        rows.push(nuisance("mean current eastward, m/s", east));
    }
    rows.extend(found.compass_bias.map(|bias| nuisance("compass bias, rad", bias)));
    rows
}

fn missing(found: &Identification) -> Vec<String> {
    let missing = found.missing();
    if missing.is_empty() {
        return vec!["The log identifies every parameter: all are in the craft file.".to_owned()];
    }
    let sentence = |quantity: &super::Quantity| {
        format!(
            "The log does not identify {}: log {}.",
            quantity.name(),
            quantity.manoeuvre()
        )
    };
    missing.iter().map(sentence).collect()
}

/// A number with its significant digits.
fn digits(number: f64) -> String {
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
            .map(|(y_label, lines)| Panel::over_time(y_label, lines))
    })
    .collect()
}

fn line(time: &[f64], name: &str, colour: Colour, stroke: Stroke, values: Vec<Option<f64>>) -> Line {
    let points = time.iter().zip(values);
    let known = points.filter_map(|(time, value)| Some((*time, value?)));
    Line::new(name, colour, stroke, known)
}
