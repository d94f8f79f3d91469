//! The path of a vehicle that declares none: its past track, continued by the repeated pattern.

use std::sync::Arc;

use nalgebra::{Complex, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    estimate::{
        corners::{PLACES_MAX, Polyline, TrackCorner, TrackEdge},
        legs::{TrackPoint, legs, place, simplified},
        rigid_motion::{Pattern, RigidMotion},
    },
    facts::{
        evidence::{Report, SPEED_AT_REST},
        known_path::{DeclaredPath, KnownPath, TURN_RATES},
        path::{curve::Path, piece::Leg, segment::Segment},
    },
    tuned::EstimateNumbers,
};

/// Scatters of a weaving vehicle about the legs of its track, in standard deviations of a fix.
pub(crate) const LOOSE_SCATTERS: [f64; 2] = [1.6, 2.5];

/// Most points of a stored track, the newest ones; a lane with its turn needs five or six.
pub(crate) const TRACK_POINTS_MAX: usize = 96;

/// Fewest points of a track with a turn.
const POINTS_MIN: usize = 4;

/// Range of the lag's refinement, in distances between points, and as a share of the lag.
const REFINED_BY: f64 = 2.0;
const REFINED_SHARE: f64 = 0.2;

/// Time by which a path is continued, s; longer than any plan.
const AHEAD: f64 = 180.0;

/// Number of points that ends the continuation.
const PATH_POINTS_MAX: usize = 512;

/// Largest speed between two points of one track, m/s.
const TRACK_SPEED_MAX: f64 = 15.0;

/// Largest speed along a declared path, m/s.
const SPEED_MAX: f64 = 10.0;

/// Longest time on one leg, s: a day.
const LEG_TIME_MAX: f64 = 86_400.0;

/// Silence after which a track restarts, s.
const SILENCE_MAX: f64 = 1800.0;

/// Pattern that a vehicle's track repeats, and the path that it makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Past track, and its continuation by one more repetition.
    pub path: KnownPath,
    /// The pattern.
    pub track: RepeatedTrack,
    /// Probability that it goes on, by how much of the track it explains.
    pub trust: f64,
}

/// Pattern that an underwater vehicle's track repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RepeatedTrack {
    /// Kind of pattern.
    pub pattern: Pattern,
    /// Number of repetitions in the stored track, more than two.
    pub times: f64,
    /// Length of the pattern, m: of a lawn-mower's lane and turn, or of a lap.
    pub period_m: f64,
    /// Length of its longest leg from corner to corner, m.
    pub leg_m: f64,
    /// Distance between lanes, m; 0 without lanes.
    pub spacing_m: f64,
    /// Root-mean-square distance between repetitions, m.
    pub residual_m: f64,
}

/// Past track of a vehicle, as straight legs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PastTrack<'a> {
    tuned: &'a EstimateNumbers,
    pub(crate) points: Vec<TrackPoint>,
    /// Standard deviation of its fixes about its legs, m.
    sigma: f64,
    /// Its speed through the water in motion, m/s.
    speed: f64,
    current: Vector2<f64>,
    fixes: Vec<Vector2<f64>>,
}

impl<'a> PastTrack<'a> {
    /// Through `reports` after an earlier track, for a `scatter` about its legs in sigmas of a fix.
    pub(crate) fn new(
        remembered: &[TrackPoint],
        reports: &[(usize, Report)],
        current: &Vector2<f64>,
        scatter: f64,
        tuned: &'a EstimateNumbers,
    ) -> Self {
        let Some((_, first)) = reports.first() else {
            return Self::default();
        };
        let legs = legs(reports, scatter, tuned);
        let mut points = before(remembered, first);
        let (mut way, mut time) = (0.0, 0.0);
        for [from, to] in &legs {
            points.push(*from);
            if from[0] < to[0] {
                points.push(*to);
                let elapsed = to[0] - from[0];
                let through_water = (place(to) - place(from)) / elapsed - current;
                if SPEED_AT_REST <= through_water.norm() {
                    way += through_water.norm() * elapsed;
                    time += elapsed;
                }
            }
        }
        // The median: one inaccurate fix must not straighten the rest.
        let mut sigmas: Vec<_> = reports.iter().map(|(_, report)| report.sigma_m).collect();
        sigmas.sort_by(f64::total_cmp);
        let sigma = scatter * sigmas[sigmas.len() / 2].max(tuned.fix_sigma_min);
        let mut points = simplified(&points, tuned.track_tolerance * sigma);
        points.drain(..points.len().saturating_sub(TRACK_POINTS_MAX));
        Self {
            tuned,
            points,
            sigma,
            speed: if time > 0.0 { way / time } else { 0.0 },
            current: *current,
            fixes: reports.iter().map(|(_, report)| report.position()).collect(),
        }
    }

