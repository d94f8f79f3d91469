//! Estimates of AUVs at their last report, from reports or a given state.

use std::cmp::Ordering;

use nalgebra::{Matrix4, Vector2};

use crate::{
    estimate::{
        dive::sawtooth,
        interacting::Interacting,
        kalman::Kalman,
        legs::TrackPoint,
        on_path::{NextTurn, OnPath, PathFit, PathHypothesis, SPEED_DENSITIES},
        repeats::{PastTrack, Repeats},
        screening::ScreenedReports,
        track::Track,
        turn::{clear, remembered_turn_rate, turn_rate},
    },
    facts::{
        angle::Course,
        auv::{Auv, Dive},
        evidence::{AuvState, FORECAST_AGE_MAX, Report, SPEED_AT_REST},
        known_path::{DeclaredPath, KnownPath},
        previous_plan::RememberedTarget,
    },
};

/// Largest age of a telemetered rate of turn, s. Six of the ten-second slots in which an acoustic
/// network usually hears of a vehicle, a third of a lawn-mower's turn. With a longer one, a vehicle
/// that falls silent in a turn would be forecast to circle; see
/// `docs/rationale.md#estimating-the-auvs`.
pub(crate) const TURN_RATE_AGE_MAX: f64 = 60.0;

/// Newest reports of a hasty estimate: enough for a velocity, with two outliers.
const HASTY: usize = 8;

/// Largest estimated speed, m/s: the largest that a snapshot accepts.
const SPEED_MAX: f64 = 10.0;

/// Estimate of an AUV at its last report.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// State at the time of the newest used report; with a covariance if from reports.
    pub state: AuvState,
    /// Indices of unused reports, ascending: outliers, reports before a jump, and repetitions.
    pub rejected: Vec<usize>,
    /// Standard deviation to add to the fixes, m: their variances are larger by its square. 0 if
    /// the reported accuracies are consistent.
    pub inflation: f64,
    /// `true` if the fixes contradict the reported courses and speeds, which are then unused.
    pub velocity_contradicted: bool,
    /// Fit to its path. `None` without a path or without reports.
    pub route: Option<Route>,
    /// Pattern that its track repeats, if it declares no path.
    pub repeats: Option<Repeats>,
    /// Path that its reports were compared with: the repeated track, or the declared path with the
    /// observed turns. `None` without either, and without reports.
    pub path: Option<KnownPath>,
    /// Sawtooth in its reported depths.
    pub dive: Option<Dive>,
    /// Its past track, as the next request needs it.
    pub track: Vec<TrackPoint>,
}

/// Fit of a vehicle to its path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Route {
    /// Probability that it follows the path.
    pub probability: f64,
    /// Its place on the path, if it follows it.
    pub fit: PathFit,
    /// Its next turn, if it follows the path.
    pub next_turn: Option<NextTurn>,
    /// Current along the path (north, east), m/s; 0 if the declared speed is over ground.
    pub current: Vector2<f64>,
}

impl Route {
    /// `true` if it probably follows its path.
    #[must_use]
    pub fn is_followed(&self) -> bool {
        0.5 <= self.probability
    }
}

/// Probability at the first report that a vehicle follows its path.
const FOLLOWS_AT_FIRST: f64 = 0.9;

/// Mean time until a vehicle leaves its path, s.
const LEAVES_AFTER: f64 = 3600.0;

/// Mean time until it returns, s.
const RETURNS_AFTER: f64 = 600.0;

/// Number of newest reports that test whether a vehicle still repeats its track: older ones made
/// the path. Misfits of three in a row end the repetition; the weight of each is limited, since a
/// turn with few fixes is metres off.
const TELLING: usize = 3;
const ODDS_MAX: f64 = 3.0;

/// Least current for the hypothesis of a declared speed over ground, m/s; less is uncertain anyway.
const CURRENT_MIN: f64 = 0.05;

/// Largest distance of two simultaneous fixes that are one message over two links, m.
const REPEATED_WITHIN: f64 = 0.1;

impl Estimate {
    /// Estimates `auv` at `now`, s, in a `current` (north, east), m/s. A state without a rate of
    /// turn takes it from the previous plan, given with the time of its report. Given the track
    /// `before`, an AUV without a path or a dive may get them from its track and depths. Once
    /// `due`, only the newest reports count, without a path.
    pub(crate) fn new(
        auv: &Auv,
        path: Option<&KnownPath>,
        now: f64,
        current: &Vector2<f64>,
        previous: Option<(RememberedTarget, f64)>,
        before: Option<&[TrackPoint]>,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let Some(state) = &auv.state else {
            let reports = auv.reports.as_deref().unwrap_or_default();
            let path = path.filter(|_| !due());
            let declared = auv.path.as_ref().filter(|_| path.is_some());
            let others = declared.map_or_else(Vec::new, DeclaredPath::with_other_turn_radii);
            let paths: Vec<_> = path.cloned().into_iter().chain(others).collect();
            let found = from_reports(reports, &paths, (now, current), before, due);
            return Self {
                dive: found.dive.filter(|_| auv.dive.is_none()),
                ..found
            };
        };
        let mut state = *state;
        // A gyroscope never reads exactly 0, which stands for an omitted rate.
        if let (0.0, Some((earlier, reported))) = (state.turn_rate_radps, previous) {
            let between = now - state.age_s - reported;
            state.turn_rate_radps = remembered_turn_rate(&earlier.estimate, &state, between);
        }
        Self {
            state,
            rejected: Vec::new(),
            inflation: 0.0,
            velocity_contradicted: false,
            route: None,
            repeats: None,
            path: None,
            dive: None,
            track: Vec::new(),
        }
    }

