//! What a log says of a craft, as one page that needs no network and no other file.

use serde_json::{Value, json};

use super::{Identification, Parameter, Traces};
use crate::chart::{Axes, BLUE, Colour, GREY, Line, Panel, Stroke, VERMILION};

/// Height of one panel, units.
const HEIGHT: u32 = 340;
const MEASURED: Colour = BLUE;
const SIMULATED: Colour = VERMILION;
const REFERENCE: Colour = GREY;
/// Digits of estimates: four of six are noise already.
const DIGITS: usize = 4;

/// A page about what was `found` in the log called `name`.
#[must_use]
pub fn page(name: &str, found: &Identification) -> String {
    let craft = serde_json::to_string_pretty(&wire::Craft::from(&found.description()))
        .expect("strings, numbers and objects only");
    let title = format!("{name}: the craft as its log shows it");
    let data = json!({
        "kind": "sheets",
        "title": title,
        "text": missing(found),
        "tables": [{
            "caption": "Parameters, with 95\u{a0}% intervals",
            "head": ["parameter", "estimate", "from", "to", ""],
            "rows": rows(found).into_iter().map(cells).collect::<Vec<_>>(),
        }],
        "code": [{ "caption": "Craft file", "text": craft }],
        "sheets": [{ "title": "What was measured and what is simulated", "columns": 2, "panels": panels(&found.traces) }],
    });
    ::page::one_file(&title, &data)
}

/// A line of the table as its cells.
fn cells(Row(open, name, [estimate, low, high], remark): Row<'_>) -> Value {
    let name = if open {
        format!("{name} (open)")
    } else {
        name.to_owned()
    };
    json!([name, estimate, low, high, remark])
}

/// A line of the table: whether it is uncertain, name, estimate and interval, remark.
struct Row<'a>(bool, &'a str, [String; 3], &'a str);

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

fn missing(found: &Identification) -> Vec<String> {
    let missing = found.missing();
    if missing.is_empty() {
        return vec!["The log shows every parameter: all of them are in the craft file.".to_owned()];
    }
    let sentence = |quantity: &super::Quantity| {
        format!(
            "The log does not show {}: log {}.",
            quantity.name(),
            quantity.manoeuvre()
        )
    };
    missing.iter().map(sentence).collect()
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

fn line(time: &[f64], name: &str, colour: Colour, stroke: Stroke, values: Vec<Option<f64>>) -> Line {
    let points = time.iter().zip(values);
    Line {
        name: name.to_owned(),
        colour,
        stroke,
        points: points.filter_map(|(time, value)| Some((*time, value?))).collect(),
    }
}
