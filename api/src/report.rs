//! A mission as one interactive page that needs no network and no other file.

use std::{fmt::Write as _, time::Duration};

use plotly::Plot;
use sim::{
    metrics::Metrics,
    record::{Record, method_name},
};

use crate::scores::{Scores, diver_lines};

mod map;
mod over_time;

/// A mission that was flown.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// What happened.
    pub record: &'a Record,
    /// Time of each of the guide's answers.
    pub times: &'a [Duration],
}

impl Run<'_> {
    /// What steered the surface craft: the guide's name, or else the rung that it answered from first.
    fn name(&self) -> String {
        let first = || self.record.rows.first()?.surface_craft.as_ref();
        match &self.record.guide {
            guide if !guide.is_empty() => guide.clone(),
            _ => first().map_or_else(String::new, |craft| method_name(craft.method).to_owned()),
        }
    }
}

/// A page about `runs`, which differ in nothing but what guided them. Shows as much as there is.
#[must_use]
pub fn report(runs: &[Run<'_>]) -> String {
    let (scenario, title, seed) = runs.first().map_or(("", "", 0), |run| {
        let record = run.record;
        (record.scenario.as_str(), record.title.as_str(), record.seed)
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

fn table(runs: &[Run<'_>]) -> String {
    let columns: Vec<Vec<(String, String)>> = runs.iter().map(lines).collect();
    let mut text = "<table><thead><tr><td></td>".to_owned();
    for run in runs {
        write!(text, "<th>{}</th>", escaped(&run.name())).expect("a string takes everything");
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

fn lines(run: &Run<'_>) -> Vec<(String, String)> {
    let metrics = Metrics::of(run.record);
    let mut lines = metrics.surface_craft.map_or_else(Vec::new, |surface_craft| {
        Scores::new(run.record, surface_craft, run.times).lines()
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
        let scenario = Scenario {
            duration: 5.0,
            ..Scenario::named("paper-tracking").expect("exists")
        };
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
        let run = Run {
            record: &record,
            times: &[],
        };
        let page = report(&[run, run]);
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
