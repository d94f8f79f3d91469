//! Estimates of AUVs at their last report, from reports or a given state.

use std::cmp::Ordering;

use nalgebra::Vector2;

use crate::{
    estimate::{
        dive::sawtooth,
        gaussians::Gaussian,
        interacting::Interacting,
        kalman::Kalman,
        legs::{TrackPoint, forgetting_length},
        on_path::{NextTurn, OnPath, PathFit, PathHypothesis},
        past_states::{self, PastState, as_report, past_state},
        ranging::{Places, Ranged},
        repeats::{LOOSE_SCATTERS, PastTrack, Repeats},
        screening::{ScreenedReports, velocities_contradicted},
        steady_turn::SteadyTurn,
        track::{Innovation, Track},
        turn::{clear, remembered_turn_rate, turn_rate},
    },
    facts::{
        angle::Course,
        auv::{Auv, Dive},
        evidence::{AuvState, FORECAST_AGE_MAX, Report, SPEED_AT_REST},
        known_path::{DeclaredPath, KnownPath, OFFSET_FROM_PATH_MAX},
        previous_plan::{Ranging, RememberedTarget},
        ranges::AUV_SPEED_MAX,
    },
    tuned::EstimateNumbers,
};

/// Newest reports of a hasty estimate: enough for a velocity, with two outliers.
const HASTY: usize = 8;

/// Estimate of an AUV at its last report.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// State at the time of the newest used report; with a covariance if from reports.
    pub state: AuvState,
    /// Indices of unused reports, ascending: outliers, reports before a jump, and repetitions.
    pub rejected: Vec<usize>,
    /// Number of reports that were looked at: those of the last hour, for lack of time the newest.
    pub looked_at: usize,
    /// Standard deviation to add to the fixes, m; 0 if the reported accuracies are consistent.
    pub inflation: f64,
    /// `true` if the fixes contradict the reported courses and speeds, which are then unused.
    pub velocity_contradicted: bool,
    /// `true` if its state is where its past states cannot have led.
    pub jumped: bool,
    /// Two places at one of which it is, if its ranges do not tell which; the state is their mean.
    pub places: Option<Places>,
    /// Fit to its path. `None` without a path, and for a state that does not contradict it.
    pub route: Option<Route>,
    /// Pattern that its track repeats, if it declares no path.
    pub repeats: Option<Repeats>,
    /// Path compared with: the repeated track, or the declared path with the observed turns.
    pub path: Option<KnownPath>,
    /// Sawtooth in its reported depths.
    pub dive: Option<Dive>,
    /// Distance over which it forgets its course, m, off any path; `None` without reports.
    pub forgets_after: Option<f64>,
    /// Its past track, as the next request needs it.
    pub track: Vec<TrackPoint>,
    /// Its past states, as the next request needs them; empty if it is reported.
    pub states: Vec<PastState>,
    /// What its reports leave possible, as the next request needs it, if some are ranges.
    pub ranging: Option<Ranging>,
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
    pub fn is_followed(&self) -> bool {
        0.5 <= self.probability
    }

    /// `true` if a vehicle in `state` does not follow the declared `path` as it stands: it left it,
    /// sails back or at another speed, or the path lies elsewhere.
    fn contradicts(&self, state: &AuvState, path: &KnownPath, tuned: &EstimateNumbers) -> bool {
        let point = path.path.at(path.path.closest(&state.position()));
        let pace = tuned.path_speed_sigma.hypot(tuned.path_speed_share * path.speed_at(&point));
        !self.is_followed()
            || self.fit.sense < 0.0
            || PACES_MAX * pace < self.fit.faster().abs()
            || OFFSET_FROM_PATH_MAX < (point.position - state.position()).norm()
    }
}

/// Largest difference from the declared speed, in standard deviations of speeds along paths.
const PACES_MAX: f64 = 3.0;

/// Newest reports that test whether a vehicle still repeats its track, which older ones made.
const TELLING: usize = 3;

/// Newest states that are compared with each other and a repeated track, which older ones made.
const TELLING_STATES: usize = 12;

/// The same for a declared path: after a minute, a vehicle that came to its path is on it.
const TELLING_BESIDE_PATH: usize = 6;

/// Estimates AUVs at one moment.
pub(crate) struct Estimator<'a> {
    pub(crate) now: f64,
    pub(crate) current: Vector2<f64>,
    pub(crate) tuned: &'a EstimateNumbers,
    /// `true` once only the newest reports count, without a path.
    pub(crate) due: &'a dyn Fn() -> bool,
}

