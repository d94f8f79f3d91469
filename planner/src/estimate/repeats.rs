//! The path of a vehicle that declares none: its own track, and after it what repeats.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{Complex, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    evidence::{Report, SPEED_AT_REST},
    known_path::{DeclaredPath, KnownPath},
    path::{curve::Path, segment::Segment},
};

/// A place on a track: time, s, position north and east, m.
pub(crate) type TrackPoint = [f64; 3];

/// Most places of a track that are remembered, the newest: a lane of a lawn-mower and its turn need five or six.
pub(crate) const TRACK_POINTS_MAX: usize = 96;

/// Price of one more leg in a track, in squares of normalised residuals: its four numbers cost 4, and that it ends anywhere among
/// 64 reports the rest.
const LEG_PRICE: f64 = 14.0;

/// Places nearer to the line between their neighbours than this are not remembered, in standard deviations of a fix.
const STRAIGHT: f64 = 0.7;

/// Fewest places of a track that has turned.
const POINTS_MIN: usize = 4;

/// Distance between the places at which two pieces of a track are compared, in standard deviations of a fix, and most places.
const SPACING: f64 = 2.7;
const PLACES_MAX: u16 = 256;

/// A piece of track tells little unless its course changes by so much, rad: nearly a half turn. At 2.5, 5 of 200 tracks through random way-points repeated something, at 3.0 one at most.
const TURN_MIN: f64 = 3.0;

/// Largest root mean square distance between two pieces that are taken for the same, in standard deviations of a fix.
const RESIDUAL_MAX: f64 = 2.3;

/// The same as a share of the piece's radius of gyration: what is as small as its noise repeats anything.
const RESIDUAL_SHARE_MAX: f64 = 0.1;

/// How far ahead a path is continued, s: more than any plan looks.
const AHEAD: f64 = 180.0;

/// Points after which it is not continued any more.
const PATH_POINTS_MAX: usize = 512;

/// Fastest that a vehicle is carried, m/s: what moves faster between two places is not the same track.
const TRACK_SPEED_MAX: f64 = 15.0;

/// Silence after which a track begins anew, s.
const SILENCE_MAX: f64 = 1800.0;

/// What a vehicle's track repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Where it was, and where it goes if the track repeats once more.
    pub path: KnownPath,
    /// What it looks like.
    pub pattern: Pattern,
    /// How often it was sailed, as far as the track is remembered.
    pub times: f64,
    /// Length of what repeats, m.
    pub period: f64,
    /// Length of its longest leg, m.
    pub leg: f64,
    /// Distance between lanes, m; 0 where there are none.
    pub spacing: f64,
    /// Root mean square distance between one time and the next, m.
    pub residual: f64,
}

/// What a repeated track looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Lanes of a lawn-mower: each is the one before, mirrored and moved aside.
    Lanes,
    /// There and back on one line.
    ThereAndBack,
    /// A closed lap: a box, a racetrack, a circle.
    Laps,
    /// Something else that comes again elsewhere.
    Other,
}

/// Where a vehicle was, as straight legs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trail {
    pub(crate) points: Vec<TrackPoint>,
    /// Standard deviation of its fixes, m.
    sigma: f64,
    /// Its speed through the water where it moved, m/s.
    speed: f64,
    /// The fixes of the reports (north, east), m.
    fixes: Vec<Vector2<f64>>,
}

impl Trail {
    /// Through `reports`, in order of time, in a `current` (north, east), m/s, after what an earlier answer `remembered`.
    pub(crate) fn new(
        remembered: &[TrackPoint],
        reports: &[(usize, Report)],
        current: &Vector2<f64>,
    ) -> Self {
        let Some((_, first)) = reports.first() else {
            return Self::default();
        };
        let legs = legs(reports);
        let mut points = before(remembered, first);
        let (mut way, mut time) = (0.0, 0.0);
        for leg in &legs {
            points.push(leg.from);
            if leg.from[0] < leg.to[0] {
                points.push(leg.to);
                let elapsed = leg.to[0] - leg.from[0];
                let through_water = (place(&leg.to) - place(&leg.from)) / elapsed - current;
                if SPEED_AT_REST <= through_water.norm() {
                    way += through_water.norm() * elapsed;
                    time += elapsed;
                }
            }
        }
        let sigma = reports.iter().map(|(_, report)| report.sigma_m).sum::<f64>() / number(reports.len());
        let mut points = simplified(&points, STRAIGHT * sigma);
        points.drain(..points.len().saturating_sub(TRACK_POINTS_MAX));
        Self {
            points,
            sigma,
            speed: if time > 0.0 { way / time } else { 0.0 },
            fixes: reports.iter().map(|(_, report)| report.position()).collect(),
        }
    }

