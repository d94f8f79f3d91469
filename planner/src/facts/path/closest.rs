//! The point of a path closest to a position, in closed form for each piece.

use std::ops::Range;

use nalgebra::Vector2;

use crate::facts::angle::direction;
use crate::facts::path::curve::{BLOCK, Path};
use crate::facts::path::limits::{GAP_MAX, KINK_MAX};
use crate::facts::path::piece::{PathPoint, Piece};

/// Most blocks of pieces that are searched for feet.
const BLOCKS_LOOKED_AT: usize = 64;

/// A point of a path and its cost; least is best.
#[derive(Clone, Copy)]
struct Foot {
    gamma: f64,
    cost: f64,
}

impl Foot {
    const NONE: Self = Self { gamma: 0.0, cost: f64::INFINITY };

    /// The better one, or the first of equals.
    fn or(self, other: Self) -> Self {
        if other.cost < self.cost { other } else { self }
    }
}

impl Path {
    /// Arc length of the point closest to `position` (north, east), m; the first of equals.
    ///
    /// Beyond an end of an open path: the arc length of the foot on the straight continuation.
    pub fn closest(&self, position: &Vector2<f64>) -> f64 {
        self.foot(position, self.closest_between(position, 0.0, self.length))
    }

    /// Arc length of the closest point within `reach` metres along the path of `gamma`, for paths
    /// that pass close to themselves. Includes the continuations of an open path; on a closed path
    /// the result does not wrap.
    pub fn closest_near(&self, position: &Vector2<f64>, gamma: f64, reach: f64) -> f64 {
        if self.closed {
            let reach = reach.min(0.5 * self.length);
            let (_, low) = self.lap_of(gamma - reach);
            let lap = gamma - reach - low;
            let over = (low + 2.0 * reach - self.length).max(0.0);
            let this = self.closest_between(position, low, low + 2.0 * reach - over);
            let next = self.closest_between(position, 0.0, over);
            let next = Foot { gamma: next.gamma + self.length, ..next };
            return lap + if over > 0.0 { this.or(next) } else { this }.gamma;
        }
        let (low, high) = (gamma - reach, gamma + reach);
        let straight = |low: f64, high: f64| {
            let point = self.at(low);
            let piece = Piece { from: low, ..Piece::line(point.position, point.tangent, high - low) };
            candidate(&piece, position)
        };
        let mut best = Foot::NONE;
        if low < 0.0 {
            best = best.or(straight(low, high.min(0.0)));
        }
        if low <= self.length && 0.0 <= high {
            best = best.or(self.closest_between(position, low.max(0.0), high.min(self.length)));
        }
        if self.length < high {
            best = best.or(straight(low.max(self.length), high));
        }
        best.gamma
    }

    /// Arc length of the point of least `cost` (of distance to `position`, m, and point) among the
    /// local minima of distance, at most one for each line or arc. No cost is less than its
    /// distance. Beyond the ends as [`Path::closest`].
    pub(crate) fn closest_by(&self, position: &Vector2<f64>, cost: impl Fn(f64, &PathPoint) -> f64) -> f64 {
        let candidate = |piece: &Piece| match self.foot_on(piece, position) {
            Some((gamma, distance, point)) => Foot { gamma, cost: cost(distance, &point) },
            None => Foot::NONE,
        };
        let best = self.least(0..self.pieces.len(), position, |cost| cost, candidate);
        if best.cost < f64::INFINITY { self.foot(position, best) } else { self.closest(position) }
    }

    /// Arc lengths of the `N` closest local minima of the distance to `position` within `reach`
    /// metres. Beyond the ends as [`Path::closest`]. If a path winds about the position, only its
    /// first few thousand pieces are searched.
    pub(crate) fn feet<const N: usize>(
        &self,
        position: &Vector2<f64>,
        reach: f64,
    ) -> impl Iterator<Item = f64> {
        let mut feet = [Foot::NONE; N];
        let blocks = self.boxes.iter().zip(self.pieces.chunks(BLOCK));
        let near = blocks.filter(|(block, _)| block.distance(position) <= reach);
        for piece in near.take(BLOCKS_LOOKED_AT).flat_map(|(_, pieces)| pieces) {
            let Some((gamma, cost, _)) = self.foot_on(piece, position) else {
                continue;
            };
            let gamma = self.foot(position, Foot { gamma, cost });
            let cost = (self.at(gamma).position - position).norm();
            let place = feet.partition_point(|foot| foot.cost <= cost);
            if cost <= reach && place < N {
                feet[place..].rotate_right(1);
                feet[place] = Foot { gamma, cost };
            }
        }
        let found = feet.into_iter().filter(|foot| foot.cost < f64::INFINITY);
        found.map(|foot| foot.gamma)
    }

