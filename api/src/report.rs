//! A mission as one interactive page that needs no network and no other file.

use std::fmt::Write as _;

use plotly::Plot;
use sim::{metrics::Metrics, record::Record};

use crate::scores::{Scores, diver_lines};

mod map;
mod over_time;

/// A page about `runs`, which differ in nothing but what guided them. Shows as much as there is.
#[must_use]
pub fn report(runs: &[&Record]) -> String {
    let (scenario, title, seed) = runs.first().map_or(("", "", 0), |run| {
        (run.scenario.as_str(), run.title.as_str(), run.seed)
    });
    let (scenario, title) = (escaped(scenario), escaped(title));
    format!(
        r#"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width">
<title>{scenario}, seed {seed}</title>
<style>{STYLE}</style>
<header><h1>{scenario}</h1><p>{title}</p><p>seed {seed}</p></header>
<main>
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
        table = table(runs),
        map = inert(&map::plot(runs)),
        over_time = inert(&over_time::plot(runs)),
        plotly = plotly_script(),
    )
}

/// What the browser holds the page to: its own script, style and pictures, and nothing from anywhere.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";
const STYLE: &str = include_str!("report/report.css");
const DRAW: &str = include_str!("report/report.js");

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
fn plotly_script() -> String {
    let sources = Plot::offline_js_sources();
    let (_, after) = sources.split_once('>').expect("begins with a script's tag");
    let (script, _) = after.split_once("</script>").expect("a script ends");
    script.to_owned()
}

/// JSON that no HTML parser takes for markup.
fn inert(plot: &Plot) -> String {
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
    fn a_report_of_nothing_is_a_page() {
        assert!(report(&[]).ends_with("</html>\n"));
    }
}