    /// What the track repeats, if it does: its newest piece, at least as long as the period, against the piece a period before, as it
    /// is or mirrored.
    pub(crate) fn repeats(&self) -> Option<Repeats> {
        if self.speed < SPEED_AT_REST || self.points.len() < POINTS_MIN {
            return None;
        }
        let found = TURN_RATES
            .iter()
            .filter_map(|rate| self.repeats_turning_at(self.speed / rate));
        found.min_by(|a, b| self.misfit(a).total_cmp(&self.misfit(b)))
    }

    /// Mean squared distance of the fixes from the path, m².
    fn misfit(&self, repeats: &Repeats) -> f64 {
        let path = &repeats.path.path;
        let off = |fix: &Vector2<f64>| (path.at(path.closest(fix)).position - fix).norm_squared();
        self.fixes.iter().map(off).sum::<f64>() / number(self.fixes.len())
    }

    /// The same for a vehicle that turns at a `radius`, m.
    fn repeats_turning_at(&self, radius: f64) -> Option<Repeats> {
        let track = Polyline::new(self.corners(radius));
        if track.points.len() < POINTS_MIN {
            return None;
        }
        let spacing = (SPACING * self.sigma).max(track.length() / (f64::from(PLACES_MAX) - 1.0));
        let places = track.places(spacing);
        let n = places.len();
        let turned = turned(&places);
        // The shortest piece that turns enough.
        let enough = turned.partition_point(|turned| *turned < TURN_MIN) * CHORD;
        // The shortest lag at which the track repeats, and its neighbours: twice as long a one repeats it too.
        let mut best: Option<Match> = None;
        for lag in 3..n / 2 {
            let span = lag.max(enough);
            if n < span + lag + 1 {
                continue;
            }
            let (earlier, later) = (&places[n - 1 - span - lag..n - lag], &places[n - 1 - span..]);
            let motions = [true, false].map(|mirrored| RigidMotion::between(earlier, later, mirrored));
            let same = motions.into_iter().filter(|motion| self.is_the_same(motion));
            let Some(motion) = same.min_by(|a, b| a.residual.total_cmp(&b.residual)) else {
                if best.is_some() {
                    break;
                }
                continue;
            };
            if best
                .as_ref()
                .is_none_or(|best| motion.residual < best.motion.residual)
            {
                best = Some(Match {
                    span,
                    lag: spacing * number(lag),
                    motion,
                });
            }
        }
        let best = self.refined(&track, &places, spacing, best?);
        let path = self.path(&track, &best, radius)?;
        let pattern = best.motion.pattern(RESIDUAL_MAX * self.sigma);
        Some(Repeats {
            path: KnownPath {
                path: Arc::new(path),
                horizontal_speed: self.speed,
            },
            pattern,
            times: (spacing * number(best.span) + best.lag) / best.lag,
            period: best.lag,
            leg: track.longest_leg(),
            spacing: if pattern == Pattern::Lanes {
                best.motion.glide()
            } else {
                0.0
            },
            residual: best.motion.residual,
        })
    }

