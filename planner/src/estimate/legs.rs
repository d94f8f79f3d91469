//! Tracks as straight legs of constant velocity.

use nalgebra::Vector2;

use crate::{facts::evidence::Report, tuned::EstimateNumbers};

/// A point of a track: time, s, position north and east, m.
pub(crate) type TrackPoint = [f64; 3];

pub(crate) fn place(point: &TrackPoint) -> Vector2<f64> {
    Vector2::new(point[1], point[2])
}

/// Weighted sums over some reports: of 1, t, t², p, t p, p².
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
    /// Adds a report at time `t`, s, and position `p`, m.
    fn and(mut self, t: f64, p: Vector2<f64>, sigma: f64) -> Self {
        let w = sigma.powi(-2);
        self.one += w;
        self.t += w * t;
        self.tt += w * t * t;
        self.p += p * w;
        self.tp += p * (w * t);
        self.pp += w * p.norm_squared();
        self
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

/// The ends of the legs of least price, each at constant velocity, through `reports`, at least one,
/// in order of time, for a `scatter` about them in standard deviations of a fix: optimal by dynamic
/// programming over the beginning of the last leg.
pub(crate) fn legs(
    reports: &[(usize, Report)],
    scatter: f64,
    tuned: &EstimateNumbers,
) -> Vec<[TrackPoint; 2]> {
    let start = reports[0].1;
    // For each number of reports: the least price, the beginning of the last leg, and its sums.
    let mut cheapest = vec![(0.0, 0, Sums::default())];
    for end in 1..=reports.len() {
        // Summed from the end: differences of sums would lose an inaccurate report.
        let last_legs = (0..end).rev().scan(Sums::default(), |sums, begin| {
            let report = &reports[begin].1;
            *sums = sums.and(
                report.t_s - start.t_s,
                report.position() - start.position(),
                scatter * report.sigma_m.max(tuned.fix_sigma_min),
            );
            Some((cheapest[begin].0 + tuned.leg_price + sums.residual(), begin, *sums))
        });
        let best = last_legs.min_by(|a, b| a.0.total_cmp(&b.0));
        cheapest.extend(best);
    }
    let mut legs = Vec::new();
    let mut end = reports.len();
    while end > 0 {
        let (_, begin, sums) = cheapest[end];
        let (time, position, velocity) = sums.line();
        let at = |report: &Report| {
            let place = start.position() + position + velocity * (report.t_s - start.t_s - time);
            [report.t_s, place.x, place.y]
        };
        legs.push([begin, end - 1].map(|place| at(&reports[place].1)));
        end = begin;
    }
    legs.reverse();
    legs
}

/// Least bend that is a turn, rad; fixes bend a straight leg by less.
const TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Distance over which a vehicle forgets its course, m, by its `track`.
///
/// ```text
/// ℓ = (ℓ₀ + Σ lᵢ) / (1 + Σ (1 − cos θᵢ))
/// ```
/// Turns by θ take a share 1 − cos θ of the mean direction; the legs between them are l long.
pub(crate) fn forgetting_length(track: &[TrackPoint], tuned: &EstimateNumbers) -> f64 {
    let legs = track.windows(2).map(|pair| place(&pair[1]) - place(&pair[0]));
    let legs: Vec<_> = legs.filter(|leg| 0.0 < leg.norm()).collect();
    let way: f64 = legs.iter().map(Vector2::norm).sum();
    let angles = legs.windows(2).map(|pair| pair[0].angle(&pair[1]));
    let turns: f64 = angles.filter(|angle| TURN < *angle).map(|angle| 1.0 - angle.cos()).sum();
    (tuned.forgets_after + way) / (1.0 + turns)
}

/// A vehicle's past track as a stationary process: it turns now and then, about a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PastWork {
    /// Mean time between its turns, s.
    pub(crate) between_turns: f64,
    /// Time in which it returns to its centre (north, east), m, if it works in an area.
    pub(crate) area: Option<(Vector2<f64>, f64)>,
}

/// Largest distance from the centre of an area inside of it, in standard deviations of a track.
const DEVIATIONS_INSIDE: f64 = 3.0;

/// Least number of returns to the centre of a track in an area.
const RETURNS_MIN: f64 = 3.0;

