//! What a log says of a craft, as one page that needs no network and no other file.

use std::fmt::Write as _;

use plotly::{
    Layout, Plot, Scatter,
    common::{Anchor, DashType, Line, Mode, Orientation},
    layout::{Axis, HoverMode, Legend, Margin},
};
use sim::identify::{Identification, Parameter, Traces};

use crate::{
    report::{DRAW, POLICY, STYLE, configuration, escaped, inert, plotly_script, rounded},
    wire,
};

/// Height of one panel, pixels.
const PANEL_HEIGHT: usize = 220;
/// Share of a panel's height that parts it from the next.
const GAP: f64 = 0.12;
const MEASURED: &str = "#0b6bb0";
const SIMULATED: &str = "#d4571b";
const REFERENCE: &str = "#8f9aa5";
/// Digits of estimates: four of six are noise already.
const DIGITS: usize = 4;

/// A page about what was `found` in the log called `name`.
#[must_use]
pub fn page(name: &str, found: &Identification) -> String {
    let name = escaped(name);
    let craft = serde_json::to_string_pretty(&wire::Craft::from(&found.description()))
        .expect("strings, numbers and objects only");
    format!(
        r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width">
<title>{name}: the craft</title>
<style>{STYLE}{OWN_STYLE}</style>
<header><h1>{name}</h1><p>the craft as its log shows it</p></header>
<main>
<section class="numbers"><h2>Parameters, with 95&nbsp;% intervals</h2>{table}</section>
<section><h2>What the log does not show</h2>{missing}<h2>Craft file</h2><pre>{craft}</pre></section>
<section id="residuals" class="wide"></section>
</main>
<script id="residuals-plot" type="application/json">{plot}</script>
<script>{plotly}</script>
<script>{DRAW}</script>
</html>
"#,
        table = table(found),
        missing = missing(found),
        craft = escaped(&craft),
        plot = inert(&plot(&found.traces)),
        plotly = plotly_script(),
    )
}

const OWN_STYLE: &str = include_str!("page.css");

fn table(found: &Identification) -> String {
    let mut text =
        "<table><thead><tr><th class=\"name\">parameter</th><th>estimate</th><th>from</th><th>to</th>\
                    <th class=\"name\"></th></tr></thead><tbody>"
            .to_owned();
    let mut line = |class: &str, name: &str, cells: [String; 3], remark: &str| {
        let [estimate, low, high] = cells;
        write!(
            text,
            "<tr{class}><td class=\"name\">{name}</td><td>{estimate}</td><td>{low}</td><td>{high}</td>\
             <td class=\"name\">{remark}</td></tr>"
        )
        .expect("a string takes everything");
    };
    for parameter in &found.parameters {
        let Parameter {
            quantity,
            estimate,
            low,
            high,
            identified,
        } = parameter;
        let (class, remark) = if *identified {
            ("", "")
        } else {
            (" class=\"open\"", "not identified")
        };
        line(
            class,
            quantity.name(),
            [estimate, low, high].map(|number| digits(*number)),
            remark,
        );
    }
    let craft = serde_json::to_value(wire::Craft::from(&found.description())).expect("JSON");
    for name in ["speed_held", "heading_held"] {
        let word = craft[name].as_str().unwrap_or("open").to_owned();
        line("", name, [word, String::new(), String::new()], "");
    }
    for (name, number) in [
        ("residual of heading, rad", found.heading_residual),
        ("residual of surge, m/s", found.surge_residual),
    ] {
        line("", name, [digits(number), String::new(), String::new()], "RMS");
    }
    let mut nuisance = |name: &str, (value, sigma): (f64, f64)| {
        let half = 1.96 * sigma;
        line(
            "",
            name,
            [value, value - half, value + half].map(digits),
            "nuisance",
        );
    };
    if let Some([north, east]) = found.current {
        nuisance("mean current northward, m/s", north);
        nuisance("mean current eastward, m/s", east);
    }
    if let Some(bias) = found.compass_bias {
        nuisance("compass bias, rad", bias);
    }
    text + "</tbody></table>"
}

