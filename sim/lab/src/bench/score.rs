//! What a run is worth on the board, and by which gains a law is judged for it.

use planner::angle::wrap;

use sim::{
    metrics::{Metrics, SurfaceCraftMetrics, Violation},
    record::{Record, SurfaceCraftRow},
};

/// Distance to the goal that counts as near, m: the reach of the shortest look-ahead tried.
pub(crate) const NEAR: f64 = 3.0;

/// Heading references that differ by more than this from one second to the next count as steep, rad/s.
///
/// 10°/s. Assumption: what a small twin-thruster craft follows without a jerk; its limit is 17°/s.
pub(crate) const STEEP: f64 = 0.174_532_925_199_432_95;

/// A reference this little outside its limits is rounding, m/s.
const NOTICEABLE: f64 = 1e-9;

/// A group of metrics for which a law has gains of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// How near the craft stays.
    Nearness,
    /// What that costs.
    Economy,
    /// How calmly it steers.
    Steering,
}

impl Family {
    /// Every family.
    pub const ALL: [Self; 3] = [Self::Nearness, Self::Economy, Self::Steering];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearness => "nearness",
            Self::Economy => "economy",
            Self::Steering => "steering",
        }
    }

    /// The metric by which gains are chosen.
    #[must_use]
    pub fn objective(self) -> Metric {
        match self {
            Self::Nearness => Metric::Rms,
            Self::Economy => Metric::Energy,
            Self::Steering => Metric::HeadingTravel,
        }
    }
}

/// A column of the board. Less is better in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Root mean square distance to the goal, m.
    Rms,
    /// Distance not exceeded 95 % of the time, m.
    P95,
    /// Time until the craft is first within `NEAR` of the goal, s; the whole mission if never.
    TimeToNear,
    /// Propulsion energy, J.
    Energy,
    /// Heading travel, rad.
    HeadingTravel,
    /// Share of seconds at whose end the heading reference steps by more than `STEEP`, %.
    SteepShare,
}

impl Metric {
    /// Every metric.
    pub const ALL: [Self; 6] = [
        Self::Rms,
        Self::P95,
        Self::TimeToNear,
        Self::Energy,
        Self::HeadingTravel,
        Self::SteepShare,
    ];

    /// Its name with the unit, as in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rms => "rms_m",
            Self::P95 => "p95_m",
            Self::TimeToNear => "time_to_3_m_s",
            Self::Energy => "energy_j",
            Self::HeadingTravel => "heading_travel_rad",
            Self::SteepShare => "steep_steps_percent",
        }
    }

    /// The gains by which a law is judged in it.
    #[must_use]
    pub(crate) fn family(self) -> Family {
        match self {
            Self::Rms | Self::P95 | Self::TimeToNear => Family::Nearness,
            Self::Energy => Family::Economy,
            Self::HeadingTravel | Self::SteepShare => Family::Steering,
        }
    }

    /// Its value in `score`.
    #[must_use]
    pub fn of(self, score: &Score) -> f64 {
        match self {
            Self::Rms => score.metrics.rms_m,
            Self::P95 => score.metrics.p95_m,
            Self::TimeToNear => score.near_after_s.unwrap_or(score.duration_s),
            Self::Energy => score.metrics.energy_j,
            Self::HeadingTravel => score.metrics.heading_travel_rad,
            Self::SteepShare => score.steep_share * 100.0,
        }
    }
}

/// What one run is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The record's metrics.
    pub metrics: SurfaceCraftMetrics,
    /// When the craft was first within `NEAR` of its goal, s; none if never.
    pub near_after_s: Option<f64>,
    /// How long the mission lasted, s.
    pub duration_s: f64,
    /// Share of seconds with a steep heading reference.
    pub steep_share: f64,
    /// Speed references outside the limits that the guide was given, m/s.
    pub reference: Violation,
}

impl Score {
    /// Of a mission with a surface craft; none without.
    #[must_use]
    pub fn of(record: &Record) -> Option<Self> {
        let metrics = Metrics::of(record).surface_craft?;
        let crafts = || {
            let rows = record.rows.iter();
            rows.filter_map(|row| Some((row.time, row.surface_craft.as_ref()?)))
        };
        let headings: Vec<f64> = crafts()
            .map(|(_, craft)| craft.reference.heading.radians())
            .collect();
        let step = STEEP * record.interval;
        let steep = headings
            .windows(2)
            .filter(|pair| step < wrap(pair[1] - pair[0]).abs());
        #[expect(
            clippy::cast_precision_loss,
            reason = "a mission has thousands of rows, not 2⁵³"
        )]
        let (n_steep, n_rows) = (steep.count() as f64, headings.len() as f64);
        let near = crafts().find(|(_, craft)| craft.distance() <= NEAR);
        Some(Self {
            metrics,
            near_after_s: near.map(|(time, _)| time),
            duration_s: n_rows * record.interval,
            steep_share: n_steep / n_rows,
            reference: Violation::of(record, &|row| {
                let craft = row.surface_craft.as_ref();
                craft.map_or(0.0, |craft| outside_limits(record, craft))
            }),
        })
    }
}

/// By how much a speed reference is outside its limits, m/s; 0 where that is rounding.
fn outside_limits(record: &Record, craft: &SurfaceCraftRow) -> f64 {
    let Some(limits) = &record.limits else { return 0.0 };
    let speed = craft.reference.speed;
    let excess = (speed - limits.speed_max).max(limits.speed_min - speed);
    if NOTICEABLE < excess { excess } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use planner::{angle::Heading, los::Reference};

    use super::*;
    use crate::tuning;
    use sim::{guide::LosGuide, mission::run, scenario::Scenario};

    /// A minute of tracking, with references put in by hand.
    fn record(reference: impl Fn(usize) -> Reference) -> Record {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(60.0);
        let tuning = tuning::grid(planner::los::LosLaw::SaturatedLos)[0];
        let mut record = run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("runs");
        for (k, row) in record.rows.iter_mut().enumerate() {
            row.surface_craft.as_mut().expect("has one").reference = reference(k);
        }
        record
    }

    fn reference(speed: f64, degrees: f64) -> Reference {
        Reference {
            speed,
            heading: Heading::new(degrees.to_radians()),
        }
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
        assert_eq!((found.count, found.seconds), (1, 2.0));
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
        assert_eq!((never.near_after_s, Metric::TimeToNear.of(&never)), (None, 60.0));
    }
}