/// An AUV in the previous plan.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Before<'a> {
    /// All that is known of it, and the time of its report, s.
    pub(crate) target: Option<(RememberedTarget, f64)>,
    /// Its past track; `None` if tracks are not used.
    pub(crate) track: Option<&'a [TrackPoint]>,
    pub(crate) states: &'a [PastState],
    pub(crate) ranging: Option<&'a Ranging>,
}

impl Estimate {
    /// Root-mean-square distance between estimate and vehicle now, m: √(tr P), if there is a P.
    pub fn position_sigma(&self, tuned: &EstimateNumbers) -> Option<f64> {
        let state = &self.state;
        let reported = Kalman::new(0.0, &state.position(), &state.velocity(), &state.covariance()?);
        let now = reported.at(state.age_s, tuned);
        Some(now.position_variance().max(0.0).sqrt())
    }
}

impl<'a> Estimator<'a> {
    /// Estimates `auv`. A state without a rate of turn takes it from the previous plan. Given its
    /// track `before`, an AUV without a path or a dive may get them from its track and depths. What
    /// one given as a state repeats shows in its past states.
    pub(crate) fn estimate(&self, auv: &Auv, path: Option<&KnownPath>, before: Before<'_>) -> Estimate {
        let path = path.filter(|_| !(self.due)());
        if let Some(state) = &auv.state {
            return self.given(state, path, before);
        }
        let reports = auv.reports.as_deref().unwrap_or_default();
        let declared = auv.path.as_ref().filter(|_| path.is_some());
        let others = declared.map_or_else(Vec::new, DeclaredPath::with_other_turn_radii);
        // Without a sharp corner, the first of the others is the declared path itself.
        let own = path.filter(|own| others.first() != Some(own)).cloned();
        let paths: Vec<_> = others.into_iter().chain(own).collect();
        let found = if reports.iter().any(|report| report.range_m.is_some()) {
            self.ranged(reports, before.track.is_some(), before.ranging)
        } else {
            self.filtered(reports, &paths, before.track)
        };
        Estimate { dive: found.dive.filter(|_| auv.dive.is_none()), ..found }
    }