    /// Root-mean-square distance between estimate and vehicle now, m, on a straight course since:
    /// √(tr P) of the position. `None` without a covariance.
    #[must_use]
    pub fn position_sigma(&self) -> Option<f64> {
        let state = &self.state;
        let now =
            Kalman::new(0.0, &state.position(), &state.velocity(), &state.covariance()?).at(state.age_s);
        Some(now.position_variance().max(0.0).sqrt())
    }
}

/// Filters `reports`, at least one, in order of time. The vehicle is on one of `paths`.
fn from_reports(
    reports: &[Report],
    paths: &[KnownPath],
    (now, current): (f64, &Vector2<f64>),
    before: Option<&[TrackPoint]>,
    due: &dyn Fn() -> bool,
) -> Estimate {
    // Reports older than any forecast count only if there are no others.
    let newest = reports
        .iter()
        .map(|report| report.t_s)
        .fold(f64::NEG_INFINITY, f64::max);
    let oldest = (now - FORECAST_AGE_MAX).min(newest);
    let mut numbered: Vec<_> = reports
        .iter()
        .enumerate()
        .filter(|(_, report)| oldest <= report.t_s)
        .map(|(number, report)| {
            // A report from the future counts as from now.
            let time = report.t_s.min(now);
            (number, Report { t_s: time, ..*report })
        })
        .collect();
    numbered.sort_by(|(_, a), (_, b)| in_order(a, b));
    if due() {
        numbered.drain(..numbered.len().saturating_sub(HASTY));
    }
    let ScreenedReports {
        reports: screened,
        track: free,
        inflation,
        velocity_contradicted,
    } = ScreenedReports::new(without_repeated(&numbered), due);
    let infers = before.is_some();
    let before = before.filter(|_| paths.is_empty());
    let past_track = before.map_or_else(PastTrack::default, |before| {
        PastTrack::new(before, &free.used, current)
    });
    let repeats = if due() { None } else { past_track.repeats() };
    let along = on_likeliest_path(paths, repeats.as_ref(), current, &screened, due);
    let route = along.as_ref().map(|along| Route {
        probability: match repeats {
            None => probability_of_following(&screened, along, &free, (usize::MAX, f64::INFINITY)),
            Some(_) => probability_of_following(&screened, along, &free, (TELLING, ODDS_MAX)),
        },
        fit: *along.filter.fit(),
        next_turn: match paths {
            [_] => along.filter.next_turn(),
            _ => along.filter.next_turn().map(NextTurn::of_any_radius),
        },
        current: along.filter.assumed().current,
    });
    let path = along.as_ref().map(|along| along.filter.assumed().known.clone());
    let followed = along.filter(|_| route.is_some_and(|route| route.is_followed()));
    let (filtered, used) = match &followed {
        Some(track) => (Filtered::from(&track.filter), &track.used),
        None => (Filtered::from(&free.filter.combined()), &free.used),
    };
    let through_water = (filtered.velocity - current).norm();
    Estimate {
        state: filtered.state(used, now),
        dive: infers.then(|| sawtooth(used, through_water)).flatten(),
        rejected: (0..reports.len())
            .filter(|number| used.iter().all(|(used, _)| used != number))
            .collect(),
        inflation,
        velocity_contradicted,
        route,
        repeats,
        path,
        track: past_track.points,
    }
}

/// The likeliest track through `reports` on one of `paths`, or on the pattern that its own track
/// `repeats`. Speeds may be over ground; without a fitting declared path the pace may vary.
fn on_likeliest_path<'a>(
    paths: &'a [KnownPath],
    repeats: Option<&'a Repeats>,
    current: &Vector2<f64>,
    reports: &[(usize, Report)],
    due: &dyn Fn() -> bool,
) -> Option<Track<OnPath<'a>>> {
    let through =
        |assumed: PathHypothesis<'a>| Track::through(reports, |report| OnPath::start(report, &assumed));
    let known = paths.iter().chain(repeats.map(|repeats| &repeats.path));
    let hypotheses = known.map(|known| PathHypothesis {
        known,
        current: *current,
        speed_density: SPEED_DENSITIES[0],
        roughness: repeats.map(|repeats| repeats.residual),
    });
    let mut best = hypotheses.take_while(|_| !due()).map(through).reduce(likelier)?;
    if !due() && repeats.is_none() && CURRENT_MIN <= current.norm() {
        let over_ground = PathHypothesis {
            current: Vector2::zeros(),
            ..*best.filter.assumed()
        };
        best = likelier(best, through(over_ground));
    }
    for speed_density in &SPEED_DENSITIES[1..] {
        if due() || (repeats.is_none() && !best.is_inconsistent()) {
            break;
        }
        let less_steady = PathHypothesis {
            speed_density: *speed_density,
            ..*best.filter.assumed()
        };
        best = likelier(best, through(less_steady));
    }
    Some(best)
}

