//! A mission, or some that differ in their controller, as one page that needs no network and no other file: what the service's page
//! shows of missions, on recorded data.

use ::record::{
    ExportError, Source as _,
    table::{self, Cell, Column, Row},
};
use serde_json::{Value, json};
use sim::{metrics::Metrics, record::Record};
use wire::Prediction;

use crate::scores::{Scores, auv_lines};

/// What one run of a report is made of.
#[derive(Clone, Debug)]
pub struct ReportedRun<'a> {
    /// What happened.
    pub record: &'a Record,
    /// What the planner predicted, at the times of some plans, s; nothing of another guide.
    pub predictions: &'a [(f64, Prediction)],
    /// What the guide was told, in words; empty where that was not said.
    pub information: String,
}

impl<'a> From<&'a Record> for ReportedRun<'a> {
    /// With the record alone.
    fn from(record: &'a Record) -> Self {
        Self {
            record,
            predictions: &[],
            information: String::new(),
        }
    }
}

/// Points of a path at most: what a picture of a thousand pixels shows.
const PATH_POINTS_MAX: usize = 400;

/// A page about `runs`, which differ in nothing but what guided them.
#[must_use]
pub fn report(runs: &[ReportedRun<'_>]) -> String {
    let title = runs.first().map_or_else(String::new, |run| {
        format!("{}, seed {}", run.record.scenario, run.record.seed)
    });
    let data = json!({
        "kind": "runs",
        "title": title,
        "runs": runs.iter().map(run).collect::<Vec<_>>(),
        "scores": runs.iter().map(|run| scores(run.record)).collect::<Vec<_>>(),
    });
    page::one_file(&title, &data)
}

fn run(run: &ReportedRun<'_>) -> Value {
    let record = run.record;
    json!({
        "mission": {
            "id": record.guide,
            "title": record.title,
            "kind": "simulated",
            "status": "finished",
            "t_s": record.rows.last().map_or(0.0, |row| row.time),
            "origin": record.origin.map(wire::Origin::from),
            "scene": scene(record, &run.information),
        },
        "csv": table(record),
        "predictions": run.predictions,
    })
}

/// What the page reads of a record's table: a tenth of the whole.
const COLUMNS: [&str; 22] = [
    "kind",
    "t_s",
    "vehicle",
    "north_m",
    "east_m",
    "depth_m",
    "heading_rad",
    "speed_mps",
    "sway_mps",
    "age_s",
    "energy_j",
    "goal_north_m",
    "goal_east_m",
    "goal_distance_m",
    "reference_speed_mps",
    "reference_heading_rad",
    "outcome",
    "method",
    "reason",
    "predicted_rms_m",
    "solve_ms",
    "late_s",
];
/// A tenth of a millimetre is nothing on a screen.
const PER_UNIT: f64 = 1e4;

/// The record's table with these columns alone, rounded, as CSV.
fn table(record: &Record) -> String {
    let columns = || {
        COLUMNS
            .iter()
            .filter_map(|name| table::COLUMNS.iter().find(|column| column.name == *name))
    };
    let mut lines = COLUMNS.join(",") + "\n";
    let cell = |column: &Column, row: &Row<'_>| match (column.cell)(row) {
        Cell::Nothing => String::new(),
        Cell::Count(count) => count.to_string(),
        Cell::Number(number) => ((number * PER_UNIT).round() / PER_UNIT + 0.0).to_string(),
        Cell::Word(word) if word.contains(['"', ',', '\n', '\r']) => {
            format!("\"{}\"", word.replace('"', "\"\""))
        }
        Cell::Word(word) => word.to_owned(),
    };
    let taken: Result<(), ExportError> = record.for_each(&mut |entry| {
        for row in &entry.rows {
            let cells: Vec<String> = columns().map(|column| cell(column, row)).collect();
            lines += &cells.join(",");
            lines.push('\n');
        }
        Ok(())
    });
    taken.expect("memory takes everything");
    lines
}