    /// The estimate of an AUV in a given `state`, believed for now; its past shows turns and route.
    fn given(
        &self,
        state: &AuvState,
        path: Option<&KnownPath>,
        Before { target, track: before, states, .. }: Before<'_>,
    ) -> Estimate {
        let mut state = *state;
        // A gyroscope never reads exactly 0, which stands for an omitted rate.
        if let (0.0, Some((earlier, reported))) = (state.turn_rate_radps, target) {
            let between = self.now - state.age_s - reported;
            state.turn_rate_radps = remembered_turn_rate(&earlier.estimate, &state, between, self.tuned);
        }
        let newest = past_state(&state, self.now, self.tuned);
        let past = past_states::before(states, newest[0]);
        let alone = Estimate {
            state,
            rejected: Vec::new(),
            looked_at: 0,
            inflation: 0.0,
            velocity_contradicted: false,
            jumped: false,
            places: None,
            route: None,
            repeats: None,
            path: None,
            dive: None,
            forgets_after: None,
            track: Vec::new(),
            states: past_states::kept(past, newest),
            ranging: None,
        };
        if (self.due)() {
            return alone;
        }
        let tuned = self.tuned;
        let states: Vec<_> = past.iter().chain([&newest]).map(as_report).enumerate().collect();
        let telling = if path.is_some() { TELLING_BESIDE_PATH } else { TELLING_STATES };
        let recent = &states[states.len().saturating_sub(telling)..];
        let free = Interacting::track(recent, tuned);
        let is_elsewhere = free.innovations.last().is_some_and(|newest| !newest.accepted);
        let alone = Estimate {
            velocity_contradicted: velocities_contradicted(recent, &free, tuned),
            jumped: is_elsewhere && past.last().is_some_and(|last| past_states::is_jump(last, &newest)),
            ..alone
        };
        let on = |along: &Track<OnPath<'_>>, telling: usize| Route {
            probability: probability_of_following(recent, along, &free, telling),
            fit: along.filter.fit().moved_to(&state.position(), along.filter.assumed().known),
            next_turn: along.filter.next_turn().map(|turn| turn.of_any_radius(tuned)),
            current: along.filter.assumed().current,
        };
        if let Some(path) = path {
            let along = self.on_likeliest_path(std::slice::from_ref(path), None, recent);
            let route = along.map(|along| on(&along, usize::MAX));
            let is_moving = SPEED_AT_REST <= state.speed_mps;
            // A state is forecast along the path as declared, if nothing contradicts that.
            return Estimate {
                route: route
                    .filter(|route| is_moving && !is_elsewhere && route.contradicts(&state, path, tuned)),
                ..alone
            };
        }
        let Some(before) = before.filter(|_| !past.is_empty()) else {
            return alone;
        };
        let used = Interacting::track(&states, tuned).used;
        // States are no fixes: the scatter about their legs is the vehicle's own.
        let past_track = PastTrack::new(before, &used, &self.current, 1.0, tuned);
        let repeats = (!is_elsewhere).then(|| past_track.repeats()).flatten();
        let along = self.on_likeliest_path(&[], repeats.as_ref(), recent);
        Estimate {
            route: along.map(|along| on(&along, TELLING)),
            path: repeats.as_ref().map(|repeats| repeats.path.clone()),
            repeats,
            track: past_track.points,
            ..alone
        }
    }

    /// Filters `reports`, at least one, in order of time. The vehicle is on one of `paths`.
    fn filtered(&self, reports: &[Report], paths: &[KnownPath], before: Option<&[TrackPoint]>) -> Estimate {
        let (tuned, due) = (self.tuned, self.due);
        let given = self.numbered(reports);
        let ScreenedReports { reports: screened, track: free, inflation, velocity_contradicted } =
            ScreenedReports::new(self.without_repeated(&given), tuned, due);
        let infers = before.is_some();
        let before = before.filter(|_| paths.is_empty());
        let past_track = |scatter: f64| {
            before.map_or_else(PastTrack::default, |before| {
                PastTrack::new(before, &free.used, &self.current, scatter, tuned)
            })
        };
        let exact = past_track(1.0);
        let repeats = (!due()).then(|| exact.repeats()).flatten();
        let loose = LOOSE_SCATTERS.into_iter().take_while(|_| !due());
        let repeats = repeats.or_else(|| loose.map(past_track).find_map(|track| track.repeats()));
        let along = self.on_likeliest_path(paths, repeats.as_ref(), &screened);
        let route = along.as_ref().map(|along| Route {
            probability: probability_of_following(
                &screened,
                along,
                &free,
                repeats.as_ref().map_or(usize::MAX, |_| TELLING),
            ),
            fit: along.filter.fit(),
            next_turn: match paths {
                [_] => along.filter.next_turn(),
                _ => along.filter.next_turn().map(|turn| turn.of_any_radius(tuned)),
            },
            current: along.filter.assumed().current,
        });
        let path = along.as_ref().map(|along| along.filter.assumed().known.clone());
        let followed = along.filter(|_| route.is_some_and(|route| route.is_followed()));
        let (filtered, used) = match &followed {
            Some(track) => (track.filter.free(), &track.used),
            None => (free.filter.combined(), &free.used),
        };
        let through_water = (filtered.velocity() - self.current).norm();
        let steady_turn =
            (followed.is_none() && !due()).then(|| SteadyTurn::newest(&free.used, tuned)).flatten();
        let state = self.state(&filtered, used);
        Estimate {
            state: steady_turn.map_or(state, |turn| turn.of(&state)),
            dive: infers.then(|| sawtooth(used, through_water, tuned)).flatten(),
            rejected: unused(&given, used),
            looked_at: given.len(),
            inflation,
            velocity_contradicted,
            jumped: false,
            places: None,
            route,
            repeats,
            path,
            forgets_after: Some(
                steady_turn.map_or_else(|| forgetting_length(&exact.points, tuned), |turn| turn.length()),
            ),
            track: exact.points,
            states: Vec::new(),
            ranging: None,
        }
    }

    /// The estimate from `reports` of which some are ranges, without a path.
    fn ranged(&self, reports: &[Report], infers: bool, before: Option<&Ranging>) -> Estimate {
        let (tuned, due) = (self.tuned, self.due);
        let given = self.numbered(reports);
        let numbered = self.without_repeated(&given);
        let newest = numbered.last().map_or(self.now, |(_, report)| report.t_s);
        let found = Ranged::new(&numbered, before, tuned, due);
        let (mean, covariance) = Gaussian::moments(found.gaussians.iter());
        let velocity = mean.fixed_rows::<2>(2).into_owned();
        let filtered = Kalman::new(newest, &mean.xy(), &velocity, &covariance);
        let through_water = (velocity - self.current).norm();
        let used: Vec<_> = numbered
            .iter()
            .filter(|(_, report)| !found.memory.refused.contains(&report.t_s))
            .copied()
            .collect();
        Estimate {
            state: AuvState { depth_m: found.depth, ..self.state(&filtered, &used) },
            rejected: unused(&given, &used),
            looked_at: given.len(),
            inflation: found.memory.inflation_m,
            velocity_contradicted: false,
            jumped: false,
            places: found.places(),
            route: None,
            repeats: None,
            path: None,
            dive: infers.then(|| sawtooth(&used, through_water, tuned)).flatten(),
            forgets_after: Some(tuned.forgets_after),
            track: Vec::new(),
            states: Vec::new(),
            ranging: Some(found.memory).filter(|_| !due()),
        }
    }

    /// The state that is `filtered`, with the newest depth and turn among the used reports.
    fn state(&self, filtered: &Kalman, used: &[(usize, Report)]) -> AuvState {
        let (now, tuned) = (self.now, self.tuned);
        let newest_first = || used.iter().rev().map(|(_, report)| report);
        let reported =
            newest_first().find_map(|report| report.turn_rate_radps.map(|rate| (report.t_s, rate)));
        let turning = reported.or_else(|| turning(used, tuned));
        // Without any reported depth the vehicle is at the surface.
        let depth = newest_first().find_map(|report| report.depth_m).unwrap_or(0.0);
        let velocity = filtered.velocity();
        let (course, speed) = (Course::of(&velocity), velocity.norm().min(AUV_SPEED_MAX));
        AuvState {
            turn_rate_radps: turning
                .filter(|(time, _)| now - time <= tuned.turn_rate_age_max)
                .map_or(0.0, |(_, rate)| rate),
            age_s: (now - filtered.time).max(0.0),
            covariance: Some(filtered.covariance.transpose().into()),
            ..AuvState::new(filtered.position(), depth, course, speed)
        }
    }

    /// The reports with their numbers, [`in_order`], without those older than any forecast.
    fn numbered(&self, reports: &[Report]) -> Vec<(usize, Report)> {
        let times = reports.iter().map(|report| report.t_s);
        let newest = times.fold(f64::NEG_INFINITY, f64::max);
        // Older reports count only if there are no others.
        let oldest = (self.now - FORECAST_AGE_MAX).min(newest);
        let used = reports.iter().enumerate();
        let used = used.filter(|(_, report)| oldest <= report.t_s);
        // A report from the future counts as from now.
        let until_now = |report: &Report| Report { t_s: report.t_s.min(self.now), ..*report };
        let mut numbered: Vec<_> = used.map(|(number, report)| (number, until_now(report))).collect();
        numbered.sort_by(|(_, a), (_, b)| in_order(a, b));
        if (self.due)() {
            numbered.drain(..numbered.len().saturating_sub(HASTY));
        }
        numbered
    }

    /// Keeps the last of repeated messages, [`in_order`]: they are no second measurement.
    fn without_repeated(&self, numbered: &[(usize, Report)]) -> Vec<(usize, Report)> {
        let again = |first: &Report, later: &Report| {
            let longer = later.range_m.unwrap_or_default() - first.range_m.unwrap_or_default();
            first.t_s == later.t_s
                && first.range_m.is_some() == later.range_m.is_some()
                && (first.position() - later.position()).norm() <= self.tuned.repeated_within
                && longer.abs() <= self.tuned.repeated_within
        };
        let is_last = |place: usize, report: &Report| {
            let later = numbered[place + 1..].iter();
            later.take_while(|(_, later)| later.t_s == report.t_s).all(|(_, later)| !again(report, later))
        };
        let last = numbered.iter().enumerate().filter(|(place, (_, report))| is_last(*place, report));
        last.map(|(_, numbered)| *numbered).collect()
    }

    /// The likeliest track through `reports` on one of `paths`, or on what its own track `repeats`.
    /// Speeds may be over ground, and the pace may vary without a fitting declared path.
    fn on_likeliest_path<'b>(
        &self,
        paths: &'b [KnownPath],
        repeats: Option<&'b Repeats>,
        reports: &[(usize, Report)],
    ) -> Option<Track<OnPath<'b>>>
    where
        'a: 'b,
    {
        let (tuned, due) = (self.tuned, self.due);
        let known = paths.iter().chain(repeats.map(|repeats| &repeats.path));
        let mut hypotheses = known.map(|known| PathHypothesis {
            known,
            current: self.current,
            speed_density: tuned.pace_density,
            roughness: repeats.map(|repeats| repeats.track.residual_m),
            tuned,
        });
        let first = hypotheses.next().filter(|_| !due())?;
        let first = Track::through(reports, |report| OnPath::start(report, &first));
        let likelier = |best: Track<OnPath<'b>>, assumed| likelier_on_path(best, &assumed, reports);
        let mut best = hypotheses.take_while(|_| !due()).fold(first, likelier);
        if !due() && repeats.is_none() && tuned.current_min <= self.current.norm() {
            let over_ground = PathHypothesis { current: Vector2::zeros(), ..*best.filter.assumed() };
            best = likelier(best, over_ground);
        }
        for speed_density in
            [tuned.pace_density_varied, tuned.pace_density_uneven, tuned.pace_density_erratic]
        {
            if due() || (repeats.is_none() && !best.is_inconsistent()) {
                break;
            }
            let less_steady = PathHypothesis { speed_density, ..*best.filter.assumed() };
            best = likelier(best, less_steady);
        }
        Some(best)
    }
}