    /// The pattern that the track repeats, if any: compares the newest piece, at least a period
    /// long, with the piece a period before, as it is or mirrored.
    pub(crate) fn repeats(&self) -> Option<Repeats> {
        if !(SPEED_AT_REST..=SPEED_MAX).contains(&self.speed) || self.points.len() < POINTS_MIN {
            return None;
        }
        let found = TURN_RATES
            .iter()
            .filter_map(|rate| self.repeats_turning_at(self.speed / rate))
            .filter(|(_, repeats)| self.tuned.times_min <= repeats.track.times);
        let best = found.min_by(|(a, _), (b, _)| a.total_cmp(b));
        best.map(|(_, repeats)| repeats)
    }

    fn mean_square_distance(&self, path: &Path) -> f64 {
        let off = |fix: &Vector2<f64>| (path.at(path.closest(fix)).position - fix).norm_squared();
        self.fixes.iter().map(off).sum::<f64>() / self.fixes.len() as f64
    }

    /// Way-points with turns of `radius`, m, and the speeds of the legs that end at them.
    fn rounded(&self, corners: &[TrackCorner], radius: f64) -> Option<Path> {
        let leg = |corner: &TrackCorner| Leg {
            speed_mps: corner.speed.filter(|speed| (SPEED_AT_REST..=SPEED_MAX).contains(speed)),
            depth_m: None,
        };
        let segment = Segment::Waypoints {
            points: corners.iter().map(|corner| [corner.point.re, corner.point.im]).collect(),
            fillet_m: None,
            turn_radius_m: Some(radius),
            legs: corners.iter().skip(1).map(leg).collect(),
        };
        let declared = DeclaredPath { segments: vec![segment], closed: false, speed_mps: self.speed };
        declared.path().ok()
    }

    /// The pattern for turns of `radius`, m, and the mean squared distance of the fixes.
    fn repeats_turning_at(&self, radius: f64) -> Option<(f64, Repeats)> {
        let track = Polyline::new(self.corners(radius));
        if track.points.len() < POINTS_MIN {
            return None;
        }
        let spacing = (self.tuned.spacing * self.sigma).max(track.length() / (f64::from(PLACES_MAX) - 1.0));
        let places = track.places(spacing);
        let n = places.len();
        let turned = turned(&places);
        // The shortest piece that turns enough.
        let [enough, least] = [self.tuned.piece_turn_min, self.tuned.lag_turn_min]
            .map(|enough| turned.partition_point(|turned| *turned < enough) * CHORD);
        // The shortest lag with a match, and its neighbours; twice that lag fits as well.
        let mut best: Option<Match> = None;
        for lag in least..n / 2 {
            let span = lag.max(enough);
            if n < span + lag + 1 {
                continue;
            }
            let (earlier, later) = (&places[n - 1 - span - lag..n - lag], &places[n - 1 - span..]);
            let motions = [true, false].map(|mirrored| RigidMotion::between(earlier, later, mirrored));
            let same = motions.into_iter().filter(|motion| self.is_match(motion));
            let Some(motion) = same.min_by(|a, b| a.residual.total_cmp(&b.residual)) else {
                if best.is_some() {
                    break;
                }
                continue;
            };
            if best.as_ref().is_none_or(|best| motion.residual < best.motion.residual) {
                best = Some(Match { span, lag: spacing * lag as f64, motion });
            }
        }
        let best = self.refined(&track, &places, spacing, best?);
        let (mean_square, path) = self.path(&track, &best, radius)?;
        let pattern = best.motion.pattern(self.tuned.residual_max * self.sigma);
        let times = (spacing * best.span as f64 + best.lag) / best.lag;
        let since_first_corner = (track.length() - track.along[1]) / best.lag;
        let repeats = Repeats {
            trust: self.trust(times, since_first_corner),
            path: KnownPath { path: Arc::new(path), horizontal_speed: self.speed },
            track: RepeatedTrack {
                pattern,
                times,
                period_m: best.lag,
                leg_m: track.longest_leg_after(track.length() - 4.0 * best.lag),
                spacing_m: if pattern == Pattern::Lanes { best.motion.glide() } else { 0.0 },
                residual_m: best.motion.residual,
            },
        };
        Some((mean_square, repeats))
    }

