//! What a controller achieved on a mission, under the names that leave the program.

use std::collections::BTreeMap;

use crate::regret::regret;
use serde::Serialize;
use sim::{
    metrics::{AnswersByMethod, AuvMetrics, SurfaceCraftMetrics, Violation, Violations},
    record::Record,
};

/// A controller's scores. Distances are true ones, to the goal, over the whole mission.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// Root mean square distance, m.
    pub rms_m: f64,
    /// Mean distance, m.
    pub mean_m: f64,
    /// Distance not exceeded 95 % of the time, m.
    pub p95_m: f64,
    /// Largest distance, m.
    pub max_m: f64,
    /// Root mean square distance after the scenario's settling time, m.
    pub settled_rms_m: f64,
    /// Time within contact range of each underwater vehicle, s.
    pub time_in_range_s: BTreeMap<String, f64>,
    /// The craft's true limits, where it did not keep them.
    pub violations: ViolationScores,
    /// Propulsion energy, J.
    pub energy_j: f64,
    /// Heading travel, rad.
    pub heading_travel_rad: f64,
    /// Root mean square second difference of the velocity reference, m/s³.
    pub reference_jerk: f64,
    /// Median time of an answer, ms.
    pub solve_ms_p50: Option<f64>,
    /// Time of an answer that 99 % do not exceed, ms.
    pub solve_ms_p99: Option<f64>,
    /// Answers by the method that gave them.
    pub answers_by_method: AnswerCounts,
    /// How much nearer to the goal any craft of this hull could have stayed that knew the whole future, m
    /// (root mean square); none in waves, whose push has no bound.
    pub regret_m: Option<f64>,
}

/// Limits and bounds that the craft did not keep. The unit in a name is that of the worst excess.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ViolationScores {
    /// Turn rate beyond its limit.
    pub turn_rate_radps: ViolationScore,
    /// Speed beyond its limit.
    pub speed_mps: ViolationScore,
    /// Inside a disc to keep out of.
    pub keep_out_m: ViolationScore,
    /// Outside the area to stay in.
    pub area_m: ViolationScore,
    /// Too far from an underwater vehicle.
    pub range_m: ViolationScore,
    /// More propulsion energy than there is.
    pub energy_j: ViolationScore,
}

/// How one limit was not kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ViolationScore {
    /// Episodes.
    pub count: usize,
    /// Duration of all episodes, s.
    pub duration_s: f64,
    /// Largest excess.
    pub worst: f64,
}

impl From<Violation> for ViolationScore {
    fn from(violation: Violation) -> Self {
        Self {
            count: violation.count,
            duration_s: violation.seconds,
            worst: violation.worst,
        }
    }
}

impl ViolationScores {
    fn lines(&self) -> [(&'static str, String); 6] {
        [
            ("turn_rate_radps", self.turn_rate_radps),
            ("speed_mps", self.speed_mps),
            ("keep_out_m", self.keep_out_m),
            ("area_m", self.area_m),
            ("range_m", self.range_m),
            ("energy_j", self.energy_j),
        ]
        .map(|(name, score)| {
            let ViolationScore {
                count,
                duration_s,
                worst,
            } = score;
            let text = if count == 0 {
                "0".to_owned()
            } else {
                format!("{count}: {duration_s:.0} s, {worst:.3}")
            };
            (name, text)
        })
    }
}

/// Answers by method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AnswerCounts {
    /// The program, solved.
    pub mpc: usize,
    /// The previous plan, followed further.
    pub previous_plan: usize,
    /// The line-of-sight law.
    pub saturated_los: usize,
    /// Hold.
    pub hold: usize,
}

impl Scores {
    /// The scores of a mission with a surface craft.
    #[must_use]
    pub fn new(record: &Record, metrics: SurfaceCraftMetrics) -> Self {
        let Violations {
            turn_rate,
            speed,
            keep_out,
            area,
            range,
            energy,
        } = metrics.violations;
        let AnswersByMethod {
            mpc,
            previous_plan,
            saturated_los,
            hold,
        } = metrics.answers_by_method;
        Self {
            rms_m: metrics.rms_m,
            mean_m: metrics.mean_m,
            p95_m: metrics.p95_m,
            max_m: metrics.max_m,
            settled_rms_m: metrics.settled_rms_m,
            time_in_range_s: record
                .auv_ids
                .iter()
                .cloned()
                .zip(metrics.time_in_range_s)
                .collect(),
            violations: ViolationScores {
                turn_rate_radps: turn_rate.into(),
                speed_mps: speed.into(),
                keep_out_m: keep_out.into(),
                area_m: area.into(),
                range_m: range.into(),
                energy_j: energy.into(),
            },
            energy_j: metrics.energy_j,
            heading_travel_rad: metrics.heading_travel_rad,
            reference_jerk: metrics.reference_jerk,
            solve_ms_p50: metrics.solve_ms_p50,
            solve_ms_p99: metrics.solve_ms_p99,
            regret_m: regret(record).ok().flatten().map(|regret| regret.regret_m),
            answers_by_method: AnswerCounts {
                mpc,
                previous_plan,
                saturated_los,
                hold,
            },
        }
    }

    /// The scores as lines of a table: name, and value for people.
    #[must_use]
    pub fn lines(&self) -> Vec<(String, String)> {
        let milliseconds = |time: Option<f64>| time.map_or("-".to_owned(), |ms| format!("{ms:.4}"));
        let mut lines = vec![
            ("rms_m", format!("{:.3}", self.rms_m)),
            ("mean_m", format!("{:.3}", self.mean_m)),
            ("p95_m", format!("{:.3}", self.p95_m)),
            ("max_m", format!("{:.3}", self.max_m)),
            ("settled_rms_m", format!("{:.3}", self.settled_rms_m)),
            (
                "regret_m",
                self.regret_m
                    .map_or("-".to_owned(), |regret| format!("{regret:.3}")),
            ),
            ("energy_j", format!("{:.0}", self.energy_j)),
            ("heading_travel_rad", format!("{:.2}", self.heading_travel_rad)),
            ("reference_jerk", format!("{:.4}", self.reference_jerk)),
            ("solve_ms_p50", milliseconds(self.solve_ms_p50)),
            ("solve_ms_p99", milliseconds(self.solve_ms_p99)),
            ("answers.mpc", self.answers_by_method.mpc.to_string()),
            (
                "answers.previous_plan",
                self.answers_by_method.previous_plan.to_string(),
            ),
            (
                "answers.saturated_los",
                self.answers_by_method.saturated_los.to_string(),
            ),
            ("answers.hold", self.answers_by_method.hold.to_string()),
        ]
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect::<Vec<_>>();
        let violations = self.violations.lines();
        lines.extend(violations.map(|(limit, text)| (format!("violations.{limit}"), text)));
        let in_range = self.time_in_range_s.iter();
        lines
            .extend(in_range.map(|(id, seconds)| (format!("time_in_range_s.{id}"), format!("{seconds:.0}"))));
        lines
    }
}

/// How an underwater vehicle kept to its path, as lines of a table: name and value.
#[must_use]
pub fn auv_lines(auv: &AuvMetrics) -> [(&'static str, f64); 7] {
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
