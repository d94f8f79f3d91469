//! Missions of different controllers as one offline page: the service's page on recorded data.

use ::record::table::{self, Cell, Column, Row};
use ::record::{ExportError, Source as _};
use planner::los::LawGains;
use serde_json::{Value, json};
use sim::{fault::Fault, record::Record};
use wire::Prediction;

use crate::scores::lines;

/// A run in a report.
#[derive(Clone, Debug)]
pub struct ReportedRun<'a> {
    /// Its record.
    pub record: &'a Record,
    /// Predictions of the planner with the times of their plans, s; empty for other guides.
    pub predictions: &'a [(f64, Prediction)],
    /// The controller's knowledge in words; may be empty.
    pub information: String,
    /// Gains of a law; none for another controller.
    pub gains: Option<LawGains>,
}

impl<'a> From<&'a Record> for ReportedRun<'a> {
    /// With the record alone.
    fn from(record: &'a Record) -> Self {
        Self { record, predictions: &[], information: String::new(), gains: None }
    }
}

/// Largest number of points of a path: enough for a thousand pixels.
const PATH_POINTS_MAX: usize = 400;

/// A page about `runs`, which differ only in the controller.
pub fn report(runs: &[ReportedRun<'_>]) -> String {
    let title = runs
        .first()
        .map_or_else(String::new, |run| format!("{}, seed {}", run.record.scenario, run.record.seed));
    let data = json!({
        "kind": "runs",
        "title": title,
        "runs": runs.iter().map(run).collect::<Vec<_>>(),
        "scores": runs.iter().map(|run| json!({ "guide": run.record.guide, "lines": lines(run.record) })).collect::<Vec<_>>(),
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
            "scene": scene(run),
        },
        "csv": table(record),
        "predictions": run.predictions,
    })
}

/// The columns of a record that the page reads: the first line of its CSV.
const HEADER: &str = "kind,t_s,vehicle,north_m,east_m,depth_m,heading_rad,speed_mps,sway_mps,age_s,energy_j,\
    goal_north_m,goal_east_m,goal_distance_m,reference_speed_mps,reference_heading_rad,\
    outcome,method,reason,predicted_rms_m,solve_ms,late_s";
/// Values are rounded to a tenth of a millimetre, which no screen shows.
const PER_UNIT: f64 = 1e4;

/// The record's table with these columns alone, rounded, as CSV.
fn table(record: &Record) -> String {
    let of_name = |name: &str| table::COLUMNS.iter().find(|column| column.name == name);
    let columns: Vec<&Column> = HEADER.split(',').filter_map(of_name).collect();
    let mut lines = format!("{HEADER}\n");
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
            let cells: Vec<String> = columns.iter().map(|column| cell(column, row)).collect();
            lines += &cells.join(",");
            lines.push('\n');
        }
        Ok(())
    });
    taken.expect("memory takes everything");
    lines
}

/// A fault as the scene of a mission has it.
fn fault(record: &Record, fault: &Fault) -> Value {
    json!({
        "from_s": fault.from,
        "until_s": fault.until.is_finite().then_some(fault.until),
        "what": fault.in_words(&record.auv_ids),
    })
}

/// As `GET /v1/missions/{id}/scene` has it.
fn scene(run: &ReportedRun<'_>) -> Value {
    let (record, information) = (run.record, &run.information);
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
        // Null where a controller has none: without the member, a law has the service's.
        "gains": run.gains,
        "information": (!information.is_empty()).then_some(information),
        "faults": record.faults.iter().map(|each| fault(record, each)).collect::<Vec<_>>(),
        "auvs": record.auv_ids,
        "keep_outs": bounds.keep_outs,
        "area": bounds.area.iter().map(|corner| [corner.x, corner.y]).collect::<Vec<_>>(),
        "range_max_m": bounds.range_max,
        "paths": paths.collect::<std::collections::BTreeMap<_, _>>(),
    })
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;
    use sim::{guide::LosGuide, mission, scenario::Scenario};

    use super::*;

    fn record() -> Record {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(5.0);
        let mut guide = LosGuide::new(Parameters::default().los);
        mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("runs")
    }

    fn data(page: &str) -> Value {
        let (_, rest) = page.split_once("id=\"data\">").expect("has data");
        let (json, _) = rest.split_once("</script>").expect("ends");
        serde_json::from_str(json).expect("is JSON")
    }

    #[test]
    fn a_report_shows_gains_for_a_law_and_none_for_another_controller() {
        let record = record();
        let gains = LawGains { look_ahead_m: 4.0, along_track_gain_per_s: 0.2, integral_gain_mps: None };
        let tuned = ReportedRun { gains: Some(gains), ..(&record).into() };
        let data = data(&report(&[tuned, (&record).into()]));
        let said = |run: usize| data["runs"][run]["mission"]["scene"].get("gains").cloned();
        assert_eq!(said(0), Some(json!(gains)));
        assert_eq!(said(1), Some(Value::Null));
    }

    #[test]
    fn a_report_holds_the_whole_table_and_the_scores_of_each_run() {
        let record = record();
        let data = data(&report(&[(&record).into()]));
        let run = &data["runs"][0];
        let table = run["csv"].as_str().expect("is text");
        let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
        let column = lines[0].iter().position(|name| *name == "goal_distance_m");
        let column = column.expect("is a column");
        let distances = lines[1..].iter().filter_map(|cells| cells[column].parse::<f64>().ok());
        let rows = record.rows.iter();
        let expected = rows.filter_map(|row| Some(row.surface_craft.as_ref()?.distance()));
        assert_eq!(distances.clone().count(), expected.clone().count());
        let mut both = distances.zip(expected);
        assert!(both.all(|(read, was)| (read - was).abs() <= 0.5 / PER_UNIT + 1e-12));
        assert_eq!(data["scores"][0]["lines"][0][0], "rms_m");
        let scene = &run["mission"]["scene"];
        assert_eq!(scene["settled_after_s"], record.settled_after);
        assert_eq!(scene["paths"].as_object().map(serde_json::Map::len), Some(1));
    }

    #[test]
    fn an_empty_report_is_a_page() {
        assert!(report(&[]).ends_with("</html>\n"));
    }
}