    /// The corners of the track of a vehicle that turns at a `radius`, m, up to the end of its last long leg. Two fixes in a turn cut it
    /// by metres. What is known well are the legs, and when it was on them: a corner is where two legs meet, and a way back reaches as
    /// far as the time between its legs says.
    fn corners(&self, radius: f64) -> Vec<Complex<f64>> {
        let edges: Vec<_> = self.points.windows(2).map(Edge::new).collect();
        let longest = edges.iter().map(Edge::length).fold(0.0, f64::max);
        let enough = (LONG_SHARE * longest).max(LONG * self.sigma).max(4.0 * radius);
        let long: Vec<_> = (0..edges.len())
            .filter(|edge| enough <= edges[*edge].length())
            .collect();
        let [first, .., last] = long[..] else {
            return Vec::new();
        };
        let mut corners: Vec<_> = edges[..=first].iter().map(|edge| edge.from).collect();
        for pair in long.windows(2) {
            let (before, after) = (&edges[pair[0]], &edges[pair[1]]);
            let seen: Vec<_> = edges[pair[0] + 1..=pair[1]]
                .iter()
                .map(|edge| edge.from)
                .collect();
            let turned = before.turn(after, radius);
            let tolerance = radius + 3.0 * self.sigma;
            match turned.filter(|corners| before.can_turn(corners, after, &seen, tolerance)) {
                Some(turned) => corners.extend(turned),
                None => corners.extend([before.to].into_iter().chain(seen)),
            }
        }
        corners.push(edges[last].to);
        corners
    }

    fn is_the_same(&self, motion: &RigidMotion) -> bool {
        let most = (RESIDUAL_MAX * self.sigma).min(RESIDUAL_SHARE_MAX * motion.extent);
        motion.residual <= most
    }

    /// The same match at the lag that fits best between two places, over as much of the track as it holds for.
    fn refined(&self, track: &Polyline, places: &[Complex<f64>], spacing: f64, coarse: Match) -> Match {
        let mirrored = coarse.motion.mirrored;
        let at_lag = |lag: f64, span: usize| {
            let later = &places[places.len() - 1 - span..];
            let start = track.length() - lag - spacing * number(span);
            let earlier = (0..later.len()).map(|place| track.at(start + spacing * number(place)));
            let motion = RigidMotion::between(&earlier.collect::<Vec<_>>(), later, mirrored);
            (0.0 <= start && 0.0 < lag).then_some(Match { span, lag, motion })
        };
        let near = |best: &Match, span: usize| {
            let lags = (-7..=7_i8).map(|eighth| best.lag + spacing * f64::from(eighth) / 8.0);
            lags.filter_map(|lag| at_lag(lag, span))
                .min_by(|a, b| a.motion.residual.total_cmp(&b.motion.residual))
        };
        let mut best = near(&coarse, coarse.span).unwrap_or(coarse);
        let most = places.len() - 1;
        while best.span < most {
            let span = (best.span * 3 / 2 + 1).min(most);
            match near(&best, span).filter(|longer| self.is_the_same(&longer.motion)) {
                Some(longer) => best = longer,
                None => break,
            }
        }
        best
    }

    /// The track up to its last corner, and after it what repeats.
    fn path(&self, track: &Polyline, best: &Match, radius: f64) -> Option<Path> {
        let (_, known) = track.points.split_last()?;
        let mut points = known.to_vec();
        let last = track.along[known.len() - 1];
        // The corner that the last one repeats is the last one again.
        let start = last - best.lag + 0.5 * best.lag.min(radius + 3.0 * self.sigma);
        let mut period: Vec<_> = track
            .corners_after(start)
            .take_while(|(along, _)| *along <= last)
            .map(|(_, point)| point)
            .collect();
        let mut ahead = 0.0;
        while ahead < AHEAD * self.speed + 2.0 * best.lag && points.len() < PATH_POINTS_MAX {
            for point in &mut period {
                *point = best.motion.of(*point);
            }
            points.extend(&period);
            ahead += best.lag;
        }
        let points = points.iter().map(|point| [point.re, point.im]).collect();
        let segment = Segment::Waypoints {
            points,
            fillet_m: None,
            turn_radius_m: Some(radius),
        };
        DeclaredPath {
            segments: vec![segment],
            closed: false,
            speed_mps: self.speed,
        }
        .path()
        .ok()
    }
}

/// Rates of turn that a vehicle is looked for at, rad/s: what is declared without one turns at the first.
const TURN_RATES: [f64; 3] = [0.15, 0.09, 0.055];

