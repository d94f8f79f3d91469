//! The point of a path that is closest to a position, in closed form piece by piece.

use std::ops::Range;

use nalgebra::Vector2;

use crate::facts::{
    angle::direction,
    path::{
        curve::{BLOCK, Path},
        limits::{GAP_MAX, KINK_MAX},
        piece::{PathPoint, Piece},
    },
};

/// Most blocks of pieces that are searched for feet.
const BLOCKS_LOOKED_AT: usize = 64;

/// A point of a path and how good it is: the less the cost, the better.
#[derive(Clone, Copy)]
struct Candidate {
    gamma: f64,
    cost: f64,
}

impl Candidate {
    const NONE: Self = Self {
        gamma: 0.0,
        cost: f64::INFINITY,
    };

    /// Keeps the first of equals.
    fn or(self, other: Self) -> Self {
        if other.cost < self.cost { other } else { self }
    }
}

impl Path {
    /// Arc length of the point closest to `position` (north, east), m. Of equally close points, the first.
    ///
    /// Where that is an end of an open path with the position beyond it, the arc length is that of the
    /// position's foot on the path's straight continuation.
    #[must_use]
    pub fn closest(&self, position: &Vector2<f64>) -> f64 {
        self.foot(position, self.closest_between(position, 0.0, self.length))
    }

