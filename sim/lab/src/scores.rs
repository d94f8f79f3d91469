//! A controller's scores on a mission, under their public names.

use serde::Serialize;
use sim::{
    metrics::{AuvMetrics, Metrics, SurfaceCraftMetrics, Violation},
    record::Record,
};

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
}

impl Scores {
    /// The scores of a mission; none without a surface craft.
    #[must_use]
    pub fn of(record: &Record) -> Option<Self> {
        let metrics = Metrics::of(record).surface_craft?;
        let regret_m = bound_rms_m(record).map(|bound| metrics.rms_m - bound);
        Some(Self { metrics, regret_m })
    }

    /// The scores as lines of a table: name, and value for people.
    #[must_use]
    pub fn lines(&self) -> Vec<(String, String)> {
        let metrics = &self.metrics;
        let (answers, violations) = (&metrics.answers_by_method, &metrics.violations);
        let number = |value: f64, digits: usize| format!("{value:.digits$}");
        let optional =
            |value: Option<f64>, digits| value.map_or("-".to_owned(), |value| number(value, digits));
        let violation = |violation: &Violation| match violation.count {
            0 => "0".to_owned(),
            count => format!("{count}: {:.0} s, {:.3}", violation.duration_s, violation.worst),
        };
        let lines = [
            ("rms_m", number(metrics.rms_m, 3)),
            ("mean_m", number(metrics.mean_m, 3)),
            ("p95_m", number(metrics.p95_m, 3)),
            ("max_m", number(metrics.max_m, 3)),
            ("settled_rms_m", number(metrics.settled_rms_m, 3)),
            ("regret_m", optional(self.regret_m, 3)),
            ("energy_j", number(metrics.energy_j, 0)),
            ("heading_travel_rad", number(metrics.heading_travel_rad, 2)),
            ("reference_jerk", number(metrics.reference_jerk, 4)),
            ("solve_ms_p50", optional(metrics.solve_ms_p50, 4)),
            ("solve_ms_p99", optional(metrics.solve_ms_p99, 4)),
            ("answers.mpc", answers.mpc.to_string()),
            ("answers.previous_plan", answers.previous_plan.to_string()),
            ("answers.saturated_los", answers.saturated_los.to_string()),
            ("answers.hold", answers.hold.to_string()),
            (
                "violations.turn_rate_radps",
                violation(&violations.turn_rate_radps),
            ),
            ("violations.speed_mps", violation(&violations.speed_mps)),
            ("violations.keep_out_m", violation(&violations.keep_out_m)),
            ("violations.area_m", violation(&violations.area_m)),
            ("violations.range_m", violation(&violations.range_m)),
            ("violations.energy_j", violation(&violations.energy_j)),
        ];
        let visits = metrics.visits.iter().flat_map(|visits| {
            [
                ("visits.mean_cost", number(visits.mean_cost, 2)),
                ("visits.max_cost", number(visits.max_cost, 1)),
                ("visits.visits", visits.visits.to_string()),
                ("visits.changes", visits.changes.to_string()),
                ("visits.deadlines_missed", visits.deadlines_missed.to_string()),
            ]
        });
        let lines = visits.chain(lines).map(|(name, value)| (name.to_owned(), value));
        let in_range = metrics.time_in_range_s.iter();
        let in_range = in_range.map(|(id, seconds)| (format!("time_in_range_s.{id}"), number(*seconds, 0)));
        lines.chain(in_range).collect()
    }
}

/// All scores as table lines: the surface craft's, and each AUV's distance from its path.
#[must_use]
pub fn lines(record: &Record) -> Vec<(String, String)> {
    let mut lines = Scores::of(record).map_or_else(Vec::new, |scores| scores.lines());
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