/// A leg is long if it is so many standard deviations of a fix, and such a share of the longest.
const LONG: f64 = 8.0;
const LONG_SHARE: f64 = 0.2;

/// Beyond this a turn leads back, rad: its legs meet nowhere.
const BACK: f64 = 2.4;

/// A straight piece of a track.
struct Edge {
    from: Complex<f64>,
    to: Complex<f64>,
    start: f64,
    end: f64,
}

impl Edge {
    fn new(pair: &[TrackPoint]) -> Self {
        let point = |point: &TrackPoint| Complex::new(point[1], point[2]);
        Self {
            from: point(&pair[0]),
            to: point(&pair[1]),
            start: pair[0][0],
            end: pair[1][0],
        }
    }

    fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }

    fn direction(&self) -> Complex<f64> {
        (self.to - self.from) / self.length()
    }

    fn speed(&self) -> f64 {
        self.length() / (self.end - self.start).max(f64::MIN_POSITIVE)
    }

    /// The corners between it and the next leg, turned at a `radius`, m.
    fn turn(&self, next: &Self, radius: f64) -> Option<Vec<Complex<f64>>> {
        let (u, v) = (self.direction(), next.direction());
        let between = next.from - self.to;
        let sine = cross(u, v);
        if (v * u.conj()).arg().abs() < BACK {
            // Legs that hardly turn meet anywhere; the track itself is as good then.
            if sine.abs() < 0.2 {
                return None;
            }
            return Some(vec![self.to + u * (cross(between, v) / sine)]);
        }
        let back = (u - v) / (u - v).norm();
        let side = cross(back, between).signum() * Complex::i() * back;
        let width = dot(side, between).max(WIDTH_MIN);
        let radius = radius.min(0.5 * width);
        // From the ends of the legs to the line that both corners are on, at the legs' speeds, and along it at their mean, less
        // what both arcs cut.
        let (before, after) = (self.speed(), next.speed());
        let along = (width - (4.0 - PI) * radius) / (0.5 * (before + after));
        let ahead = dot(back, between);
        let reach = (next.start - self.end - along + ahead / after) / (1.0 / before + 1.0 / after);
        let first = self.to + u * (reach / dot(back, u));
        let second = next.from + v * ((reach - ahead) / dot(back, v));
        let apart = (second - first).norm();
        Some(vec![first, second + side * (WIDTH_MIN - apart).max(0.0)])
    }

    /// Whether a way to the `next` leg by `corners` is one that the vehicle can have gone: as long as its time allows, and by the
    /// places where it was `seen`.
    fn can_turn(&self, corners: &[Complex<f64>], next: &Self, seen: &[Complex<f64>], tolerance: f64) -> bool {
        let way: Vec<_> = [self.to]
            .iter()
            .chain(corners)
            .chain([&next.from])
            .copied()
            .collect();
        let length: f64 = way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        let usual = 0.5 * (self.speed() + next.speed()) * (next.start - self.end);
        (length - usual).abs() <= 0.35 * usual + 2.0 * tolerance
            && seen.iter().all(|place| {
                way.windows(2).any(|pair| {
                    let chord = pair[1] - pair[0];
                    let share = dot(chord, place - pair[0]) / chord.norm_sqr().max(f64::MIN_POSITIVE);
                    (place - pair[0] - chord * share.clamp(0.0, 1.0)).norm() <= tolerance
                })
            })
    }
}

/// Ways back that are closer than this are drawn so far apart, m: two corners at one place are none.
const WIDTH_MIN: f64 = 1.0;

fn cross(a: Complex<f64>, b: Complex<f64>) -> f64 {
    (a.conj() * b).im
}

fn dot(a: Complex<f64>, b: Complex<f64>) -> f64 {
    (a.conj() * b).re
}

/// A count of a few hundred.
fn number(count: usize) -> f64 {
    u32::try_from(count).map_or(f64::INFINITY, f64::from)
}

fn place(point: &TrackPoint) -> Vector2<f64> {
    Vector2::new(point[1], point[2])
}

