//! The scores of a run, by column.

use planner::{angle::wrap, los::Reference};

use sim::fleet::FleetMetrics;
use sim::metrics::{Metrics, SurfaceCraftMetrics, Violation, Violations};
use sim::record::{Record, SurfaceCraftRow};

/// Distance to the goal that counts as near, m: a short look-ahead distance.
pub(super) const NEAR: f64 = 3.0;

/// Steep: the heading reference changes by more than this from one second to the next, rad/s.
/// 10°/s. Assumption: a small twin-thruster craft follows this smoothly; its limit is 17°/s.
pub(super) const STEEP: f64 = 0.174_532_925_199_432_95;

/// A reference this little outside its limits is rounding, m/s.
const NOTICEABLE: f64 = 1e-9;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Score {
    pub(super) metrics: SurfaceCraftMetrics,
    /// What several craft did together.
    pub(super) fleet: Option<FleetMetrics>,
    /// First time within `NEAR` of the goal, s; none if never.
    pub(super) near_after_s: Option<f64>,
    /// Duration of the mission, s.
    pub(super) duration_s: f64,
    /// Share of seconds with a steep heading reference.
    pub(super) steep_share: f64,
    /// Speed references outside the declared limits, m/s.
    pub(super) reference: Violation,
    /// Sum of all changes of the speed reference once settled, m/s.
    pub(super) speed_travel: f64,
    /// Sum of all changes of the heading reference once settled, rad.
    pub(super) heading_travel: f64,
}

impl Score {
    pub(super) fn of(record: &Record) -> Option<Self> {
        let metrics = Metrics::of(record).surface_craft?;
        let n_rows = record.surface_craft_rows().count() as f64;
        let settled = record.settled_rows();
        let settled = settled.filter_map(|row| Some(row.surface_craft.as_ref()?.reference));
        let settled: Vec<Reference> = settled.collect();
        let travel = |change: fn(&[Reference]) -> f64| settled.windows(2).map(change).sum();
        let mut crafts = record.surface_craft_rows();
        let near = crafts.find(|(_, craft)| craft.distance() <= NEAR);
        Some(Self {
            metrics,
            fleet: FleetMetrics::of(record),
            near_after_s: near.map(|(time, _)| time),
            duration_s: n_rows * record.interval,
            steep_share: {
                let (steep, all) = steps_above(STEEP, record);
                steep / all
            },
            reference: Violation::of(record, &|row| {
                let craft = row.surface_craft.as_ref();
                craft.map_or(0.0, |craft| outside_limits(record, craft))
            }),
            speed_travel: travel(|pair| (pair[1].speed - pair[0].speed).abs()),
            heading_travel: travel(|pair| wrap(pair[1].heading.radians() - pair[0].heading.radians()).abs()),
        })
    }
}

/// Number of seconds in which the heading reference turns faster than `rate`, rad/s, and of all
/// seconds. Callers divide them once: the digest of rows contains every bit.
pub(super) fn steps_above(rate: f64, record: &Record) -> (f64, f64) {
    let rows = record.surface_craft_rows();
    let headings: Vec<f64> = rows.map(|(_, craft)| craft.reference.heading.radians()).collect();
    let step = rate * record.interval;
    let is_above = |pair: &&[f64]| step < wrap(pair[1] - pair[0]).abs();
    let above = headings.windows(2).filter(is_above);
    (above.count() as f64, headings.len() as f64)
}

/// A column: its name, with the unit at the end, and its value.
type Number = (&'static str, fn(&Score, &SurfaceCraftMetrics, &Violations) -> Option<f64>);

impl Score {
    pub(super) fn value(&self, (_, of): Number) -> Option<f64> {
        of(self, &self.metrics, &self.metrics.violations)
    }
}

#[expect(
    clippy::unnecessary_wraps,
    reason = "thousands of episodes and ticks, not 2⁵³; a column may have no value"
)]
fn count(n: usize) -> Option<f64> {
    Some(n as f64)
}

