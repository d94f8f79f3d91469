//! A controller's scores on a mission, under their public names.

use serde::Serialize;
use serde_json::Value;
use sim::fleet::FleetMetrics;
use sim::metrics::{AuvMetrics, Metrics, SurfaceCraftMetrics};
use sim::record::Record;

use crate::bound::bound_rms_m;

/// A controller's scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// The record's metrics.
    #[serde(flatten)]
    pub metrics: SurfaceCraftMetrics,
    /// Gap between the root mean square distance and its lower bound for this hull with the future
    /// known, m; `None` in waves, whose push has no bound.
    pub regret_m: Option<f64>,
    /// What several craft did together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetMetrics>,
}

impl Scores {
    /// The scores of a mission; none without a surface craft.
    pub fn of(record: &Record) -> Option<Self> {
        let metrics = Metrics::of(record).surface_craft?;
        let regret_m = bound_rms_m(record).map(|bound| metrics.rms_m - bound);
        Some(Self { metrics, regret_m, fleet: FleetMetrics::of(record) })
    }

    /// The scores as lines of a table: name, and value for people.
    pub fn lines(&self) -> Vec<(String, String)> {
        let scores = serde_json::to_value(self).expect("numbers, by name");
        let line = |(name, _, digits): &(&str, &str, usize)| {
            let pointer = format!("/{}", name.replace("answers.", "answers_by_method.").replace('.', "/"));
            Some(((*name).to_owned(), for_people(scores.pointer(&pointer)?, *digits)))
        };
        let in_range = self.metrics.time_in_range_s.iter();
        let in_range = in_range.map(|(id, seconds)| (format!("{IN_RANGE}{id}"), format!("{seconds:.0}")));
        LINES.iter().filter_map(line).chain(in_range).collect()
    }
}

/// Beginning of the names of the times in contact range of the AUVs.
pub(crate) const IN_RANGE: &str = "time_in_range_s.";

/// The lines: name, heading in a comparison's table, and decimals.
pub(crate) const LINES: [(&str, &str, usize); 42] = [
    ("fleet.craft_separation_m", "least distance between craft, m", 1),
    ("fleet.too_near_m", "craft nearer than to keep, m", 1),
    ("fleet.reassignments", "AUVs that changed their craft", 0),
    ("fleet.company_rms_m", "AUVs from their craft, RMS, m", 2),
    ("visits.mean_cost", "mean cost of the AUVs", 2),
    ("visits.max_cost", "largest cost of an AUV", 1),
    ("visits.visits", "visits", 0),
    ("visits.changes", "changes of the next visit", 0),
    ("visits.deadlines_missed", "missed deadlines", 0),
    ("localisation.rms_m", "AUVs' own error, RMS, settled, m", 2),
    ("localisation.max_m", "AUVs' own error, largest, m", 1),
    ("localisation.stated_rms_m", "error that they state, RMS, m", 2),
    ("localisation.nees", "error over what they state (2)", 2),
    ("traffic.least_m", "least distance from a vessel's side, m", 1),
    ("traffic.too_near_m", "nearer than the distance to keep, m", 1),
    ("traffic.passed_to_port", "vessels passed on the port side", 0),
    ("traffic.passed_to_starboard", "vessels passed on the starboard side", 0),
    ("traffic.first_turn_rad", "first turn for a vessel, rad", 2),
    ("traffic.manoeuvring_rms_m", "distance, RMS, in manoeuvres, m", 2),
    ("traffic.afterwards_rms_m", "distance, RMS, after them, m", 2),
    ("rms_m", "distance, RMS, whole mission, m", 3),
    ("mean_m", "distance, mean, m", 3),
    ("p95_m", "distance, 95 % of the time, m", 3),
    ("max_m", "distance, largest, m", 3),
    ("settled_rms_m", "distance, RMS, once settled, m", 3),
    ("regret_m", "RMS beyond the bound, m", 3),
    ("energy_j", "propulsion energy, J", 0),
    ("heading_travel_rad", "heading travel, rad", 2),
    ("reference_jerk", "jerk of the references, m/s³", 4),
    ("solve_ms_p50", "solve time, median, ms", 4),
    ("solve_ms_p99", "solve time, 99 %, ms", 4),
    ("answers.mpc", "answers: program", 0),
    ("answers.previous_plan", "answers: previous plan", 0),
    ("answers.saturated_los", "answers: line of sight", 0),
    ("answers.hold", "answers: hold", 0),
    ("violations.turn_rate_radps", "above the turn rate, rad/s", 3),
    ("violations.speed_mps", "above the speed, m/s", 3),
    ("violations.keep_out_m", "inside keep-outs, m", 3),
    ("violations.no_go_m", "inside no-go areas, m", 3),
    ("violations.area_m", "outside the area, m", 3),
    ("violations.range_m", "out of acoustic range, m", 3),
    ("violations.energy_j", "beyond the energy budget, J", 3),
];

/// A number, or the violations of a limit: how often, for how long, and the worst.
fn for_people(value: &Value, digits: usize) -> String {
    let number = |value: &Value, digits: usize| match value.as_f64() {
        Some(number) => format!("{number:.digits$}"),
        None => "-".to_owned(),
    };
    match value["count"].as_u64() {
        None => number(value, digits),
        Some(0) => "0".to_owned(),
        Some(count) => {
            let (duration, worst) = (number(&value["duration_s"], 0), number(&value["worst"], digits));
            format!("{count}: {duration} s, {worst}")
        }
    }
}

/// All scores as table lines: of the craft together, of each, and each AUV's along its path.
pub fn lines(record: &Record) -> Vec<(String, String)> {
    let scores = Scores::of(record);
    let mut lines = scores.as_ref().map_or_else(Vec::new, Scores::lines);
    if let Some(fleet) = scores.and_then(|scores| scores.fleet) {
        for (id, craft) in fleet.craft {
            lines.push((format!("{id}.rms_m"), format!("{:.3}", craft.rms_m)));
            lines.push((format!("{id}.energy_j"), format!("{:.0}", craft.energy_j)));
            let served = fleet.served_s[&id].iter().filter(|(_, seconds)| 0.0 < **seconds);
            lines.extend(served.map(|(auv, s)| (format!("{id}.served_s.{auv}"), format!("{s:.0}"))));
        }
    }
    for auv in &Metrics::of(record).auvs {
        let values = auv_values(auv).into_iter();
        lines.extend(values.map(|(name, value)| (format!("{}.{name}", auv.id), format!("{value:.3}"))));
    }
    lines
}

fn auv_values(auv: &AuvMetrics) -> [(&'static str, f64); 7] {
    [
        ("cross_track_max_m", auv.cross_track_max_m),
        ("position_error_max_m", auv.position_error_max_m),
        ("depth_min_m", auv.depth_min_m),
        ("depth_max_m", auv.depth_max_m),
        ("pitch_min_rad", auv.pitch_min_rad),
        ("pitch_max_rad", auv.pitch_max_rad),
        ("surge_mean_mps", auv.surge_mean_mps),
    ]
}