/// As `GET /v1/missions/{id}/scene` has it.
fn scene(record: &Record, information: &str) -> Value {
    let thinned = |points: &Vec<nalgebra::Vector2<f64>>| -> Vec<[f64; 2]> {
        let step = points.len().div_ceil(PATH_POINTS_MAX).max(1);
        let kept = points.iter().step_by(step).chain(points.last());
        kept.map(|point| [point.x, point.y]).collect()
    };
    let paths = record.auv_ids.iter().zip(record.paths.iter().map(thinned));
    let bounds = &record.bounds;
    json!({
        "duration_s": record.rows.last().map_or(0.0, |row| row.time),
        "settled_after_s": record.settled_after,
        "period_s": record.interval,
        "scenario": record.scenario,
        "seed": record.seed,
        "controller": record.guide,
        "information": (!information.is_empty()).then_some(information),
        "auvs": record.auv_ids,
        "keep_outs": bounds.keep_outs.iter().map(wire::keep_out).collect::<Vec<_>>(),
        "area": bounds.area.iter().map(|corner| [corner.x, corner.y]).collect::<Vec<_>>(),
        "range_max_m": bounds.range_max,
        "paths": paths.collect::<std::collections::BTreeMap<_, _>>(),
    })
}

fn scores(record: &Record) -> Value {
    let metrics = Metrics::of(record);
    let mut lines = metrics.surface_craft.map_or_else(Vec::new, |surface_craft| {
        Scores::new(record, surface_craft).lines()
    });
    for auv in &metrics.auvs {
        let values = auv_lines(auv).into_iter();
        lines.extend(values.map(|(name, value)| (format!("{}.{name}", auv.id), format!("{value:.3}"))));
    }
    json!({ "guide": record.guide, "lines": lines })
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

    /// What the page is given.
    fn data(page: &str) -> Value {
        let (_, rest) = page.split_once("id=\"data\">").expect("has data");
        let (json, _) = rest.split_once("</script>").expect("ends");
        serde_json::from_str(json).expect("is JSON")
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
        let page = report(&[(&record).into(), (&record).into()]);
        assert!(!page.contains("<script>alert") && !page.contains("<img src=\"x\">"));
        assert_eq!(page.matches("</script>").count(), 2, "the page's own");
        assert_eq!(data(&page)["runs"][1]["mission"]["title"], hostile);
    }

    #[test]
    fn a_report_holds_the_whole_table_and_the_scores_of_each_run() {
        let record = record();
        let data = data(&report(&[(&record).into()]));
        let run = &data["runs"][0];
        let table = run["csv"].as_str().expect("is text");
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let distance = reader
            .headers()
            .expect("has a head")
            .iter()
            .position(|name| name == "goal_distance_m");
        let distance = distance.expect("is a column");
        let distances: Vec<f64> = reader
            .records()
            .filter_map(|row| row.expect("is a row")[distance].parse().ok())
            .collect();
        let expected = record
            .rows
            .iter()
            .filter_map(|row| Some(row.surface_craft.as_ref()?.distance()));
        let expected: Vec<f64> = expected.collect();
        assert_eq!(distances.len(), expected.len());
        let near = distances
            .iter()
            .zip(&expected)
            .all(|(read, was)| (read - was).abs() <= 0.5 / PER_UNIT + 1e-12);
        assert!(near, "{distances:?} {expected:?}");
        assert_eq!(data["scores"][0]["lines"][0][0], "rms_m");
        assert_eq!(
            run["mission"]["scene"]["settled_after_s"].as_f64(),
            Some(record.settled_after)
        );
        assert_eq!(
            run["mission"]["scene"]["paths"]
                .as_object()
                .map(serde_json::Map::len),
            Some(1)
        );
    }

    #[test]
    fn a_report_of_nothing_is_a_page() {
        assert!(report(&[]).ends_with("</html>\n"));
    }
}