/// Deficit of log-likelihood at which a track is given up: of two refused fixes. With 15, a vehicle
/// on random way-points is 6.2 instead of 5.8 m off after a minute.
const HOPELESS: f64 = 25.0;

/// The likelier of `best` and the track of `reports` on an `assumed` path; the first of equals.
fn likelier_on_path<'a>(
    best: Track<OnPath<'a>>,
    assumed: &PathHypothesis<'a>,
    reports: &[(usize, Report)],
) -> Track<OnPath<'a>> {
    let (mut best_so_far, mut ahead) = (best.log_likelihoods(), 0.0);
    let promising = |innovation: &Innovation| {
        ahead += innovation.log_likelihood(assumed.tuned) - best_so_far.next().unwrap_or(0.0);
        -HOPELESS < ahead
    };
    let other = Track::while_promising(reports, |report| OnPath::start(report, assumed), promising);
    drop(best_so_far);
    other.filter(|_| 0.0 < ahead).unwrap_or(best)
}

/// Probability that a vehicle follows its path as in `along`, after its `newest` reports.
fn probability_of_following(
    reports: &[(usize, Report)],
    along: &Track<OnPath<'_>>,
    free: &Track<Interacting<'_>>,
    newest: usize,
) -> f64 {
    let moves = match reports {
        // One fix has no information on motion.
        [(_, only)] if only.ground_track().is_none() => true,
        _ => SPEED_AT_REST <= free.filter.combined().velocity().norm(),
    };
    if !moves || !along.filter.is_on_path() {
        return 0.0;
    }
    let tuned = along.filter.assumed().tuned;
    let likelihoods = along.log_likelihoods().zip(free.log_likelihoods());
    let intervals = reports.iter().zip(&reports[1..]);
    let steps = intervals.map(|((_, from), (_, to))| to.t_s - from.t_s);
    let passed = along.innovations.len().saturating_sub(newest);
    steps.zip(likelihoods).skip(passed).fold(tuned.follows_at_first, |follows, (elapsed, (along, free))| {
        let [leaves, returns] =
            [tuned.leaves_after, tuned.returns_after].map(|after| -(-elapsed / after).exp_m1());
        let follows = follows * (1.0 - leaves) + (1.0 - follows) * returns;
        let ratio = (free - along).exp();
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
            or_none(report.range_m),
            or_none(report.depth_m),
            or_none(report.ground_track().map(|track| track.speed)),
            or_none(report.turn_rate_radps),
            or_none(report.ground_track().map(|track| track.course.radians())),
            report.position().x,
            report.position().y,
        ]
    };
    let pairs = numbers(a).into_iter().zip(numbers(b));
    pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// Indices of the `given` reports that are not among the `used` ones.
fn unused(given: &[(usize, Report)], used: &[(usize, Report)]) -> Vec<usize> {
    let given = given.iter().map(|(number, _)| *number);
    let mut unused: Vec<_> = given.filter(|number| used.iter().all(|(used, _)| used != number)).collect();
    unused.sort_unstable();
    unused
}

/// Time and rate of turn between the two newest courses, if neither report has a rate.
fn turning(used: &[(usize, Report)], tuned: &EstimateNumbers) -> Option<(f64, f64)> {
    let [.., (_, before), (_, after)] = used else {
        return None;
    };
    let [from, to] = [before.ground_track()?, after.ground_track()?].map(|track| track.velocity());
    let rate = turn_rate(&from, &to, after.t_s - before.t_s)?;
    Some((after.t_s, clear(rate, tuned)))
}