fn missing(found: &Identification) -> String {
    let missing = found.missing();
    if missing.is_empty() {
        return "<p>Nothing: every parameter is in the craft file.</p>".to_owned();
    }
    let mut text = "<ul>".to_owned();
    for quantity in missing {
        write!(
            text,
            "<li><b>{}</b>: log {}.</li>",
            quantity.name(),
            quantity.manoeuvre()
        )
        .expect("a string takes everything");
    }
    text + "</ul>"
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

struct Trace {
    name: &'static str,
    colour: &'static str,
    dash: DashType,
    values: Vec<Option<f64>>,
}

fn plot(traces: &Traces) -> Plot {
    let all = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
    let degrees = |values: &[f64]| values.iter().map(|value| Some(value.to_degrees())).collect();
    let less = |measured: &[Option<f64>], model: &[f64], scale: f64| {
        let pairs = measured.iter().zip(model);
        pairs
            .map(|(measured, model)| Some(((*measured)? - model) * scale))
            .collect()
    };
    let trace = |name, colour, values| Trace {
        name,
        colour,
        dash: if name == "reference" {
            DashType::Dot
        } else {
            DashType::Solid
        },
        values,
    };
    let panels = [
        (
            "heading, °",
            vec![
                trace("measured", MEASURED, degrees(&traces.heading)),
                trace("simulated", SIMULATED, degrees(&traces.heading_model)),
                trace("reference", REFERENCE, degrees(&traces.heading_reference)),
            ],
        ),
        (
            "residual, °",
            vec![trace(
                "measured less simulated",
                MEASURED,
                less(&all(&traces.heading), &traces.heading_model, 1.0_f64.to_degrees()),
            )],
        ),
        (
            "surge, m/s",
            vec![
                trace("measured", MEASURED, traces.surge.clone()),
                trace("simulated", SIMULATED, all(&traces.surge_model)),
                trace("reference", REFERENCE, all(&traces.speed_reference)),
            ],
        ),
        (
            "residual, m/s",
            vec![trace(
                "measured less simulated",
                MEASURED,
                less(&traces.surge, &traces.surge_model, 1.0),
            )],
        ),
        (
            "sway, m/s",
            vec![
                trace("measured", MEASURED, traces.sway.clone()),
                trace("simulated", SIMULATED, all(&traces.sway_model)),
            ],
        ),
        (
            "residual, m/s",
            vec![trace(
                "measured less simulated",
                MEASURED,
                less(&traces.sway, &traces.sway_model, 1.0),
            )],
        ),
    ];
    let mut plot = Plot::new();
    plot.set_configuration(configuration().scroll_zoom(false));
    plot.set_layout(layout(&panels.each_ref().map(|(label, _)| *label)));
    let time: Vec<f64> = traces.time.iter().copied().map(rounded).collect();
    let mut named: Vec<&str> = Vec::new();
    for ((_, lines), axis) in panels.into_iter().zip(AXES) {
        for line in lines {
            let style = Line::new().color(line.colour).width(1.2).dash(line.dash);
            let values = line.values.into_iter().map(|value| value.map(rounded)).collect();
            // One entry shows and hides the line in every panel.
            plot.add_trace(
                Scatter::new(time.clone(), values)
                    .name(line.name)
                    .legend_group(line.name)
                    .show_legend(!named.contains(&line.name))
                    .mode(Mode::Lines)
                    .line(style)
                    .x_axis("x")
                    .y_axis(axis),
            );
            named.push(line.name);
        }
    }
    plot
}

const AXES: [&str; 6] = ["y", "y2", "y3", "y4", "y5", "y6"];

fn layout(labels: &[&'static str; 6]) -> Layout {
    let share = 1.0 / 6.0;
    let axis = |i: u32| {
        let top = 1.0 - f64::from(i) * share;
        let bottom = (top - share).max(0.0);
        let label = labels[usize::try_from(i).expect("six at most")];
        Axis::new()
            .title(label)
            .zero_line(false)
            .domain(&[bottom + GAP * share, top])
    };
    Layout::new()
        .height(PANEL_HEIGHT * labels.len() + 120)
        .hover_mode(HoverMode::XUnified)
        .margin(Margin::new().left(72).right(16).top(24).bottom(56))
        .legend(
            Legend::new()
                .orientation(Orientation::Horizontal)
                .y(1.01)
                .y_anchor(Anchor::Bottom),
        )
        .y_axis(axis(0))
        .y_axis2(axis(1))
        .y_axis3(axis(2))
        .y_axis4(axis(3))
        .y_axis5(axis(4))
        .y_axis6(axis(5))
        // One time axis for all panels, below the last: a zoom into one is a zoom into all.
        .x_axis(Axis::new().title("time, s").zero_line(false).anchor("y6"))
}
