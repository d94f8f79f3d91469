//! Corners of a track, at the intersections of its legs.

use std::f64::consts::PI;

use nalgebra::{Complex, Vector2};

use crate::{estimate::legs::TrackPoint, tuned::EstimateNumbers};

/// Most points at which a track is compared with itself.
pub(crate) const PLACES_MAX: u16 = 256;

/// A straight piece of a track.
pub(crate) struct TrackEdge {
    pub(crate) from: Complex<f64>,
    pub(crate) to: Complex<f64>,
    start: f64,
    end: f64,
}

impl TrackEdge {
    pub(crate) fn new(pair: &[TrackPoint]) -> Self {
        let point = |point: &TrackPoint| Complex::new(point[1], point[2]);
        Self { from: point(&pair[0]), to: point(&pair[1]), start: pair[0][0], end: pair[1][0] }
    }

    pub(crate) fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }

    fn direction(&self) -> Complex<f64> {
        (self.to - self.from) / self.length()
    }

    fn speed(&self) -> f64 {
        self.length() / (self.end - self.start).max(f64::MIN_POSITIVE)
    }

    pub(crate) fn speed_through(&self, current: &Vector2<f64>) -> f64 {
        let elapsed = (self.end - self.start).max(f64::MIN_POSITIVE);
        ((self.to - self.from) / elapsed - Complex::new(current.x, current.y)).norm()
    }

    /// Corners between this leg and the next for a turn `radius`, m.
    pub(crate) fn turn(
        &self,
        next: &Self,
        radius: f64,
        tuned: &EstimateNumbers,
    ) -> Option<Vec<Complex<f64>>> {
        let (u, v) = (self.direction(), next.direction());
        let between = next.from - self.to;
        let sine = cross(u, v);
        if (v * u.conj()).arg().abs() < tuned.reversal_min {
            // Almost parallel legs intersect anywhere; the track itself is then as good.
            if sine.abs() < tuned.bend_sine_min {
                return None;
            }
            return Some(vec![self.to + u * (cross(between, v) / sine)]);
        }
        let back = (u - v) / (u - v).norm();
        let side = cross(back, between).signum() * Complex::i() * back;
        let width = dot(side, between).max(WIDTH_MIN);
        let radius = radius.min(0.5 * width);
        // To the line of both corners at the legs' speeds, along it at their mean, less both arcs.
        let (before, after) = (self.speed(), next.speed());
        let along = (width - (4.0 - PI) * radius) / (0.5 * (before + after));
        let ahead = dot(back, between);
        let reach = (next.start - self.end - along + ahead / after) / (1.0 / before + 1.0 / after);
        let first = self.to + u * (reach / dot(back, u));
        let second = next.from + v * ((reach - ahead) / dot(back, v));
        let apart = (second - first).norm();
        Some(vec![first, second + side * (WIDTH_MIN - apart).max(0.0)])
    }

    /// `true` if it can have come to the `next` leg by `corners` in time, near where it was seen.
    pub(crate) fn can_turn(
        &self,
        corners: &[Complex<f64>],
        next: &Self,
        seen: &[Complex<f64>],
        (tolerance, tuned): (f64, &EstimateNumbers),
    ) -> bool {
        let way: Vec<_> = [self.to].iter().chain(corners).chain([&next.from]).copied().collect();
        let length: f64 = way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        let usual = 0.5 * (self.speed() + next.speed()) * (next.start - self.end);
        (length - usual).abs() <= tuned.turn_length_tolerance * usual + 2.0 * tolerance
            && seen.iter().all(|place| {
                way.windows(2).any(|pair| {
                    let chord = pair[1] - pair[0];
                    let share = dot(chord, place - pair[0]) / chord.norm_sqr().max(f64::MIN_POSITIVE);
                    (place - pair[0] - chord * share.clamp(0.0, 1.0)).norm() <= tolerance
                })
            })
    }
}

/// Least distance between the two corners of a reversal, m; coincident ones would be one half turn.
const WIDTH_MIN: f64 = 1.0;

fn cross(a: Complex<f64>, b: Complex<f64>) -> f64 {
    (a.conj() * b).im
}

fn dot(a: Complex<f64>, b: Complex<f64>) -> f64 {
    (a.conj() * b).re
}

/// A corner of a track (north + i east), m, and the speed before it, m/s, after a long leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrackCorner {
    pub(crate) point: Complex<f64>,
    pub(crate) speed: Option<f64>,
}

impl From<Complex<f64>> for TrackCorner {
    fn from(point: Complex<f64>) -> Self {
        Self { point, speed: None }
    }
}

/// Straight lines between corners.
pub(crate) struct Polyline {
    pub(crate) points: Vec<TrackCorner>,
    pub(crate) along: Vec<f64>,
}

impl Polyline {
    pub(crate) fn new(points: Vec<TrackCorner>) -> Self {
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + (pair[1].point - pair[0].point).norm());
        }
        Self { points, along }
    }

    pub(crate) fn length(&self) -> f64 {
        self.along[self.along.len() - 1]
    }

    pub(crate) fn at(&self, along: f64) -> Complex<f64> {
        let after = self.along.partition_point(|other| *other <= along).clamp(1, self.points.len() - 1);
        let [from, to] = [after - 1, after].map(|k| self.points[k].point);
        let length = (self.along[after] - self.along[after - 1]).max(f64::MIN_POSITIVE);
        from + (to - from) * ((along - self.along[after - 1]) / length).clamp(0.0, 1.0)
    }

    pub(crate) fn corners_after(&self, along: f64) -> impl Iterator<Item = (f64, TrackCorner)> {
        let corners = self.along.iter().copied().zip(self.points.iter().copied());
        corners.filter(move |(at, _)| along < *at)
    }

    /// Length of its longest straight piece that begins after an arc length, m.
    pub(crate) fn longest_leg_after(&self, along: f64) -> f64 {
        let legs = self.along.windows(2).filter(|ends| along <= ends[0]);
        legs.map(|ends| ends[1] - ends[0]).fold(0.0, f64::max)
    }

    /// Points `spacing` apart, m, the last at the end.
    pub(crate) fn places(&self, spacing: f64) -> Vec<Complex<f64>> {
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