/// The columns, with references of the first of several craft. Less is better, but for
/// `duration_s`, `visits`, distances from others, turns, and counts of answers and passed vessels.
pub(super) const SCORES: [Number; 47] = [
    ("rms_m", |_, m, _| Some(m.rms_m)),
    ("mean_m", |_, m, _| Some(m.mean_m)),
    ("p95_m", |_, m, _| Some(m.p95_m)),
    ("max_m", |_, m, _| Some(m.max_m)),
    ("settled_rms_m", |_, m, _| Some(m.settled_rms_m)),
    ("time_to_3_m_s", |s, _, _| s.near_after_s),
    ("duration_s", |s, _, _| Some(s.duration_s)),
    ("energy_j", |_, m, _| Some(m.energy_j)),
    ("heading_travel_rad", |_, m, _| Some(m.heading_travel_rad)),
    ("reference_jerk", |_, m, _| Some(m.reference_jerk)),
    ("speed_reference_travel_mps", |s, _, _| Some(s.speed_travel)),
    ("heading_reference_travel_rad", |s, _, _| Some(s.heading_travel)),
    ("steep_steps_percent", |s, _, _| Some(100.0 * s.steep_share)),
    ("reference_violations", |s, _, _| count(s.reference.count)),
    ("reference_violation_worst_mps", |s, _, _| Some(s.reference.worst)),
    ("speed_violations", |_, _, v| count(v.speed_mps.count)),
    ("speed_violation_worst_mps", |_, _, v| Some(v.speed_mps.worst)),
    ("turn_rate_violations", |_, _, v| count(v.turn_rate_radps.count)),
    ("keep_out_violations", |_, _, v| count(v.keep_out_m.count)),
    ("keep_out_violation_worst_m", |_, _, v| Some(v.keep_out_m.worst)),
    ("no_go_violations", |_, _, v| count(v.no_go_m.count)),
    ("no_go_violation_worst_m", |_, _, v| Some(v.no_go_m.worst)),
    ("area_violations", |_, _, v| count(v.area_m.count)),
    ("range_violations", |_, _, v| count(v.range_m.count)),
    ("range_violation_s", |_, _, v| Some(v.range_m.duration_s)),
    ("energy_violations", |_, _, v| count(v.energy_j.count)),
    ("answers_mpc", |_, m, _| count(m.answers_by_method.mpc)),
    ("answers_previous_plan", |_, m, _| count(m.answers_by_method.previous_plan)),
    ("answers_saturated_los", |_, m, _| count(m.answers_by_method.saturated_los)),
    ("answers_hold", |_, m, _| count(m.answers_by_method.hold)),
    ("navigation_rms_m", |_, m, _| Some(m.localisation?.rms_m)),
    ("navigation_max_m", |_, m, _| Some(m.localisation?.max_m)),
    ("vessel_least_m", |_, m, _| Some(m.traffic?.least_m)),
    ("vessel_violations", |_, m, _| count(m.traffic?.too_near_m.count)),
    ("vessel_violation_s", |_, m, _| Some(m.traffic?.too_near_m.duration_s)),
    ("vessels_to_port", |_, m, _| count(m.traffic?.passed_to_port)),
    ("vessels_to_starboard", |_, m, _| count(m.traffic?.passed_to_starboard)),
    ("first_turn_rad", |_, m, _| m.traffic?.first_turn_rad),
    ("manoeuvring_rms_m", |_, m, _| m.traffic?.manoeuvring_rms_m),
    ("afterwards_rms_m", |_, m, _| m.traffic?.afterwards_rms_m),
    ("visit_mean_cost", |_, m, _| Some(m.visits?.mean_cost)),
    ("visit_max_cost", |_, m, _| Some(m.visits?.max_cost)),
    ("visits", |_, m, _| count(m.visits?.visits)),
    ("visit_changes", |_, m, _| count(m.visits?.changes)),
    ("visit_deadlines_missed", |_, m, _| count(m.visits?.deadlines_missed)),
    ("craft_separation_m", |s, _, _| Some(s.fleet.as_ref()?.craft_separation_m)),
    ("reassignments", |s, _, _| count(s.fleet.as_ref()?.reassignments)),
];

/// Distance of a speed reference from its limits, m/s; 0 within them, up to rounding.
fn outside_limits(record: &Record, craft: &SurfaceCraftRow) -> f64 {
    let Some(limits) = &record.limits else { return 0.0 };
    let speed = craft.reference.speed;
    let excess = (speed - limits.speed_max).max(limits.speed_min - speed);
    if NOTICEABLE < excess { excess } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use planner::angle::Heading;

    use super::*;
    use sim::{guide::LosGuide, mission::run, scenario::Scenario};

    /// A minute of tracking, with references put in by hand.
    fn record(reference: impl Fn(usize) -> Reference) -> Record {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(60.0);
        let tuning = crate::campaign::grid::grid(planner::los::LosLaw::SaturatedLos)[0];
        let mut record = run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("runs");
        for (k, row) in record.rows.iter_mut().enumerate() {
            row.surface_craft.as_mut().expect("has one").reference = reference(k);
        }
        record
    }

    fn reference(speed: f64, degrees: f64) -> Reference {
        Reference { speed, heading: Heading::new(degrees.to_radians()) }
    }

    #[test]
    fn steps_are_steep_above_ten_degrees_a_second_either_way_and_across_south() {
        // 175° and −175° are ten degrees apart and a hair; then every other second 11°.
        let share = |a: f64, b: f64| {
            let record = record(|k| reference(0.3, if k % 2 == 0 { a } else { b }));
            Score::of(&record).expect("has a craft").steep_share
        };
        assert_eq!(share(-175.0, 175.1), 0.0);
        assert_eq!(share(0.0, 10.0), 0.0);
        // 59 steps in 60 rows.
        assert!((share(0.0, 11.0) - 59.0 / 60.0).abs() < 1e-12);
        assert!((share(-175.0, 174.0) - 59.0 / 60.0).abs() < 1e-12);
    }

    #[test]
    fn references_outside_the_limits_are_counted_by_episode() {
        let record = record(|k| reference(if k == 3 || k == 4 { 1.7 } else { 1.5 }, 0.0));
        let found = Score::of(&record).expect("has a craft").reference;
        assert_eq!((found.count, found.duration_s), (1, 2.0));
        assert!((found.worst - 0.2).abs() < 1e-12);
    }

    #[test]
    fn near_is_when_the_goal_is_first_within_three_metres() {
        let mut record = record(|_| reference(0.3, 0.0));
        for row in &mut record.rows {
            let craft = row.surface_craft.as_mut().expect("has one");
            craft.position = craft.goal;
            craft.position.x += (10.0 - row.time).abs();
        }
        let score = Score::of(&record).expect("has a craft");
        assert_eq!((score.near_after_s, score.duration_s), (Some(7.0), 60.0));
        for row in &mut record.rows {
            row.surface_craft.as_mut().expect("has one").position.x += 100.0;
        }
        let never = Score::of(&record).expect("has a craft");
        assert_eq!((never.near_after_s, never.duration_s), (None, 60.0));
    }
}
