//! Where an AUV was when it was last heard of: from its reports, or as the client says.

use std::cmp::Ordering;

use nalgebra::{Matrix4, Vector2};

use crate::{
    estimate::{
        interacting::Interacting,
        kalman::Kalman,
        on_path::OnPath,
        track::Track,
        turn::{clear, remembered_turn_rate, turn_rate},
    },
    facts::{
        angle::Course,
        auv::Auv,
        evidence::{AuvState, Evidence, FORECAST_AGE_MAX, Report, SPEED_AT_REST},
        known_path::{KnownPath, OFFSET_FROM_PATH_MAX},
        reference::PreviousTarget,
    },
};

/// A telemetered rate of turn older than this is no longer taken for so, s.
///
/// Six of the ten-second slots in which an acoustic network usually hears of a vehicle, a third of a lawn-mower's
/// turn. With a longer one, a vehicle that falls silent in a turn would be forecast to circle; see
/// `docs/tuning.md#estimating-the-auvs`.
pub(crate) const TURN_RATE_AGE_MAX: f64 = 60.0;

/// Fastest that an estimate is, m/s: the fastest that a snapshot lets a vehicle say it is.
const SPEED_MAX: f64 = 10.0;

/// Where an AUV is taken to have been when it was last heard of.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its state at the time of the newest report that the estimate rests on. With a covariance where it is made of
    /// reports.
    pub state: AuvState,
    /// The reports that the estimate does not rest on, by their place in the observation, ascending: outliers, those
    /// before a jump, and what was said twice.
    pub rejected: Vec<usize>,
}

impl Estimate {
    /// Of `auv` by what is known at time `now`, s, of a `current` (north, east), m/s, too; of a state that reports no rate of
    /// turn also by what the previous plan knew, and the time of the report that it knew it from.
    pub(crate) fn new(
        auv: &Auv,
        now: f64,
        current: &Vector2<f64>,
        previous: Option<(&PreviousTarget, f64)>,
    ) -> Self {
        match &auv.evidence {
            Evidence::State(state) => {
                let mut state = state.clone();
                // A gyroscope never reads exactly 0: it is what stands for a rate that is left out.
                if let (0.0, Some((earlier, reported))) = (state.turn_rate, previous) {
                    let between = now - state.age - reported;
                    state.turn_rate = remembered_turn_rate(earlier, &state, between);
                }
                Self {
                    state,
                    rejected: Vec::new(),
                }
            }
            Evidence::Reports(reports) => from_reports(reports, auv.path.as_ref(), now, current),
        }
    }

    /// Root mean square distance between estimate and vehicle now, m, if it went straight on since: the square root
    /// of the trace of the position's covariance. None where the client gave a state without covariance.
    #[must_use]
    pub fn position_sigma(&self) -> Option<f64> {
        let AuvState {
            position,
            age,
            covariance,
            ..
        } = &self.state;
        let now = Kalman::new(0.0, position, &self.state.velocity(), covariance.as_ref()?).at(*age);
        Some(now.position_variance().max(0.0).sqrt())
    }
}

/// Filters `reports`, at least one, in order of time.
fn from_reports(reports: &[Report], path: Option<&KnownPath>, now: f64, current: &Vector2<f64>) -> Estimate {
    // What is older than anything that is forecast says only where a vehicle was of which nothing else is known.
    let newest = reports
        .iter()
        .map(|report| report.time)
        .fold(f64::NEG_INFINITY, f64::max);
    let oldest = (now - FORECAST_AGE_MAX).min(newest);
    let mut numbered: Vec<_> = reports
        .iter()
        .enumerate()
        .filter(|(_, report)| oldest <= report.time)
        .map(|(number, report)| {
            // What is dated into the future can only be taken for new.
            let time = report.time.min(now);
            (number, Report { time, ..*report })
        })
        .collect();
    numbered.sort_by(|(_, a), (_, b)| in_order(a, b));
    // One message over two links is no second measurement.
    numbered.dedup_by(|(_, later), (_, first)| in_order(first, later) == Ordering::Equal);

    let free = Track::through(&numbered, Interacting::start);
    let along = path
        .map(|known| Track::through(&numbered, |report| OnPath::start(report, known, current)))
        .filter(|along| is_followed(along, &free));
    let (filtered, used) = match &along {
        Some(track) => (Filtered::from(&track.filter), &track.used),
        None => (Filtered::from(&free.filter.combined()), &free.used),
    };
    Estimate {
        state: filtered.state(used, now),
        rejected: (0..reports.len())
            .filter(|number| used.iter().all(|(used, _)| used != number))
            .collect(),
    }
}

