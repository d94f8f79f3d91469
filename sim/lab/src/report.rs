//! A mission as one interactive page that needs no network and no other file.

use maud::{Markup, PreEscaped, html};
use plotters::style::RGBColor;
use sim::{metrics::Metrics, record::Record};

use crate::{
    chart::{self, RUNS, SCRIPT},
    page::one_file,
    scores::{Scores, auv_lines},
};

mod map;
mod over_time;

/// More runs than these leave the table no room beside the map.
const BESIDE_THE_MAP: usize = 2;
/// Share of the page that the map has beside a table.
const MAP_SHARE: f64 = 0.66;

/// A run this many times farther from the goal than the nearest one, by root mean square, is not drawn: it would
/// squeeze the others into a line.
const FAR_OFF: f64 = 10.0;

const STYLE: &str = include_str!("report/report.css");

/// A page about `runs`, which differ in nothing but what guided them. Shows as much as there is.
#[must_use]
pub fn report(runs: &[&Record]) -> String {
    let (scenario, title, seed) = runs.first().map_or(("", "", 0), |run| {
        (run.scenario.as_str(), run.title.as_str(), run.seed)
    });
    let Drawn { near, far_off } = drawn(runs);
    let (tracks, panels) = (map::panel(&near), over_time::panels(&near));
    let many = BESIDE_THE_MAP < runs.len();
    let body = html! {
        header { h1 { (scenario) } p { (title) } p { "seed " (seed) } }
        main.many[many] {
            (chart::legend([&tracks].into_iter().chain(&panels)))
            @if !far_off.is_empty() {
                p.note { (far_off.join(", ")) ": too far off to be drawn beside the others" }
            }
            section #map { (chart::map(&tracks, &map::moving(&near, &tracks), if many { 1.0 } else { MAP_SHARE })) }
            section.numbers { (table(runs)) }
            section #over-time { (chart::over_time(&panels)) }
        }
        script { (PreEscaped(SCRIPT)) }
    };
    one_file(
        &format!("{scenario}, seed {seed}"),
        &(chart::style() + STYLE),
        &body,
    )
}

/// A run as the charts show it.
struct Shown<'a> {
    record: &'a Record,
    colour: RGBColor,
}

/// Which runs are drawn, and the names of those that are not.
struct Drawn<'a> {
    near: Vec<Shown<'a>>,
    far_off: Vec<&'a str>,
}

fn drawn<'a>(runs: &[&'a Record]) -> Drawn<'a> {
    let rms = |record: &Record| Some(Metrics::of(record).surface_craft?.rms_m);
    let distances: Vec<Option<f64>> = runs.iter().map(|record| rms(record)).collect();
    let nearest = distances.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let mut drawn = Drawn {
        near: vec![],
        far_off: vec![],
    };
    for ((&record, distance), colour) in runs.iter().zip(distances).zip(RUNS.into_iter().cycle()) {
        if distance.is_some_and(|rms| FAR_OFF * nearest < rms) {
            drawn.far_off.push(&record.guide);
        } else {
            drawn.near.push(Shown { record, colour });
        }
    }
    drawn
}

fn table(runs: &[&Record]) -> Markup {
    let columns: Vec<Vec<(String, String)>> = runs.iter().map(|run| lines(run)).collect();
    html! {
        table {
            thead { tr { td {} @for run in runs { th { (run.guide) } } } }
            tbody {
                @for (i, (name, _)) in columns.first().into_iter().flatten().enumerate() {
                    tr {
                        th { (name) }
                        @for column in &columns { td { (column.get(i).map_or("", |(_, value)| value)) } }
                    }
                }
            }
        }
    }
}

fn lines(record: &Record) -> Vec<(String, String)> {
    let metrics = Metrics::of(record);
    let mut lines = metrics.surface_craft.map_or_else(Vec::new, |surface_craft| {
        Scores::new(record, surface_craft).lines()
    });
    for auv in &metrics.auvs {
        let values = auv_lines(auv).into_iter();
        lines.extend(values.map(|(name, value)| (format!("{}.{name}", auv.id), format!("{value:.3}"))));
    }
    lines
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
            auv_ids: vec![hostile.into()],
            ..record()
        };
        let page = report(&[&record, &record]);
        assert!(!page.contains("<script>alert") && !page.contains("<img src=\"x\">"));
        assert_eq!(page.matches("</script>").count(), 1, "the page's own");
    }

    #[test]
    fn a_run_far_off_is_named_and_not_drawn_and_no_two_have_one_colour() {
        let near = record();
        let mut far = record();
        far.guide = "runaway".into();
        for row in &mut far.rows {
            row.surface_craft.as_mut().expect("has one").goal.x += 1e3;
        }
        let runs = [&near, &near, &near, &near, &near, &far];
        let drawn = drawn(&runs);
        assert_eq!(drawn.far_off, ["runaway"]);
        let mut colours: Vec<_> = drawn
            .near
            .iter()
            .map(|run| (run.colour.0, run.colour.1, run.colour.2))
            .collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), runs.len() - 1);
        assert!(report(&runs).contains("runaway: too far off"));
        // A pair of runs keeps its table beside the map.
        assert!(report(&runs).contains("<main class=\"many\">"));
        assert!(!report(&runs[..2]).contains("<main class=\"many\">"));
    }

    #[test]
    fn every_line_over_time_is_drawn_with_the_values_that_the_cursor_reads() {
        let record = record();
        let page = report(&[&record]);
        for name in ["distance to goal, m", "speed, m/s", "heading, °", "depth, m"] {
            assert!(page.contains(&format!("aria-label=\"{name}\"")), "{name}");
        }
        let (_, distances) = page
            .split_once("class=\"over-time\" data-chart=\"")
            .expect("a chart");
        let (data, _) = distances.split_once('"').expect("an attribute ends");
        let data: serde_json::Value = serde_json::from_str(&data.replace("&quot;", "\"")).expect("is JSON");
        let points = data["lines"][0]["points"].as_array().expect("a list");
        assert_eq!(points.len(), record.rows.len());
        for (point, row) in points.iter().zip(&record.rows) {
            let distance = row.surface_craft.as_ref().expect("has one").distance();
            assert!((point[1].as_f64().expect("a number") - distance).abs() <= 0.5e-3);
        }
    }

    #[test]
    fn a_report_of_nothing_is_a_page() {
        assert!(report(&[]).ends_with("</html>\n"));
    }
}