/// What was remembered from before the `first` report; nothing if the two cannot be one track.
fn before(remembered: &[TrackPoint], first: &Report) -> Vec<TrackPoint> {
    let newest = remembered.len().saturating_sub(TRACK_POINTS_MAX);
    let mut points: Vec<_> = remembered[newest..]
        .iter()
        .copied()
        .take_while(|point| point[0] < first.t_s)
        .collect();
    points.push([first.t_s, first.north_m, first.east_m]);
    let is_one_track = points.windows(2).all(|pair| {
        let elapsed = pair[1][0] - pair[0][0];
        let moved = (place(&pair[1]) - place(&pair[0])).norm();
        // A place at which two legs meet may stand twice.
        (0.0..=SILENCE_MAX).contains(&elapsed) && moved <= TRACK_SPEED_MAX * elapsed.max(1.0)
    });
    points.pop();
    if is_one_track { points } else { Vec::new() }
}

/// A piece of a track at constant velocity.
struct Leg {
    from: TrackPoint,
    to: TrackPoint,
}

/// Sums over the first of some reports, with their weights: of 1, t, t², p, t p, p².
#[derive(Clone, Copy, Default)]
struct Sums {
    one: f64,
    t: f64,
    tt: f64,
    p: Vector2<f64>,
    tp: Vector2<f64>,
    pp: f64,
}

impl Sums {
    fn less(&self, other: &Self) -> Self {
        Self {
            one: self.one - other.one,
            t: self.t - other.t,
            tt: self.tt - other.tt,
            p: self.p - other.p,
            tp: self.tp - other.tp,
            pp: self.pp - other.pp,
        }
    }

    /// Mean time, mean position and velocity of the line of least squares.
    fn line(&self) -> (f64, Vector2<f64>, Vector2<f64>) {
        let (time, position) = (self.t / self.one, self.p / self.one);
        let spread = self.tt - self.t * time;
        let velocity = if spread > 1.0e-9 * self.one {
            (self.tp - position * self.t) / spread
        } else {
            Vector2::zeros()
        };
        (time, position, velocity)
    }

    /// Sum of the squares of the residuals of that line.
    fn residual(&self) -> f64 {
        let (_, position, velocity) = self.line();
        let along = (self.tp - position * self.t).dot(&velocity);
        (self.pp - self.p.dot(&position) - along).max(0.0)
    }
}

/// The legs through `reports`, at least one, in order of time, that explain them at the least price: optimal by dynamic programming over
/// where the last leg begins.
fn legs(reports: &[(usize, Report)]) -> Vec<Leg> {
    let start = reports[0].1;
    let mut sums = vec![Sums::default()];
    for (_, report) in reports {
        let (w, t) = (report.sigma_m.powi(-2), report.t_s - start.t_s);
        let p = report.position() - start.position();
        let before = sums[sums.len() - 1];
        sums.push(Sums {
            one: before.one + w,
            t: before.t + w * t,
            tt: before.tt + w * t * t,
            p: before.p + p * w,
            tp: before.tp + p * (w * t),
            pp: before.pp + w * p.norm_squared(),
        });
    }
    // Of the legs through the first reports: their price, and where the last of them begins.
    let mut cheapest = vec![(0.0, 0)];
    for end in 1..sums.len() {
        let price = |begin: usize| cheapest[begin].0 + LEG_PRICE + sums[end].less(&sums[begin]).residual();
        let best = (0..end)
            .map(|begin| (price(begin), begin))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        cheapest.extend(best);
    }
    let mut legs = Vec::new();
    let mut end = reports.len();
    while end > 0 {
        let begin = cheapest[end].1;
        let (time, position, velocity) = sums[end].less(&sums[begin]).line();
        let at = |report: &Report| {
            let place = start.position() + position + velocity * (report.t_s - start.t_s - time);
            [report.t_s, place.x, place.y]
        };
        legs.push(Leg {
            from: at(&reports[begin].1),
            to: at(&reports[end - 1].1),
        });
        end = begin;
    }
    legs.reverse();
    legs
}