/// Whether a vehicle that goes freely along `free` follows its path as `along` has it: it moves, is near the path,
/// and the path explains as many reports, but for two that a free motion may have taken for a turn.
fn is_followed(along: &Track<OnPath<'_>>, free: &Track<Interacting>) -> bool {
    free.filter.combined().velocity().norm() >= SPEED_AT_REST
        && along.filter.offset().abs() <= OFFSET_FROM_PATH_MAX
        && along.used.len() + 2 >= free.used.len()
}

/// By time, then by everything else, so that no order in which reports are given can show; what depends on where north
/// is comes last.
pub(crate) fn in_order(a: &Report, b: &Report) -> Ordering {
    let numbers = |report: &Report| {
        let or_none = |value: Option<f64>| value.unwrap_or(f64::NEG_INFINITY);
        [
            report.time,
            report.sigma,
            or_none(report.depth),
            or_none(report.ground_track.map(|track| track.speed)),
            or_none(report.turn_rate),
            or_none(report.ground_track.map(|track| track.course.radians())),
            report.position.x,
            report.position.y,
        ]
    };
    let pairs = numbers(a).into_iter().zip(numbers(b));
    pairs
        .map(|(a, b)| a.total_cmp(&b))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}

/// What a filter holds after its last report.
struct Filtered {
    time: f64,
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    covariance: Matrix4<f64>,
}

impl From<&Kalman> for Filtered {
    fn from(filter: &Kalman) -> Self {
        Self {
            time: filter.time(),
            position: filter.position(),
            velocity: filter.velocity(),
            covariance: *filter.covariance(),
        }
    }
}

impl From<&OnPath<'_>> for Filtered {
    fn from(filter: &OnPath<'_>) -> Self {
        Self {
            time: filter.time(),
            position: filter.position(),
            velocity: filter.velocity(),
            covariance: filter.covariance(),
        }
    }
}

impl Filtered {
    /// When and how fast it turned by the courses of the two newest reports, of which neither reports it.
    fn turning(used: &[(usize, Report)]) -> Option<(f64, f64)> {
        let [.., (_, before), (_, after)] = used else {
            return None;
        };
        let [from, to] = [before.ground_track?, after.ground_track?].map(|track| track.velocity());
        let rate = turn_rate(&from, &to, after.time - before.time)?;
        Some((after.time, clear(rate)))
    }

    /// The state, with what the newest of the reports in the filter say of depth and turn.
    fn state(&self, used: &[(usize, Report)], now: f64) -> AuvState {
        let newest_first = || used.iter().rev().map(|(_, report)| report);
        let reported = newest_first().find_map(|report| report.turn_rate.map(|rate| (report.time, rate)));
        let turning = reported.or_else(|| Self::turning(used));
        AuvState {
            position: self.position,
            // A vehicle that never reports its depth is taken to be at the surface.
            depth: newest_first().find_map(|report| report.depth).unwrap_or(0.0),
            course: Course::of(&self.velocity),
            speed: self.velocity.norm().min(SPEED_MAX),
            turn_rate: turning
                .filter(|(time, _)| now - time <= TURN_RATE_AGE_MAX)
                .map_or(0.0, |(_, rate)| rate),
            age: (now - self.time).max(0.0),
            covariance: Some(self.covariance),
        }
    }
}