    /// Probability that a pattern goes on which explains its last `times` repetitions, of a track
    /// that is `long` in such repetitions: Laplace's rule of succession. What it does not explain
    /// are turns that another such pattern mispredicted, but for one repetition in which it began.
    fn trust(&self, times: f64, long: f64) -> f64 {
        let (kept, broken) = (times - 1.0, (long - times - 1.0).max(0.0));
        let [kept, broken] = [kept + 1.0, broken + self.tuned.pattern_ends];
        kept / (kept + broken)
    }

    /// Corners of the track for turns of `radius`, m, to the end of the last long leg. Two fixes in
    /// a turn cut it by metres, while legs and their times are accurate: corners are intersections
    /// of legs, and the reach of a reversal follows from the time between its legs.
    fn corners(&self, radius: f64) -> Vec<TrackCorner> {
        let edges: Vec<_> = self.points.windows(2).map(TrackEdge::new).collect();
        // Only the newest legs count: a long transit may precede the lanes.
        let newest = &edges[edges.len().saturating_sub(NEWEST)..];
        let longest = newest.iter().map(TrackEdge::length).fold(0.0, f64::max);
        let enough =
            (self.tuned.long_leg_share * longest).max(self.tuned.long_leg * self.sigma).max(4.0 * radius);
        let long: Vec<_> = (0..edges.len()).filter(|edge| enough <= edges[*edge].length()).collect();
        let [first, .., last] = long[..] else {
            return Vec::new();
        };
        let mut corners: Vec<TrackCorner> = edges[..=first].iter().map(|edge| edge.from.into()).collect();
        for pair in long.windows(2) {
            let (before, after) = (&edges[pair[0]], &edges[pair[1]]);
            let seen: Vec<_> = edges[pair[0] + 1..=pair[1]].iter().map(|edge| edge.from).collect();
            let n = corners.len();
            let turned = before.turn(after, radius, self.tuned);
            let tolerance = (radius + 3.0 * self.sigma, self.tuned);
            match turned.filter(|corners| before.can_turn(corners, after, &seen, tolerance)) {
                Some(turned) => corners.extend(turned.into_iter().map(TrackCorner::from)),
                None => corners.extend(seen.into_iter().map(TrackCorner::from)),
            }
            corners[n].speed = Some(before.speed_through(&self.current));
        }
        corners.push(TrackCorner {
            point: edges[last].to,
            speed: Some(edges[last].speed_through(&self.current)),
        });
        corners
    }

    fn is_match(&self, motion: &RigidMotion) -> bool {
        let most = (self.tuned.residual_max * self.sigma).min(self.tuned.residual_share_max * motion.extent);
        motion.residual <= most
    }

    /// The match at the best lag between two points, over the longest piece for which it holds.
    fn refined(&self, track: &Polyline, places: &[Complex<f64>], spacing: f64, coarse: Match) -> Match {
        let (mirrored, lag) = (coarse.motion.mirrored, coarse.lag);
        let most = (REFINED_BY * spacing).min(REFINED_SHARE * lag);
        let at_lag = |lag: f64, span: usize| {
            let later = &places[places.len() - 1 - span..];
            let start = track.length() - lag - spacing * span as f64;
            let earlier = (0..later.len()).map(|place| track.at(start + spacing * place as f64));
            let motion = RigidMotion::between(&earlier.collect::<Vec<_>>(), later, mirrored);
            (0.0 <= start).then_some(Match { span, lag, motion })
        };
        let near = |best: &Match, span: usize| {
            let lags = (-7..=7_i8).map(|eighth| best.lag + spacing * f64::from(eighth) / 8.0);
            lags.filter(|near| (near - lag).abs() <= most)
                .filter_map(|lag| at_lag(lag, span))
                .min_by(|a, b| a.motion.residual.total_cmp(&b.motion.residual))
        };
        let mut best = near(&coarse, coarse.span).unwrap_or(coarse);
        let fits = |span: &usize| best.lag + spacing * *span as f64 <= track.length();
        let longest = (best.span..places.len()).rev().find(fits).unwrap_or(best.span);
        while best.span < longest {
            let span = (best.span * 3 / 2 + 1).min(longest);
            match near(&best, span).filter(|longer| self.is_match(&longer.motion)) {
                Some(longer) => best = longer,
                None => break,
            }
        }
        best
    }