    /// Arc length of the closest point not farther than `reach` metres along the path from `gamma`: a path may
    /// pass close to itself. Beyond the ends of an open path it looks on their straight continuations; on a
    /// closed one the answer goes on past the seam and does not wrap.
    #[must_use]
    pub fn closest_near(&self, position: &Vector2<f64>, gamma: f64, reach: f64) -> f64 {
        if self.closed {
            let reach = reach.min(0.5 * self.length);
            let (_, low) = self.lap_of(gamma - reach);
            let lap = gamma - reach - low;
            let over = (low + 2.0 * reach - self.length).max(0.0);
            let this = self.closest_between(position, low, low + 2.0 * reach - over);
            let next = self.closest_between(position, 0.0, over);
            let next = Candidate {
                gamma: next.gamma + self.length,
                ..next
            };
            return lap + if over > 0.0 { this.or(next) } else { this }.gamma;
        }
        let (low, high) = (gamma - reach, gamma + reach);
        let straight = |low: f64, high: f64| {
            let point = self.at(low);
            let piece = Piece {
                from: low,
                ..Piece::line(point.position, point.tangent, high - low)
            };
            candidate(&piece, position)
        };
        let mut best = Candidate::NONE;
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

    /// Arc length of the point of least `cost` (of the distance to `position`, m, and the point) among those
    /// that are closer to `position` than their neighbours on the path; one for each line or arc at most.
    /// Beyond the ends as [`Path::closest`]. No cost is less than its distance.
    #[must_use]
    pub(crate) fn closest_by(&self, position: &Vector2<f64>, cost: impl Fn(f64, &PathPoint) -> f64) -> f64 {
        let candidate = |piece: &Piece| match self.foot_on(piece, position) {
            Some((gamma, distance, point)) => Candidate {
                gamma,
                cost: cost(distance, &point),
            },
            None => Candidate::NONE,
        };
        let best = self.least(0..self.pieces.len(), position, |cost| cost, candidate);
        if best.cost < f64::INFINITY {
            self.foot(position, best)
        } else {
            self.closest(position)
        }
    }

    /// Arc lengths of the `N` closest of the points within `reach` metres of `position` that are closer to it than their neighbours
    /// on the path. Beyond the ends as [`Path::closest`]. Of a path that winds about the position without end, only the first few
    /// thousand pieces are looked at.
    pub(crate) fn feet<const N: usize>(
        &self,
        position: &Vector2<f64>,
        reach: f64,
    ) -> impl Iterator<Item = f64> {
        let mut feet = [Candidate::NONE; N];
        let blocks = self.boxes.iter().zip(self.pieces.chunks(BLOCK));
        let near = blocks.filter(|(block, _)| block.distance(position) <= reach);
        for piece in near.take(BLOCKS_LOOKED_AT).flat_map(|(_, pieces)| pieces) {
            let Some((gamma, cost, _)) = self.foot_on(piece, position) else {
                continue;
            };
            let gamma = self.foot(position, Candidate { gamma, cost });
            let cost = (self.at(gamma).position - position).norm();
            let place = feet.partition_point(|foot| foot.cost <= cost);
            if cost <= reach && place < N {
                feet[place..].rotate_right(1);
                feet[place] = Candidate { gamma, cost };
            }
        }
        let found = feet.into_iter().filter(|foot| foot.cost < f64::INFINITY);
        found.map(|foot| foot.gamma)
    }

    /// The point of a piece closest to `position`, if no neighbour on the path is closer: arc length, distance, point.
    fn foot_on(&self, piece: &Piece, position: &Vector2<f64>) -> Option<(f64, f64, PathPoint)> {
        let length = piece.closest(position);
        let point = piece.at(length);
        let miss = position - point.position;
        let along = miss.dot(&direction(point.tangent));
        let gamma = piece.from + length;
        let at_an_end = !self.closed && (gamma <= 0.0 || self.length <= gamma);
        // At a joint that is no foot, the neighbour is closer, up to how well pieces join.
        let is_foot = at_an_end || along.abs() <= GAP_MAX + KINK_MAX * miss.norm();
        is_foot.then(|| (gamma, miss.norm(), point))
    }

    /// The closest point between two arc lengths of the first lap.
    fn closest_between(&self, position: &Vector2<f64>, low: f64, high: f64) -> Candidate {
        let first = self.pieces.partition_point(|piece| piece.end() < low);
        let after = self.pieces.partition_point(|piece| piece.from <= high);
        self.least(first..after, position, f64::sqrt, |piece| {
            let whole = low <= piece.from && piece.end() <= high;
            let part = || piece.cut(low.max(piece.from), high.min(piece.end()));
            candidate(&if whole { *piece } else { part() }, position)
        })
    }

    /// The first of those candidates of a range of pieces that cost least. Passes over pieces that are farther away than the
    /// distance that the best cost stands for: of thousands of way-points it looks at tens.
    fn least(
        &self,
        range: Range<usize>,
        position: &Vector2<f64>,
        distance_of: impl Fn(f64) -> f64,
        candidate: impl Fn(&Piece) -> Candidate,
    ) -> Candidate {
        let Some(all) = self.pieces.get(range.clone()).filter(|all| !all.is_empty()) else {
            return Candidate::NONE;
        };
        let mut best = Candidate::NONE;
        if all.len() <= BLOCK {
            return all.iter().map(candidate).fold(best, Candidate::or);
        }
        let blocks = range.start / BLOCK..range.end.div_ceil(BLOCK);
        let of_block =
            |block: usize| &self.pieces[range.start.max(block * BLOCK)..range.end.min((block + 1) * BLOCK)];
        // The nearest block bounds the cost before any other is looked at.
        let distances = blocks
            .clone()
            .map(|block| (block, self.boxes[block].distance(position)));
        let nearest = distances.min_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut limit = nearest.map_or(f64::INFINITY, |(block, _)| {
            let costs = of_block(block).iter().map(|piece| candidate(piece).cost);
            costs.fold(f64::INFINITY, f64::min)
        });
        for block in blocks {
            if self.boxes[block].distance(position) <= distance_of(limit) + GAP_MAX {
                best = of_block(block).iter().map(&candidate).fold(best, Candidate::or);
                limit = limit.min(best.cost);
            }
        }
        best
    }

    /// Goes on along an open path's continuation where the candidate is the path's end.
    fn foot(&self, position: &Vector2<f64>, candidate: Candidate) -> f64 {
        let gamma = candidate.gamma;
        if self.closed {
            return gamma;
        }
        let along = |point: &PathPoint| (position - point.position).dot(&direction(point.tangent));
        if gamma <= 0.0 {
            let before = along(&self.start).min(0.0);
            if self.pieces.is_empty() {
                along(&self.start)
            } else {
                before
            }
        } else if self.length <= gamma {
            self.length + along(&self.end).max(0.0)
        } else {
            gamma
        }
    }
}

fn candidate(piece: &Piece, position: &Vector2<f64>) -> Candidate {
    let length = piece.closest(position);
    Candidate {
        gamma: piece.from + length,
        cost: (position - piece.at(length).position).norm_squared(),
    }
}