/// The fewest of `points` that leave none farther than `tolerance`, m, from the line (Ramer, Douglas and Peucker).
fn simplified(points: &[TrackPoint], tolerance: f64) -> Vec<TrackPoint> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut pieces = vec![(0, last)];
    while let Some((from, to)) = pieces.pop() {
        let (start, end) = (place(&points[from]), place(&points[to]));
        let chord = end - start;
        let off = |point: &TrackPoint| {
            let share = (place(point) - start).dot(&chord) / chord.norm_squared().max(f64::MIN_POSITIVE);
            (place(point) - start - chord * share.clamp(0.0, 1.0)).norm()
        };
        let farthest = (from + 1..to)
            .map(|number| (off(&points[number]), number))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(off, _)| tolerance < *off);
        if let Some((_, number)) = farthest {
            kept[number] = true;
            pieces.extend([(from, number), (number, to)]);
        }
    }
    let kept = points.iter().zip(kept).filter(|(_, kept)| *kept);
    kept.map(|(point, _)| *point).collect()
}

/// Straight lines between points (north + i east), m.
struct Polyline {
    points: Vec<Complex<f64>>,
    /// Arc length at each, m.
    along: Vec<f64>,
}

impl Polyline {
    fn new(points: Vec<Complex<f64>>) -> Self {
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + (pair[1] - pair[0]).norm());
        }
        Self { points, along }
    }

    fn length(&self) -> f64 {
        self.along[self.along.len() - 1]
    }

    /// The point at an arc length, m.
    fn at(&self, along: f64) -> Complex<f64> {
        let after = self
            .along
            .partition_point(|other| *other <= along)
            .clamp(1, self.points.len() - 1);
        let (from, to) = (self.points[after - 1], self.points[after]);
        let length = (self.along[after] - self.along[after - 1]).max(f64::MIN_POSITIVE);
        from + (to - from) * ((along - self.along[after - 1]) / length).clamp(0.0, 1.0)
    }

    fn corners_after(&self, along: f64) -> impl Iterator<Item = (f64, Complex<f64>)> {
        let corners = self.along.iter().copied().zip(self.points.iter().copied());
        corners.filter(move |(at, _)| along < *at)
    }

    /// Length of its longest straight piece, m.
    fn longest_leg(&self) -> f64 {
        let legs = self.along.windows(2).map(|ends| ends[1] - ends[0]);
        legs.fold(0.0, f64::max)
    }

    /// Points a `spacing` apart, m, the last at the end.
    fn places(&self, spacing: f64) -> Vec<Complex<f64>> {
        let length = self.length();
        let mut places: Vec<_> = (0..PLACES_MAX)
            .map(|place| length - spacing * f64::from(place))
            .take_while(|along| 0.0 <= *along)
            .map(|along| self.at(along))
            .collect();
        places.reverse();
        places
    }
}

/// Places in a chord over which courses are compared: shorter ones are noise.
const CHORD: usize = 3;

/// By how much the course changes, rad, over the last chord and more and more chords before it.
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

/// A piece of a track that is like the one a lag before.
#[derive(Clone)]
struct Match {
    /// Places in it but one.
    span: usize,
    /// The lag, m.
    lag: f64,
    motion: RigidMotion,
}

/// A turn and a shift, after a reflection if it is mirrored.
#[derive(Clone)]
struct RigidMotion {
    mirrored: bool,
    turn: Complex<f64>,
    from: Complex<f64>,
    to: Complex<f64>,
    /// Root mean square distance that it leaves, m.
    residual: f64,
    /// Radius of gyration of what it moves, m.
    extent: f64,
}