/// The likelier of two tracks; the first of equals.
fn likelier<'a>(one: Track<OnPath<'a>>, other: Track<OnPath<'a>>) -> Track<OnPath<'a>> {
    if one.log_likelihood() < other.log_likelihood() {
        other
    } else {
        one
    }
}

/// Keeps the last of repeated messages, [`in_order`]: they are no second measurement.
fn without_repeated(numbered: &[(usize, Report)]) -> Vec<(usize, Report)> {
    let again = |first: &Report, later: &Report| {
        first.t_s == later.t_s && (first.position() - later.position()).norm() <= REPEATED_WITHIN
    };
    let is_last = |place: usize, report: &Report| {
        let later = numbered[place + 1..].iter();
        later
            .take_while(|(_, later)| later.t_s == report.t_s)
            .all(|(_, later)| !again(report, later))
    };
    let last = numbered
        .iter()
        .enumerate()
        .filter(|(place, (_, report))| is_last(*place, report));
    last.map(|(_, numbered)| *numbered).collect()
}

/// Probability that a vehicle follows its path as in `along`, after the `newest` of its `reports`,
/// in a two-state model with `free` motion. `odds_max` bounds a report's weight against the path.
fn probability_of_following(
    reports: &[(usize, Report)],
    along: &Track<OnPath<'_>>,
    free: &Track<Interacting>,
    (newest, odds_max): (usize, f64),
) -> f64 {
    let moves = match reports {
        // One fix has no information on motion.
        [(_, only)] if only.ground_track().is_none() => true,
        _ => SPEED_AT_REST <= free.filter.combined().velocity().norm(),
    };
    if !moves || !along.filter.is_on_path() {
        return 0.0;
    }
    let innovations = along.innovations.iter().zip(&free.innovations);
    let intervals = reports.iter().zip(&reports[1..]);
    let steps = intervals.map(|((_, from), (_, to))| to.t_s - from.t_s);
    let passed = along.innovations.len().saturating_sub(newest);
    steps
        .zip(innovations)
        .skip(passed)
        .fold(FOLLOWS_AT_FIRST, |follows, (elapsed, (along, free))| {
            let [leaves, returns] = [LEAVES_AFTER, RETURNS_AFTER].map(|after| -(-elapsed / after).exp_m1());
            let follows = follows * (1.0 - leaves) + (1.0 - follows) * returns;
            let ratio = (free.log_likelihood() - along.log_likelihood())
                .exp()
                .min(odds_max);
            follows / (follows + (1.0 - follows) * ratio)
        })
}

/// Order by all members, time first and north-dependent ones last: the given order has no effect.
pub(crate) fn in_order(a: &Report, b: &Report) -> Ordering {
    let numbers = |report: &Report| {
        let or_none = |value: Option<f64>| value.unwrap_or(f64::NEG_INFINITY);
        [
            report.t_s,
            report.sigma_m,
            or_none(report.depth_m),
            or_none(report.ground_track().map(|track| track.speed)),
            or_none(report.turn_rate_radps),
            or_none(report.ground_track().map(|track| track.course.radians())),
            report.position().x,
            report.position().y,
        ]
    };
    let pairs = numbers(a).into_iter().zip(numbers(b));
    pairs
        .map(|(a, b)| a.total_cmp(&b))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}

/// State of a filter after its last report.
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
    /// Time and rate of turn between the two newest courses, if neither report has a rate.
    fn turning(used: &[(usize, Report)]) -> Option<(f64, f64)> {
        let [.., (_, before), (_, after)] = used else {
            return None;
        };
        let [from, to] = [before.ground_track()?, after.ground_track()?].map(|track| track.velocity());
        let rate = turn_rate(&from, &to, after.t_s - before.t_s)?;
        Some((after.t_s, clear(rate)))
    }

    /// The state, with the newest depth and turn among the used reports.
    fn state(&self, used: &[(usize, Report)], now: f64) -> AuvState {
        let newest_first = || used.iter().rev().map(|(_, report)| report);
        let reported =
            newest_first().find_map(|report| report.turn_rate_radps.map(|rate| (report.t_s, rate)));
        let turning = reported.or_else(|| Self::turning(used));
        // Without any reported depth the vehicle is at the surface.
        let depth = newest_first().find_map(|report| report.depth_m).unwrap_or(0.0);
        let (course, speed) = (Course::of(&self.velocity), self.velocity.norm().min(SPEED_MAX));
        AuvState {
            turn_rate_radps: turning
                .filter(|(time, _)| now - time <= TURN_RATE_AGE_MAX)
                .map_or(0.0, |(_, rate)| rate),
            age_s: (now - self.time).max(0.0),
            covariance: Some(self.covariance.transpose().into()),
            ..AuvState::new(self.position, depth, course, speed)
        }
    }
}
