//! A mission as one interactive page that needs no network and no other file.

use std::fmt::Write as _;

use plotly::{Plot, common::Visible};
use sim::{metrics::Metrics, record::Record};

use crate::scores::{Scores, diver_lines};

mod map;
mod over_time;

pub(crate) use map::{configuration, rounded};

/// More runs than these leave the table no room beside the map.
const BESIDE_THE_MAP: usize = 2;

/// A run this many times farther from the goal than the nearest one, by root mean square, is drawn only on a click
/// into the legend: it would squeeze the others into a line.
const FAR_OFF: f64 = 10.0;

/// A page about `runs`, which differ in nothing but what guided them. Shows as much as there is.
#[must_use]
pub fn report(runs: &[&Record]) -> String {
    let (scenario, title, seed) = runs.first().map_or(("", "", 0), |run| {
        (run.scenario.as_str(), run.title.as_str(), run.seed)
    });
    let (scenario, title) = (escaped(scenario), escaped(title));
    let shown = shown(runs);
    format!(
        r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width">
<title>{scenario}, seed {seed}</title>
<style>{STYLE}</style>
<header><h1>{scenario}</h1><p>{title}</p><p>seed {seed}</p></header>
<main{many}>
<section id="map"></section>
<section class="numbers">{table}</section>
<section id="over-time"></section>
</main>
<script id="map-plot" type="application/json">{map}</script>
<script id="over-time-plot" type="application/json">{over_time}</script>
<script>{plotly}</script>
<script>{DRAW}</script>
</html>
"#,
        many = if BESIDE_THE_MAP < runs.len() {
            r#" class="many""#
        } else {
            ""
        },
        table = table(runs),
        map = inert(&map::plot(&shown)),
        over_time = inert(&over_time::plot(&shown)),
        plotly = plotly_script(),
    )
}

/// What the browser holds the page to: its own script, style and pictures, and nothing from anywhere.
pub(crate) const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";
pub(crate) const STYLE: &str = include_str!("report/report.css");
pub(crate) const DRAW: &str = include_str!("report/report.js");

/// A run as the plots show it.
#[derive(Clone)]
struct Shown<'a> {
    record: &'a Record,
    colour: &'static str,
    /// Whether it is drawn, or waits in the legend.
    visible: Visible,
}

fn shown<'a>(runs: &[&'a Record]) -> Vec<Shown<'a>> {
    let rms = |record: &Record| Some(Metrics::of(record).surface_craft?.rms_m);
    let distances: Vec<Option<f64>> = runs.iter().map(|record| rms(record)).collect();
    let nearest = distances.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let far_off = |distance: &Option<f64>| distance.is_some_and(|rms| FAR_OFF * nearest < rms);
    let colours = map::CRAFT.iter().cycle();
    runs.iter()
        .zip(&distances)
        .zip(colours)
        .map(|((&record, distance), colour)| Shown {
            record,
            colour,
            visible: if far_off(distance) {
                Visible::LegendOnly
            } else {
                Visible::True
            },
        })
        .collect()
}

fn table(runs: &[&Record]) -> String {
    let columns: Vec<Vec<(String, String)>> = runs.iter().map(|run| lines(run)).collect();
    let mut text = "<table><thead><tr><td></td>".to_owned();
    for run in runs {
        write!(text, "<th>{}</th>", escaped(&run.guide)).expect("a string takes everything");
    }
    text += "</tr></thead><tbody>";
    for (i, (name, _)) in columns.first().into_iter().flatten().enumerate() {
        write!(text, "<tr><th>{}</th>", escaped(name)).expect("a string takes everything");
        for column in &columns {
            let value = column.get(i).map_or("", |(_, value)| value);
            write!(text, "<td>{}</td>", escaped(value)).expect("a string takes everything");
        }
        text += "</tr>";
    }
    text + "</tbody></table>"
}

fn lines(record: &Record) -> Vec<(String, String)> {
    let metrics = Metrics::of(record);
    let mut lines = metrics.surface_craft.map_or_else(Vec::new, |surface_craft| {
        Scores::new(record, surface_craft).lines()
    });
    for diver in &metrics.divers {
        let values = diver_lines(diver).into_iter();
        lines.extend(values.map(|(name, value)| (format!("{}.{name}", diver.id), format!("{value:.3}"))));
    }
    lines
}

/// The library that draws, as the crate carries it: the first of its two scripts (the other typesets formulas).
pub(crate) fn plotly_script() -> String {
    let sources = Plot::offline_js_sources();
    let (_, after) = sources.split_once('>').expect("begins with a script's tag");
    let (script, _) = after.split_once("</script>").expect("a script ends");
    script.to_owned()
}

/// JSON that no HTML parser takes for markup.
pub(crate) fn inert(plot: &Plot) -> String {
    plot.to_json().replace('<', "\\u003c")
}

/// Text that HTML shows as it is, also between quotation marks.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use planner::policy::Policy;
    use sim::{guide::LosGuide, mission, scenario::Scenario};

    use super::*;

    fn record() -> Record {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(5.0);
        let mut guide = LosGuide::new(Policy::default().los);
        mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("runs")
    }

    #[test]
    fn nothing_in_a_record_becomes_markup() {
        let hostile = "</script><script>alert('1')</script><img src=\"x\">";
        let record = Record {
            scenario: hostile.into(),
            title: hostile.into(),
            guide: hostile.into(),
            diver_ids: vec![hostile.into()],
            ..record()
        };
        let page = report(&[&record, &record]);
        assert!(!page.contains("<script>alert") && !page.contains("<img src=\"x\">"));
        assert_eq!(
            page.matches("</script>").count(),
            4,
            "two plots, the library, its caller"
        );
    }

    #[test]
    fn a_run_far_off_waits_in_the_legend_and_no_two_have_one_colour() {
        let near = record();
        let mut far = record();
        for row in &mut far.rows {
            row.surface_craft.as_mut().expect("has one").goal.x += 1e3;
        }
        let runs = [&near, &near, &near, &near, &near, &far];
        let shown = shown(&runs);
        let waits = |run: &Shown| matches!(run.visible, Visible::LegendOnly);
        assert!(waits(&shown[5]) && !shown[..5].iter().any(waits));
        let mut colours: Vec<_> = shown.iter().map(|run| run.colour).collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), runs.len());
        // A pair of runs keeps its table beside the map.
        assert!(report(&runs).contains("<main class=\"many\">"));
        assert!(report(&runs[..2]).contains("<main>"));
    }

    #[test]
    fn a_report_of_nothing_is_a_page() {
        assert!(report(&[]).ends_with("</html>\n"));
    }
}
