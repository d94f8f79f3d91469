//! One flight of a stranger, and what is kept of it.

use planner::{
    angle::wrap,
    craft::{Craft, CraftEstimate},
    plan::Method,
};

use sim::{
    guide::{Guide, GuideError, LosGuide, MpcGuide},
    mission::Mission,
    record::{Record, SurfaceCraftRow},
};

/// When estimates are looked at, s.
pub(crate) const CHECKPOINTS: [f64; 3] = [60.0, 120.0, 300.0];

/// From when on a planner with nothing declared has had time to learn, s.
pub(crate) const LATE: f64 = 120.0;

/// A step that is larger than the craft turns by no more than this factor is rounding: the planner's references turn as
/// fast as the craft does where they must.
const ROUNDING: f64 = 1.0 + 1e-6;

/// An estimate whose standard deviation is below this share of what it began with has learnt something.
const LEARNT_SHARE: f64 = 0.5;

/// What is kept of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Root mean square distance to the goal, m.
    pub rms_m: f64,
    /// The same after `LATE`, or in the second half of a shorter flight.
    pub late_rms_m: f64,
    /// Propulsion energy, J.
    pub energy_j: f64,
    /// Share of seconds at whose end the heading reference steps by more than the craft turns in one.
    pub steep_share: f64,
    /// Total variation of the speed reference after `LATE`, m/s.
    pub speed_variation_mps: f64,
    /// Total variation of the heading reference after `LATE`, rad.
    pub heading_variation_rad: f64,
    /// Shares of seconds that were answered by the program, the previous plan, a law and hold.
    pub answered: [f64; 4],
    /// How long the flight lasted, s.
    pub duration_s: f64,
    /// For how long the craft was said not to follow, s.
    pub alarm_s: f64,
    /// When it was said so anew, s.
    pub alarms_at_s: Vec<f64>,
    /// When that was withdrawn, s, in the same order; one fewer where it never was.
    pub clears_at_s: Vec<f64>,
    /// What was known of the craft at `CHECKPOINTS`; none of a law.
    pub estimates: Option<[Estimates; 3]>,
}

/// What was known of a craft at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimates {
    /// Lag of the heading loop, s.
    pub heading_lag: Learnt,
    /// Lag of the surge loop, s.
    pub surge_lag: Learnt,
    /// Sway per surge and yaw rate, s.
    pub drift: Learnt,
}

/// An estimate beside the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// What step tests found.
    pub truth: f64,
    /// Whether the planner learnt something of it: the deviation is less than half of what it was.
    pub excited: bool,
}

impl Learnt {
    /// Whether the truth is within 1.96 standard deviations.
    #[must_use]
    pub(crate) fn covers(&self) -> bool {
        (self.value - self.truth).abs() <= 1.96 * self.sigma
    }
}

/// Flies a law.
pub(super) fn fly_law(
    mut mission: Mission,
    guide: &mut LosGuide,
    craft: &Craft,
) -> Result<Flight, GuideError> {
    while !mission.is_over() {
        let snapshot = mission.look()?;
        let asked = snapshot
            .as_ref()
            .map(|snapshot| guide.guide(snapshot))
            .transpose()?;
        mission.go_on(snapshot.as_ref().zip(asked));
    }
    Ok(Flight::of(mission.record(), craft))
}

/// Flies the planner, and watches what it makes of its craft.
pub(super) fn fly_planner(
    mut mission: Mission,
    guide: &mut MpcGuide,
    craft: &Craft,
) -> Result<Flight, GuideError> {
    let mut first = None;
    let mut estimates = vec![];
    let mut alarms = vec![];
    while !mission.is_over() {
        let time = mission.time();
        let snapshot = mission.look()?;
        let asked = snapshot
            .as_ref()
            .map(|snapshot| guide.guide(snapshot))
            .transpose()?;
        if let Some(known) = guide.asked().map(planner::snapshot::Snapshot::craft_estimate) {
            let first = first.get_or_insert(*known);
            alarms.push((time, known.monitor.alarm));
            if CHECKPOINTS.iter().any(|at| (at - time).abs() < 0.01) {
                estimates.push(Estimates::of(known, first, craft));
            }
        }
        mission.go_on(snapshot.as_ref().zip(asked));
    }
    let record = mission.record();
    let changes_to = |wanted: bool| -> Vec<f64> {
        let before = std::iter::once(false).chain(alarms.iter().map(|(_, alarm)| *alarm));
        let changes = alarms.iter().zip(before);
        let changes = changes.filter(|((_, now), before)| now != before && *now == wanted);
        changes.map(|((time, _), _)| *time).collect()
    };
    Ok(Flight {
        alarm_s: record.interval * count(alarms.iter().filter(|(_, alarm)| *alarm).count()),
        alarms_at_s: changes_to(true),
        clears_at_s: changes_to(false),
        estimates: estimates.try_into().ok(),
        ..Flight::of(record, craft)
    })
}