impl RigidMotion {
    /// That which brings `earlier` closest to `later`, in the mean square: the turn is the phase of Σ ā b, of both about their means.
    fn between(earlier: &[Complex<f64>], later: &[Complex<f64>], mirrored: bool) -> Self {
        let n = number(later.len());
        let reflected = |point: &Complex<f64>| if mirrored { point.conj() } else { *point };
        let from = earlier.iter().map(reflected).sum::<Complex<f64>>() / n;
        let to = later.iter().sum::<Complex<f64>>() / n;
        let (mut product, mut squares, mut extent) = (Complex::new(0.0, 0.0), 0.0, 0.0);
        for (a, b) in earlier.iter().zip(later) {
            let (a, b) = (reflected(a) - from, b - to);
            product += a.conj() * b;
            squares += a.norm_sqr() + b.norm_sqr();
            extent += b.norm_sqr();
        }
        let size = product.norm();
        Self {
            mirrored,
            turn: if size > 0.0 {
                product / size
            } else {
                Complex::new(1.0, 0.0)
            },
            from,
            to,
            residual: ((squares - 2.0 * size) / n).max(0.0).sqrt(),
            extent: (extent / n).sqrt(),
        }
    }

    /// How far it moves along its axis, m, if it is mirrored.
    fn glide(&self) -> f64 {
        0.5 * (self.of(self.of(self.to)) - self.to).norm()
    }

    /// What is sailed so over and over, if places nearer than `same`, m, are one.
    fn pattern(&self, same: f64) -> Pattern {
        if self.mirrored {
            return if same < self.glide() {
                Pattern::Lanes
            } else {
                Pattern::ThereAndBack
            };
        }
        // A lap may be made of up to eight turned pieces that are alike.
        let laps = (1..=8).scan(self.to, |place, _| {
            *place = self.of(*place);
            Some(*place)
        });
        let closes = laps.enumerate().any(|(turns, place)| {
            let turn = self.turn.powf(number(turns + 1));
            (place - self.to).norm() < same && (turn - 1.0).norm() * self.extent < same
        });
        if closes { Pattern::Laps } else { Pattern::Other }
    }