    /// The track to its last corner, continued by the pattern; and the fixes' mean square off.
    fn path(&self, track: &Polyline, best: &Match, radius: f64) -> Option<(f64, Path)> {
        let (_, known) = track.points.split_last()?;
        let mut points = known.to_vec();
        let last = track.along[known.len() - 1];
        // The corner that the last one repeats is the last one itself.
        let start = last - best.lag + 0.5 * best.lag.min(radius + 3.0 * self.sigma);
        let mut period: Vec<_> = track
            .corners_after(start)
            .take_while(|(along, _)| *along <= last)
            .map(|(_, corner)| corner)
            .collect();
        if period.is_empty() {
            return None;
        }
        let mut repeat = || {
            for corner in &mut period {
                corner.point = best.motion.of(corner.point);
            }
            period.clone()
        };
        points.extend(repeat());
        let mean_square = self.mean_square_distance(&self.rounded(&points, radius)?);
        // Continues by the past length too: on a lap the vehicle may be placed one lap ahead.
        let mut ahead = best.lag;
        while ahead < AHEAD * self.speed + 2.0 * best.lag + track.length() && points.len() < PATH_POINTS_MAX {
            points.extend(repeat());
            ahead += best.lag;
        }
        Some((mean_square, self.rounded(&points, radius)?))
    }
}

/// Number of newest legs that define a long one.
const NEWEST: usize = 24;

/// The stored track before the `first` report; empty if the two cannot be one track.
fn before(remembered: &[TrackPoint], first: &Report) -> Vec<TrackPoint> {
    let newest = &remembered[remembered.len().saturating_sub(TRACK_POINTS_MAX)..];
    let is_silent = newest.last().is_none_or(|last| SILENCE_MAX < first.t_s - last[0]);
    let earlier = newest.iter().copied().take_while(|point| point[0] < first.t_s);
    let begin = [first.t_s, first.position().x, first.position().y];
    let mut points: Vec<_> = earlier.chain([begin]).collect();
    let is_one_track = points.windows(2).all(|pair| {
        let elapsed = pair[1][0] - pair[0][0];
        let moved = (place(&pair[1]) - place(&pair[0])).norm();
        // A corner of two legs may occur twice.
        (0.0..=LEG_TIME_MAX).contains(&elapsed) && moved <= TRACK_SPEED_MAX * elapsed + 6.0 * first.sigma_m
    });
    points.pop();
    if is_one_track && !is_silent { points } else { Vec::new() }
}

/// Points in a chord for the comparison of courses; shorter chords are noise.
const CHORD: usize = 3;

/// Change of course, rad, over the last chord and increasing numbers of earlier ones.
fn turned(places: &[Complex<f64>]) -> Vec<f64> {
    let chords: Vec<_> = places
        .rchunks(CHORD)
        .zip(places.rchunks(CHORD).skip(1))
        .map(|(later, earlier)| later[later.len() - 1] - earlier[earlier.len() - 1])
        .collect();
    let mut sum = 0.0;
    let mut turned = vec![0.0, 0.0];
    for pair in chords.windows(2) {
        sum += (pair[0] * pair[1].conj()).arg().abs();
        turned.push(sum);
    }
    turned
}

/// A piece of a track that matches the one a lag before.
#[derive(Clone)]
struct Match {
    /// Number of its points minus one.
    span: usize,
    lag: f64,
    motion: RigidMotion,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{estimate::tests::Random, tests::prelude::*};

    const SIGMA: f64 = 1.5;
    const SPEED: f64 = 0.9;
    const TUNED: &EstimateNumbers = &EstimateNumbers::DEFAULT;