    /// Arc length, distance and point of the local minimum on a piece, if it has one.
    fn foot_on(&self, piece: &Piece, position: &Vector2<f64>) -> Option<(f64, f64, PathPoint)> {
        let length = piece.closest(position);
        let point = piece.at(length);
        let miss = position - point.position;
        let along = miss.dot(&direction(point.tangent));
        let gamma = piece.from + length;
        let at_an_end = !self.closed && (gamma <= 0.0 || self.length <= gamma);
        // At a joint that is no foot, a neighbour is closer, up to the tolerance of joints.
        let is_foot = at_an_end || along.abs() <= GAP_MAX + KINK_MAX * miss.norm();
        is_foot.then(|| (gamma, miss.norm(), point))
    }

    /// The closest point between two arc lengths of the first lap.
    fn closest_between(&self, position: &Vector2<f64>, low: f64, high: f64) -> Foot {
        let first = self.pieces.partition_point(|piece| piece.end() < low);
        let after = self.pieces.partition_point(|piece| piece.from <= high);
        self.least(first..after, position, f64::sqrt, |piece| {
            let whole = low <= piece.from && piece.end() <= high;
            let part = || piece.cut(low.max(piece.from), high.min(piece.end()));
            candidate(&if whole { *piece } else { part() }, position)
        })
    }

    /// The first candidate of least cost in a range of pieces. Skips pieces farther away than the
    /// distance of the best cost: of thousands of way-points it evaluates tens.
    fn least(
        &self,
        range: Range<usize>,
        position: &Vector2<f64>,
        distance_of: impl Fn(f64) -> f64,
        candidate: impl Fn(&Piece) -> Foot,
    ) -> Foot {
        let Some(all) = self.pieces.get(range.clone()).filter(|all| !all.is_empty()) else {
            return Foot::NONE;
        };
        let mut best = Foot::NONE;
        if all.len() <= BLOCK {
            return all.iter().map(candidate).fold(best, Foot::or);
        }
        let blocks = range.start / BLOCK..range.end.div_ceil(BLOCK);
        let of_block =
            |block: usize| &self.pieces[range.start.max(block * BLOCK)..range.end.min((block + 1) * BLOCK)];
        // The nearest block bounds the cost before any other is looked at.
        let distances = blocks.clone().map(|block| (block, self.boxes[block].distance(position)));
        let nearest = distances.min_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut limit = nearest.map_or(f64::INFINITY, |(block, _)| {
            let costs = of_block(block).iter().map(|piece| candidate(piece).cost);
            costs.fold(f64::INFINITY, f64::min)
        });
        for block in blocks {
            if self.boxes[block].distance(position) <= distance_of(limit) + GAP_MAX {
                best = of_block(block).iter().map(&candidate).fold(best, Foot::or);
                limit = limit.min(best.cost);
            }
        }
        best
    }

    /// Extends an end of an open path to the foot on its continuation.
    fn foot(&self, position: &Vector2<f64>, candidate: Foot) -> f64 {
        let gamma = candidate.gamma;
        if self.closed {
            return gamma;
        }
        let along = |point: &PathPoint| (position - point.position).dot(&direction(point.tangent));
        if gamma <= 0.0 {
            let before = along(&self.start).min(0.0);
            if self.pieces.is_empty() { along(&self.start) } else { before }
        } else if self.length <= gamma {
            self.length + along(&self.end).max(0.0)
        } else {
            gamma
        }
    }
}

fn candidate(piece: &Piece, position: &Vector2<f64>) -> Foot {
    let length = piece.closest(position);
    Foot { gamma: piece.from + length, cost: (position - piece.at(length).position).norm_squared() }
}
