//! The identified craft as one page without network access, and its table as Markdown.

use serde_json::{Value, json};

use super::Identification;
use super::parameter::{Parameter, Quantity};

/// Colours for colour-blind readers. Source: M. Okabe, K. Ito, "Color Universal Design", 2008.
const MEASURED: &str = "#0072B2";
const SIMULATED: &str = "#D55E00";
/// References lie under the measurements.
const REFERENCE: &str = "#A5ACB4";
/// Digits of estimates: four of six are noise already.
const DIGITS: usize = 4;

/// Heading and columns of the table.
const HEADING: &str = "Parameters, with 95\u{a0}% intervals";
const COLUMNS: [&str; 5] = ["parameter", "estimate", "from", "to", ""];

/// A page about the craft that was `found` in the log called `name`.
pub fn page(name: &str, found: &Identification) -> String {
    let craft =
        serde_json::to_string_pretty(&found.description()).expect("strings, numbers and objects only");
    let title = format!("{name}: identified craft");
    let mut blocks = vec![json!({ "heading": (1, &title) })];
    blocks.extend(missing(found).iter().map(|words| json!({ "paragraph": words })));
    let title_of_sheet = "Measured and simulated motion";
    blocks.extend([
        json!({ "heading": (2, HEADING) }),
        json!({ "table": { "words": 1, "columns": COLUMNS, "rows": rows(found) } }),
        json!({ "code": ("Craft file", craft) }),
        json!({ "sheet": { "title": title_of_sheet, "columns": 2, "panels": panels(found) } }),
    ]);
    ::page::one_file(&title, &json!({ "kind": "document", "blocks": blocks }))
}

/// The parameters with their intervals and the manoeuvres that the log lacks, as Markdown.
pub fn summary(found: &Identification) -> String {
    let rows = rows(found);
    let lines = rows.iter().map(|cells| format!("| {} |\n", cells.join(" | ")));
    let (missing, columns) = (missing(found).join("\n\n"), COLUMNS.join(" | "));
    let table: String = lines.collect();
    format!("{missing}\n\n## {HEADING}\n\n| {columns} |\n|---|---:|---:|---:|---:|\n{table}")
}

/// Lines of the table: name, estimate, interval, remark.
fn rows(found: &Identification) -> Vec<[String; 5]> {
    let line = |name: &str, [estimate, low, high]: [String; 3], remark: &str| {
        [name.to_owned(), estimate, low, high, remark.to_owned()]
    };
    let parameter = |parameter: &Parameter| {
        let numbers = [parameter.estimate, parameter.low, parameter.high].map(digits);
        let (name, _) = parameter.quantity.name_and_manoeuvre();
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
    let (heading, surge) = (digits(found.heading_residual), digits(found.surge_residual));
    rows.push(one("residual of heading, rad", heading, "RMS"));
    rows.push(one("residual of surge, m/s", surge, "RMS"));
    if let Some([north, east]) = found.current {
        rows.push(nuisance("mean current northward, m/s", north));
        rows.push(nuisance("mean current eastward, m/s", east));
    }
    rows.extend(found.compass_bias.map(|bias| nuisance("compass bias, rad", bias)));
    rows
}

fn missing(found: &Identification) -> Vec<String> {
    let missing = found.missing();
    let (used, left) = (found.time[found.time.len() - 1] - found.time[0], found.left_out);
    let says = || format!("Used: the longest part without a gap, {used:.0} s; {left:.0} s are left out.");
    let mut words = Vec::from_iter((0.0 < left).then(says));
    if missing.is_empty() {
        words.push("The log identifies every parameter: all are in the craft file.".to_owned());
    }
    let sentence = |quantity: &Quantity| {
        let (name, manoeuvre) = quantity.name_and_manoeuvre();
        format!("The log does not identify {name}: log {manoeuvre}.")
    };
    words.extend(missing.iter().map(sentence));
    words
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
    let decimals = i32::try_from(DIGITS).map_or(0, |digits| digits - 1 - exponent).clamp(0, 9);
    let decimals = usize::try_from(decimals).expect("clamped");
    format!("{number:.decimals$}")
}

/// Each motion over time, with its residual beside it.
fn panels(found: &Identification) -> Vec<Value> {
    let line = |name: &str, colour: &str, stroke: &str, values: Vec<Option<f64>>| {
        let points = found.time.iter().zip(values);
        let known: Vec<_> = points.filter_map(|(time, value)| Some((*time, value?))).collect();
        json!({ "name": name, "colour": colour, "stroke": stroke, "points": known })
    };
    let all = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
    let panels = found.traces.iter().flat_map(|trace| {
        let both = trace.measured.iter().zip(&trace.simulated);
        let residual = both.map(|(measured, simulated)| Some((*measured)? - simulated));
        let residual = line("measured less simulated", MEASURED, "solid", residual.collect());
        let mut lines = vec![
            line("measured", MEASURED, "solid", trace.measured.clone()),
            line("simulated", SIMULATED, "solid", all(&trace.simulated)),
        ];
        let reference = trace.reference.iter();
        lines.extend(reference.map(|values| line("reference", REFERENCE, "dashed", all(values))));
        [(trace.names[0], lines), (trace.names[1], vec![residual])]
    });
    let panel = |(name, lines): (&str, Vec<Value>)| {
        let time = "time, s";
        json!({ "heading": "", "x_label": time, "y_label": name, "lines": lines })
    };
    panels.map(panel).collect()
}