    /// Past track of a vehicle that followed `path` for a `time`, s: fixes every ten seconds, of
    /// which those before the last 640 s are in the stored track of earlier answers.
    fn past_track(path: &Path, time: f64, seed: u64) -> PastTrack<'static> {
        let mut random = Random(seed);
        let fix = |t_s: f64| {
            let place = path.at(SPEED * t_s).position + random.normal() * SIGMA;
            (0, Report::new(t_s, place, SIGMA))
        };
        let times = (0..400).map(|k| 10.0 * f64::from(k));
        let fixes: Vec<_> = times.take_while(|t_s| *t_s <= time).map(fix).collect();
        let mut past_track = PastTrack::default();
        for end in (1..=fixes.len()).step_by(3).chain([fixes.len()]) {
            let window = &fixes[end.saturating_sub(64)..end];
            past_track = PastTrack::new(&past_track.points, window, &Vector2::zeros(), 1.0, TUNED);
        }
        past_track
    }

    fn lanes() -> Path {
        Path::lawn_mower(Vector2::new(7.0, -3.0), 0.4, 200.0, 30.0, 12)
    }

    fn through(points: Vec<[f64; 2]>) -> Path {
        declared_through(points, None, SPEED).path().expect("is a path")
    }

    /// Distance, 60 s after a `time`, of a vehicle from the continuation of its track, m.
    fn off(path: &Path, time: f64, repeats: &Repeats) -> f64 {
        let inferred = &repeats.path.path;
        let now = inferred.closest_near(&path.at(SPEED * time).position, SPEED * time, 60.0);
        let ahead = inferred.at(now + repeats.path.horizontal_speed * 60.0);
        (ahead.position - path.at(SPEED * (time + 60.0)).position).norm()
    }

    #[test]
    fn lanes_are_found_in_the_third_and_predict_the_next_turn() {
        let path = lanes();
        let mut squares = 0.0;
        for seed in 0..10 {
            // The third lane begins after 552 s.
            assert_eq!(past_track(&path, 400.0, seed).repeats(), None, "{seed}");
            for time in [700.0, 750.0, 1000.0, 1900.0] {
                let repeats = past_track(&path, time, seed).repeats().expect("repeats");
                assert_eq!(repeats.track.pattern, Pattern::Lanes);
                near(repeats.track.spacing_m, 30.0, 2.0);
                // From corner to corner: the half circles extend the lanes by 15 m.
                near(repeats.track.leg_m, 220.0, 20.0);
                squares += off(&path, time, &repeats).powi(2);
            }
        }
        let rms = f64::sqrt(squares / 40.0);
        assert!(rms < 5.0, "{rms}");
    }

    #[test]
    fn laps_and_returns_are_found() {
        let corners = [[0.0, 0.0], [120.0, 0.0], [120.0, 80.0], [0.0, 80.0]];
        let ends = [[0.0, 0.0], [150.0, 20.0]];
        for path in [through(corners.repeat(5)), through(ends.repeat(8))] {
            let past_track = past_track(&path, 1100.0, 1);
            let repeats = past_track.repeats().expect("repeats");
            assert_eq!(repeats.track.pattern, Pattern::Laps);
            assert!(off(&path, 1100.0, &repeats) < 8.0);
        }
    }

    #[test]
    fn a_pattern_whose_earlier_turns_were_elsewhere_is_trusted_less() {
        // Two lanes of each length: whatever they repeat ends after them.
        let lengths = [150.0, 90.0, 200.0, 120.0, 170.0];
        let pair = |(k, length): (u32, f64)| {
            let east = 60.0 * f64::from(k);
            [[0.0, east], [length, east], [length, east + 30.0], [0.0, east + 30.0]]
        };
        let unequal = through((0..).zip(lengths).flat_map(pair).collect());
        // Shortly after the second turn of the fourth pair.
        let trust = |path: &Path| past_track(path, 1290.0, 2).repeats().map(|repeats| repeats.trust);
        let [kept, broken] = [lanes(), unequal].map(|path| trust(&path).expect("repeats"));
        assert!(0.8 < kept && broken < 0.7, "{kept} and {broken}");
    }

    #[test]
    fn way_points_without_a_pattern_have_no_repeats() {
        let repeats = |seed: &u64| {
            let mut random = Random(100 + seed);
            let (mut place, mut course) = (Vector2::zeros(), 0.0);
            let point = |_| {
                course += 4.6 * (random.uniform() - 0.5);
                place += direction(course) * (40.0 + 180.0 * random.uniform());
                place.into()
            };
            let path = through((0..20).map(point).collect());
            past_track(&path, 1500.0, *seed).repeats().is_some()
        };
        let found = (1000..1200).filter(repeats).count();
        assert!(found <= 2, "{found}");
    }

    #[test]
    fn lines_and_wide_curves_have_no_repeats() {
        // Each piece matches the previous one at any lag.
        for (seed, radius) in (0..60).zip([200.0, 400.0, 1.0e4].into_iter().cycle()) {
            let point = |k: u32| {
                let angle = 60.0 * f64::from(k) / radius;
                [radius * angle.sin(), radius * (1.0 - angle.cos())]
            };
            let past_track = past_track(&through((0..30).map(point).collect()), 1500.0, seed);
            let lag = past_track.repeats().map(|repeats| repeats.track.period_m);
            assert!(lag.is_none_or(|lag| lag > 100.0), "{seed}: {lag:?}");
        }
    }

    #[test]
    fn a_pattern_rotates_and_moves_with_the_track() {
        let past_track = past_track(&lanes(), 900.0, 3);
        let moved = |place: &Vector2<f64>| ned_from_body(1.1) * place + Vector2::new(500.0, 0.0);
        let point = |point: &TrackPoint| {
            let [north, east] = moved(&place(point)).into();
            [point[0], north, east]
        };
        let elsewhere = PastTrack {
            points: past_track.points.iter().map(point).collect(),
            fixes: past_track.fixes.iter().map(moved).collect(),
            ..past_track.clone()
        };
        let [here, there] = [past_track, elsewhere].map(|track| track.repeats().expect("repeats"));
        near(here.track.residual_m, there.track.residual_m, 1.0e-9);
        let [here, there] = [here, there].map(|repeats| repeats.path.path);
        let end = |path: &Path| path.at(path.length()).position;
        near_to(end(&there), moved(&end(&here)), 1.0e-6);
    }

    #[test]
    fn a_fix_of_negligible_weight_keeps_all_points_finite() {
        let fix = |k: u32| {
            let (north, sigma) = if k < 5 { (0.0, 1.0e-3) } else { (3.0e5, 1.0e5) };
            (0, Report::new(10.0 * f64::from(k), Vector2::new(north, 0.0), sigma))
        };
        let fixes: Vec<_> = (0..8).map(fix).collect();
        let past_track = PastTrack::new(&[], &fixes, &Vector2::zeros(), 1.0, TUNED);
        let mut numbers = past_track.points.iter().flatten();
        assert!(numbers.all(|number| number.is_finite()));
    }

    /// Fixes every ten seconds from `begin`, s, on, due north at `speed`.
    fn northward(begin: f64, speed: f64) -> Vec<(usize, Report)> {
        let fix = |k: u32| {
            let t_s = begin + 10.0 * f64::from(k);
            (0, Report::new(t_s, Vector2::new(speed * t_s, 0.0), SIGMA))
        };
        (0..20).map(fix).collect()
    }

    #[test]
    fn a_long_leg_and_the_track_before_it_are_one_track() {
        // Half an hour on one leg leaves no corner among the reports.
        let remembered = [[0.0, 0.0, 50.0], [50.0, 0.0, 0.0], [3.99e3, 3.99e3, 0.0]];
        let past_track = PastTrack::new(&remembered, &northward(4.0e3, 1.0), &Vector2::zeros(), 1.0, TUNED);
        assert_eq!(past_track.points[..2], remembered[..2]);
    }

    #[test]
    fn an_impossible_stored_track_is_dropped() {
        let fixes = northward(1.0e3, 0.1);
        let new =
            |remembered: &[TrackPoint]| PastTrack::new(remembered, &fixes, &Vector2::zeros(), 1.0, TUNED);
        let alone = new(&[]);
        for garbage in [
            [[990.0, 1.0e300, 0.0], [995.0, -1.0e300, 0.0]],
            [[995.0, 100.0, 0.0], [990.0, 100.0, 0.0]],
            [[-1.0e300, 100.0, 0.0], [990.0, 100.0, 0.0]],
            [[980.0, 100.0, 0.0], [990.0, 500.0, 0.0]],
        ] {
            assert_eq!(new(&garbage), alone);
        }
        let possible = new(&[[900.0, 100.0, -80.0], [950.0, 100.0, -40.0]]);
        assert!(possible.points.len() > alone.points.len());
    }
}