impl PastWork {
    /// The work along a `track` of a vehicle that is `here` now. One that has not turned yet does so
    /// `first_turn` seconds from now at the mean, and later the longer it went straight on.
    ///
    /// ```text
    /// T = max(τ, σ² / (v² τ))          D = v² τ diffuses a track of variance σ² = D T
    /// ```
    /// with the mean square velocity v² and the time τ between turns.
    pub(crate) fn of(track: &[TrackPoint], here: &Vector2<f64>, first_turn: f64) -> Self {
        let pairs =
            || track.windows(2).map(|pair| (pair[1][0] - pair[0][0], place(&pair[0]), place(&pair[1])));
        let steps: Vec<_> = pairs().map(|(_, from, to)| to - from).filter(|step| 0.0 < step.norm()).collect();
        let turned = |pair: &&[Vector2<f64>]| TURN < pair[0].angle(&pair[1]);
        let turns = steps.windows(2).filter(turned).count();
        let time = track.last().zip(track.first()).map_or(0.0, |(last, first)| last[0] - first[0]);
        if turns == 0 || time <= 0.0 {
            return Self { between_turns: first_turn + time.max(0.0), area: None };
        }
        let between_turns = time / turns as f64;
        let mean = |of: &dyn Fn(f64, Vector2<f64>, Vector2<f64>) -> f64| {
            pairs().map(|(time, from, to)| of(time, from, to)).sum::<f64>() / time
        };
        let centre = pairs().map(|(time, from, to)| (from + to) * (0.5 * time)).sum::<Vector2<f64>>() / time;
        let variance = mean(&|time, from, to| {
            let (from, to) = (from - centre, to - centre);
            time * (from.norm_squared() + from.dot(&to) + to.norm_squared()) / 3.0
        });
        // A pair of points without duration has no speed.
        let square_speed = mean(&|time, from, to| {
            if 0.0 < time { (to - from).norm_squared() / time } else { 0.0 }
        });
        let returns_in = (variance / (square_speed * between_turns)).max(between_turns);
        let is_inside = (here - centre).norm_squared() <= DEVIATIONS_INSIDE.powi(2) * variance;
        Self {
            between_turns,
            area: (is_inside && RETURNS_MIN * returns_in <= time).then_some((centre, returns_in)),
        }
    }
}

/// The fewest of `points` within `tolerance`, m, of all (Ramer, Douglas and Peucker).
pub(crate) fn simplified(points: &[TrackPoint], tolerance: f64) -> Vec<TrackPoint> {
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
            .map(|i| (off(&points[i]), i))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(off, _)| tolerance < *off);
        if let Some((_, i)) = farthest {
            kept[i] = true;
            pieces.extend([(from, i), (i, to)]);
        }
    }
    let kept = points.iter().zip(kept).filter(|(_, kept)| *kept);
    kept.map(|(point, _)| *point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions at 0.5 m/s from one to the next.
    fn track_through(places: &[[f64; 2]]) -> Vec<TrackPoint> {
        let mut track: Vec<TrackPoint> = Vec::new();
        for [north, east] in places {
            let before = track.last().copied().unwrap_or([0.0, *north, *east]);
            let way = (Vector2::new(*north, *east) - place(&before)).norm();
            track.push([before[0] + way / 0.5, *north, *east]);
        }
        track
    }

    /// Four lanes of 100 m, 20 m apart: six right angles on 460 m. A bad fix bends the first.
    const LANES: &[[f64; 2]] = &[
        [0.0, 0.0],
        [50.0, 4.0],
        [100.0, 0.0],
        [100.0, 20.0],
        [0.0, 20.0],
        [0.0, 40.0],
        [100.0, 40.0],
        [100.0, 60.0],
        [0.0, 60.0],
    ];

    #[test]
    fn sharp_bends_alone_are_turns() {
        let usual = EstimateNumbers::DEFAULT.forgets_after;
        let length =
            |places: &[[f64; 2]]| forgetting_length(&track_through(places), &EstimateNumbers::DEFAULT);
        assert!((length(&[]) - usual).abs() < 1e-12);
        // Bad fixes bend a transit by 10°.
        let transit = length(&[[0.0, 0.0], [250.0, 22.0], [500.0, 0.0]]);
        assert!((transit - 500.0 - usual).abs() < 3.0, "{transit}");
        let lanes = length(LANES);
        assert!((lanes - (460.0 + usual) / 7.0).abs() < 1.0, "{lanes}");
        let work = |track: &[TrackPoint]| PastWork::of(track, &Vector2::zeros(), 200.0);
        let lanes = track_through(LANES);
        let between = work(&lanes).between_turns;
        assert!((between - 920.0 / 6.0).abs() < 1.0, "{between}");
        // One that has not turned yet does so the later, the longer it went straight on.
        let straight = lanes[2][0] - lanes[0][0];
        let expected = [200.0 + straight, 200.0, 200.0];
        assert_eq!([&lanes[..3], &lanes[..1], &[]].map(|track| work(track).between_turns), expected);
    }
}