impl Estimates {
    fn of(known: &CraftEstimate, first: &CraftEstimate, craft: &Craft) -> Self {
        // What is learnt is the filters' variance: of a time constant, that of its logarithm.
        let learnt = |(value, sigma): (f64, f64), truth: f64, variance: fn(&CraftEstimate) -> f64| Learnt {
            value,
            sigma,
            truth,
            excited: variance(known) < LEARNT_SHARE * LEARNT_SHARE * variance(first),
        };
        let drift = (known.drift.mean, known.drift.variance.max(0.0).sqrt());
        Self {
            heading_lag: learnt(known.heading_lag(), craft.heading.lag(), |known| {
                known.heading_covariance.m22
            }),
            surge_lag: learnt(known.surge_lag(), craft.surge.lag(), |known| {
                known.surge_covariance.m22
            }),
            drift: learnt(drift, craft.sway_per_yaw_rate, |known| known.drift.variance),
        }
    }
}

impl Flight {
    /// Whether the craft was said not to follow just before `time` s.
    #[must_use]
    pub(crate) fn alarmed_at(&self, time: f64) -> bool {
        let before = |times: &[f64]| times.iter().filter(|at| **at < time).count();
        before(&self.clears_at_s) < before(&self.alarms_at_s)
    }

    fn of(record: &Record, craft: &Craft) -> Self {
        let rows: Vec<(f64, &SurfaceCraftRow)> = record
            .rows
            .iter()
            .filter_map(|row| Some((row.time, row.surface_craft.as_ref()?)))
            .collect();
        let n = count(rows.len());
        // The second half of a flight that is over sooner.
        let settled = rows.last().map_or(LATE, |(end, _)| LATE.min(0.5 * end));
        let rms = |from: f64| {
            let squares = rows.iter().filter(|(time, _)| from <= *time);
            let squares: Vec<f64> = squares.map(|(_, row)| row.distance().powi(2)).collect();
            (squares.iter().sum::<f64>() / count(squares.len())).sqrt()
        };
        let steps = rows.windows(2).map(|pair| {
            let (before, after) = (pair[0].1.reference, pair[1].1.reference);
            let turned = wrap(after.heading.radians() - before.heading.radians()).abs();
            (pair[0].0, turned, (after.speed - before.speed).abs())
        });
        let steps: Vec<(f64, f64, f64)> = steps.collect();
        let late = || steps.iter().filter(|(time, ..)| settled <= *time);
        let turn = craft.heading.rate_max * record.interval;
        let answered = |methods: &[Method]| {
            count(
                rows.iter()
                    .filter(|(_, row)| methods.contains(&row.method))
                    .count(),
            ) / n
        };
        Self {
            rms_m: rms(0.0),
            late_rms_m: rms(settled),
            energy_j: rows.last().map_or(0.0, |(_, row)| row.energy),
            steep_share: count(
                steps
                    .iter()
                    .filter(|(_, turned, _)| turn * ROUNDING < *turned)
                    .count(),
            ) / n,
            speed_variation_mps: late().map(|(_, _, speed)| speed).sum(),
            heading_variation_rad: late().map(|(_, turned, _)| turned).sum(),
            answered: [
                answered(&[Method::Mpc]),
                answered(&[Method::PreviousPlan]),
                answered(&[
                    Method::SaturatedLos,
                    Method::SaturatedLosTrackerFrame,
                    Method::IntegralLos,
                    Method::WaypointBox,
                    Method::PrintedLos,
                ]),
                answered(&[Method::Hold]),
            ],
            duration_s: n * record.interval,
            alarm_s: 0.0,
            alarms_at_s: vec![],
            clears_at_s: vec![],
            estimates: None,
        }
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "a mission has thousands of rows, not 2⁵³"
)]
fn count(n: usize) -> f64 {
    n as f64
}