    fn of(&self, point: Complex<f64>) -> Complex<f64> {
        let point = if self.mirrored { point.conj() } else { point };
        self.to + self.turn * (point - self.from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{estimate::tests::Random, facts::angle::direction};

    const SIGMA: f64 = 1.5;
    const SPEED: f64 = 0.9;

    /// Fixes every ten seconds of a vehicle that has gone along `path` for a `time`, s, and those of its last 640 s after the track that
    /// earlier answers left of the others.
    fn trail(path: &Path, time: f64, seed: u64) -> Trail {
        let mut random = Random(seed);
        let fix = |k: u32| {
            let t_s = 10.0 * f64::from(k);
            let place = path.at(SPEED * t_s).position + random.normal() * SIGMA;
            (0, Report::new(t_s, place, SIGMA))
        };
        let fixes: Vec<_> = (0..400)
            .map(fix)
            .filter(|(_, report)| report.t_s <= time)
            .collect();
        let mut trail = Trail::default();
        for end in (1..=fixes.len()).step_by(3).chain([fixes.len()]) {
            let window = &fixes[end.saturating_sub(64)..end];
            trail = Trail::new(&trail.points, window, &Vector2::zeros());
        }
        trail
    }

    fn lanes() -> Path {
        Path::lawn_mower(Vector2::new(7.0, -3.0), 0.4, 200.0, 30.0, 12)
    }

    /// Through way-points.
    fn through(points: Vec<[f64; 2]>) -> Path {
        let segments = vec![Segment::Waypoints {
            points,
            fillet_m: None,
            turn_radius_m: None,
        }];
        let declared = DeclaredPath {
            segments,
            closed: false,
            speed_mps: SPEED,
        };
        declared.path().expect("can be sailed")
    }

    /// How far a vehicle is, 60 s after a `time`, from where its repeated track leads, m.
    fn off(path: &Path, time: f64, repeats: &Repeats) -> f64 {
        let inferred = &repeats.path.path;
        let now = inferred.closest(&path.at(SPEED * time).position);
        let ahead = inferred.at(now + repeats.path.horizontal_speed * 60.0);
        (ahead.position - path.at(SPEED * (time + 60.0)).position).norm()
    }

    #[test]
    fn lanes_are_found_in_the_third_and_lead_round_the_next_turn() {
        let path = lanes();
        let (mut squares, mut n) = (0.0, 0.0);
        for seed in 0..10 {
            // The third lane begins after 552 s.
            assert_eq!(trail(&path, 400.0, seed).repeats(), None, "{seed}");
            for time in [700.0, 750.0, 1000.0, 1900.0] {
                let repeats = trail(&path, time, seed).repeats().expect("was sailed twice");
                assert_eq!(repeats.pattern, Pattern::Lanes);
                assert!((repeats.spacing - 30.0).abs() < 2.0, "{}", repeats.spacing);
                // From corner to corner: the half circles reach 15 m farther than the lanes.
                assert!((220.0 - repeats.leg).abs() < 20.0, "{}", repeats.leg);
                squares += off(&path, time, &repeats).powi(2);
                n += 1.0;
            }
        }
        let rms = f64::sqrt(squares / n);
        assert!(rms < 5.0, "{rms}");
    }

    #[test]
    fn laps_and_ways_there_and_back_are_found() {
        let corners = [[0.0, 0.0], [120.0, 0.0], [120.0, 80.0], [0.0, 80.0]];
        let ends = [[0.0, 0.0], [150.0, 20.0]];
        for path in [through(corners.repeat(5)), through(ends.repeat(8))] {
            let trail = trail(&path, 1100.0, 1);
            let repeats = trail.repeats().expect("was sailed twice");
            assert!(off(&path, 1100.0, &repeats) < 8.0);
        }
    }

    #[test]
    fn way_points_without_a_pattern_repeat_nothing() {
        let mut found = 0;
        for seed in 1000..1200 {
            let mut random = Random(100 + seed);
            let (mut place, mut course) = (Vector2::zeros(), 0.0);
            let point = |_| {
                course += 4.6 * (random.uniform() - 0.5);
                place += direction(course) * (40.0 + 180.0 * random.uniform());
                place.into()
            };
            let path = through((0..20).map(point).collect());
            found += u32::from(trail(&path, 1500.0, seed).repeats().is_some());
        }
        assert!(found <= 2, "{found}");
    }

    #[test]
    fn what_repeats_turns_and_moves_with_the_track() {
        let trail = trail(&lanes(), 900.0, 3);
        let turned = |point: &TrackPoint| {
            let (sin, cos) = f64::sin_cos(1.1);
            [
                point[0],
                500.0 + cos * point[1] - sin * point[2],
                sin * point[1] + cos * point[2],
            ]
        };
        let moved = Trail {
            points: trail.points.iter().map(turned).collect(),
            fixes: trail
                .fixes
                .iter()
                .map(|fix| place(&turned(&[0.0, fix.x, fix.y])))
                .collect(),
            ..trail.clone()
        };
        let [here, there] = [trail, moved].map(|trail| trail.repeats().expect("was sailed twice"));
        assert!((here.residual - there.residual).abs() < 1.0e-9);
        let end = |repeats: &Repeats| repeats.path.path.at(repeats.path.path.length()).position;
        let expected = turned(&[0.0, end(&here).x, end(&here).y]);
        assert!((end(&there) - place(&expected)).norm() < 1.0e-6);
    }

    #[test]
    fn a_remembered_track_that_is_none_is_left_out() {
        let fixes: Vec<_> = (0..20_u32)
            .map(|k| {
                (
                    0,
                    Report::new(
                        1.0e3 + 10.0 * f64::from(k),
                        Vector2::new(f64::from(k), 0.0),
                        SIGMA,
                    ),
                )
            })
            .collect();
        let new = |remembered: &[TrackPoint]| Trail::new(remembered, &fixes, &Vector2::zeros());
        let alone = new(&[]);
        for garbage in [
            [[990.0, 1.0e300, 0.0], [995.0, -1.0e300, 0.0]],
            [[995.0, 0.0, 0.0], [990.0, 0.0, 0.0]],
            [[-1.0e300, 0.0, 0.0], [990.0, 0.0, 0.0]],
            [[980.0, 0.0, 0.0], [990.0, 400.0, 0.0]],
        ] {
            assert_eq!(new(&garbage), alone);
        }
        assert!(new(&[[900.0, 0.0, -80.0], [950.0, 0.0, -40.0]]).points.len() > alone.points.len());
    }
}
