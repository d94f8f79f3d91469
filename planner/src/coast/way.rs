//! The shortest way past no-go areas.
//!
//! The graph has the two ends alone at first. A leg of its shortest path that comes too near a
//! border is closed, and the corners of the convex hull of what is in its way, moved outwards,
//! become nodes. The first path whose legs are all clear is the way.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::ControlFlow;

use nalgebra::Vector2;
use smallvec::SmallVec;

use crate::coast::land::Land;
use crate::coast::sides::{Bounds, Gap, Side, nearest_on};
use crate::facts::angle::starboard_of;
use crate::facts::bisection::last_at_which;

/// Most nodes, and most legs that are looked at.
const NODES_MAX: usize = 240;
const LEGS_MAX: usize = 3000;

/// Most stretches of one border that a closed leg adds.
const STRETCHES_MAX: usize = 8;

/// Distance beyond the first border that closes a leg in which others are looked at, in clearances.
const BEHIND: f64 = 5.0;

/// Share of the clearance that is asked of nodes and legs: rounding must not close what just fits.
const KEPT: f64 = 0.98;

/// Most corners of a round cape that share a node, a power of two.
const SHARED_MAX: usize = 64;

/// Halvings of a line, to a millionth.
const HALVINGS: u32 = 20;

/// Distance of nodes that count as one, m.
const SAME: f64 = 0.05;

/// A search for ways at a distance from no-go areas.
pub(crate) struct Search<'a> {
    pub(crate) land: &'a Land,
    /// Distance to keep from borders where both ends do, m.
    pub(crate) clearance: f64,
    pub(crate) due: &'a dyn Fn() -> bool,
}

/// What is known of a leg between two nodes.
#[derive(Clone, Copy, PartialEq)]
enum Leg {
    Untried,
    Clear,
    Closed,
}

#[derive(Clone, Copy)]
struct Node {
    at: Vector2<f64>,
    /// The corner of land that it is beside; itself at the ends.
    corner: Vector2<f64>,
    /// Distance from the nearest border, m, up to the clearance.
    off: f64,
    /// Length of the shortest known way to it, m, and the node before it.
    length: f64,
    before: usize,
}

struct Graph {
    nodes: Vec<Node>,
    /// An entry for each pair of nodes, at [`NODES_MAX`] times the one plus the other.
    legs: Vec<Leg>,
    /// Legs from nodes with a way to others, the one with the shortest way through it first.
    open: BinaryHeap<Reverse<(u64, usize, usize)>>,
    /// The stretches whose corners are nodes: ring, first and last side.
    stretches: HashSet<[usize; 3]>,
}

pub(crate) fn length(way: &[Vector2<f64>]) -> f64 {
    way.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum()
}

impl Search<'_> {
    /// `true` if the craft can go straight there; an end nearer to a border lowers the clearance.
    pub(crate) fn is_clear(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> bool {
        !self.land.sides.block(from, to, KEPT * self.off(from).min(self.off(to)))
    }

    fn off(&self, place: &Vector2<f64>) -> f64 {
        let nearest = self.land.sides.nearest(place, self.clearance, |_| true);
        nearest.map_or(self.clearance, |(_, distance)| distance)
    }

    /// The last place on the straight line from `from` to `to` to which that is clear.
    pub(crate) fn as_far_as_open(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Vector2<f64> {
        let is_clear = |share: f64| self.is_clear(from, &from.lerp(to, share));
        from.lerp(to, last_at_which(is_clear, [0.0, 1.0], HALVINGS))
    }

    /// Excess of the way over the straight line, m: infinite without one, 0 if the search gave up.
    pub(crate) fn detour(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> f64 {
        match self.between(from, to) {
            Some(way) => length(&way) - (way[way.len() - 1] - way[0]).norm(),
            None if (self.due)() => 0.0,
            None => f64::INFINITY,
        }
    }

    /// The way between the nearest permitted places; the straight line if the search gave up.
    pub(crate) fn between(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Option<Vec<Vector2<f64>>> {
        let [from, to] = [from, to].map(|end| self.land.permitted(end, self.clearance));
        let found = if self.is_clear(&from, &to) { vec![from, to] } else { self.way(&from, &to)? };
        Some(if found.last() == Some(&to) { found } else { vec![from, to] })
    }

    /// Corners of the shortest way with both ends; none if there is none. If the search gives up
    /// among too many borders, the way to the corner nearest to `to` that it found.
    ///
    /// A* on legs that are looked at when it is their turn, with nodes that come while it runs.
    pub(crate) fn way(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Option<Vec<Vector2<f64>>> {
        let mut graph = Graph {
            nodes: Vec::new(),
            legs: vec![Leg::Untried; NODES_MAX * NODES_MAX],
            open: BinaryHeap::new(),
            stretches: HashSet::new(),
        };
        let node = |at: &Vector2<f64>| Node {
            at: *at,
            corner: *at,
            off: self.off(at),
            length: f64::INFINITY,
            before: 0,
        };
        graph.nodes = vec![Node { length: 0.0, ..node(from) }, node(to)];
        graph.open_from(0);
        let (mut tried, mut is_last_resort) = (0, false);
        while tried < LEGS_MAX && !(self.due)() {
            let Some(Reverse((_, a, b))) = graph.open.pop() else {
                if is_last_resort || graph.nodes.len() == NODES_MAX {
                    break;
                }
                is_last_resort = true;
                self.add_all_corners(&mut graph);
                continue;
            };
            let [from, to] = [graph.nodes[a], graph.nodes[b]];
            let length = from.length + (to.at - from.at).norm();
            let mut leg = graph.legs[a * NODES_MAX + b];
            if leg == Leg::Closed || to.length <= length {
                continue;
            }
            if leg == Leg::Untried {
                tried += 1;
                let clearance = KEPT * from.off.min(to.off);
                let is_closed = self.land.sides.block(&from.at, &to.at, clearance);
                leg = if is_closed { Leg::Closed } else { Leg::Clear };
                (graph.legs[a * NODES_MAX + b], graph.legs[b * NODES_MAX + a]) = (leg, leg);
            }
            if leg == Leg::Closed {
                self.add_what_closes(&from.at, &to.at, &mut graph);
                continue;
            }
            (graph.nodes[b].length, graph.nodes[b].before) = (length, a);
            if b == 1 {
                return Some(graph.way_to(1));
            }
            graph.open_from(b);
        }
        let gave_up = tried == LEGS_MAX || graph.nodes.len() == NODES_MAX || (self.due)();
        let reached = (2..graph.nodes.len()).filter(|node| graph.nodes[*node].length < f64::INFINITY);
        let left = |node: usize| (graph.nodes[node].at - to).norm_squared();
        let nearest = reached.min_by(|a, b| left(*a).total_cmp(&left(*b))).filter(|_| gave_up);
        nearest.map(|node| graph.way_to(node))
    }

    /// Adds nodes about the stretches of border that close the leg between two nodes.
    fn add_what_closes(&self, from: &Vector2<f64>, to: &Vector2<f64>, graph: &mut Graph) {
        let (segment, along) = (Bounds::of(from, to), to - from);
        let mut hits: Vec<(f64, Vector2<f64>, Side)> = Vec::new();
        let look = |side: &Side| {
            let gap = Gap::between((from, to), (&side.from, &side.to));
            if gap.distance < self.clearance {
                hits.push(((gap.here - from).dot(&along), gap.there, *side));
            }
            ControlFlow::<()>::Continue(())
        };
        let _ = self.land.sides.visit(|bounds| bounds.gap(&segment) < self.clearance, look);
        hits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.from.x.total_cmp(&b.2.from.x)));
        // What is far behind the first border is looked at once the way round that is known.
        let Some(first) = hits.first() else { return };
        let last = hits.iter().rfind(|hit| hit.2.ring == first.2.ring).unwrap_or(first);
        let most = last.0 + BEHIND * self.clearance * along.norm();
        let mut rings: SmallVec<[usize; 8]> = SmallVec::new();
        for (_, _, side) in hits.iter().take_while(|hit| hit.0 <= most) {
            if !rings.contains(&side.ring) {
                rings.push(side.ring);
                let of_ring: Vec<_> = hits.iter().filter(|hit| hit.2.ring == side.ring).collect();
                self.add_stretches(&of_ring, graph);
            }
        }
    }

    /// Adds nodes about the stretches between sides of a ring, each with a place on it.
    fn add_stretches(&self, hits: &[&(f64, Vector2<f64>, Side)], graph: &mut Graph) {
        let whole = (hits[0], hits[hits.len() - 1]);
        let pairs = hits.windows(2).map(|pair| (pair[0], pair[1]));
        let pairs = pairs.filter(|(a, b)| a.2.to != b.2.from && b.2.to != a.2.from);
        for (a, b) in std::iter::once(whole).chain(pairs).take(STRETCHES_MAX) {
            for (first, last) in [(a, b), (b, a)] {
                if graph.stretches.insert([first.2.ring, first.2.place, last.2.place]) {
                    let ends = [(first.1, first.2.place), (last.1, last.2.place)];
                    for corner in convex_hull(self.stretch(ends, first.2.ring)) {
                        if let Some(k) = corner.of {
                            self.add_corner(first.2.ring, k, graph);
                        }
                    }
                }
            }
        }
    }

    fn add_corner(&self, ring: usize, k: usize, graph: &mut Graph) {
        let ring = &self.land.rings[ring];
        // In a narrow passage there is no room for what corners share.
        let shared = nodes_at(ring, k, self.clearance, SHARED_MAX);
        let are_free = shared.iter().all(|node| self.land.is_free(node, KEPT * self.clearance));
        let nodes = if are_free { shared } else { nodes_at(ring, k, self.clearance, 1) };
        for node in nodes {
            self.add(node, ring[k], graph);
        }
    }

    /// The border from a place on one side to a place on another, both with the side's index.
    fn stretch(&self, [(from, first), (to, last)]: [(Vector2<f64>, usize); 2], ring: usize) -> Vec<Corner> {
        let corners = &self.land.rings[ring];
        let n = corners.len();
        let between = match (last + n - first) % n {
            0 => n,
            between => between,
        };
        let end = |at| Corner { at, of: None };
        let inner = (1..=between).map(|k| {
            let [before, at, after] = around(corners, (first + k) % n);
            let is_convex = 0.0 < (at - before).perp(&(after - at));
            Corner { at, of: is_convex.then_some((first + k) % n) }
        });
        std::iter::once(end(from)).chain(inner).chain([end(to)]).collect()
    }

    /// Adds the corners that stand out farthest: where hulls lead nowhere, as in a maze.
    fn add_all_corners(&self, graph: &mut Graph) {
        let mut corners = Vec::new();
        for (i, ring) in self.land.rings.iter().enumerate() {
            for k in 0..ring.len() {
                let [before, at, after] = around(ring, k);
                if 0.0 < (at - before).perp(&(after - at)) {
                    corners.push(((nearest_on(&before, &after, &at) - at).norm(), i, k));
                }
            }
        }
        corners.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, ring, k) in corners {
            self.add_corner(ring, k, graph);
        }
    }

    fn add(&self, at: Vector2<f64>, corner: Vector2<f64>, graph: &mut Graph) {
        let is_new = !graph.nodes.iter().any(|other| (other.at - at).norm() < SAME);
        if is_new && graph.nodes.len() < NODES_MAX && self.land.is_free(&at, KEPT * self.clearance) {
            graph.nodes.push(Node { at, corner, off: self.clearance, length: f64::INFINITY, before: 0 });
            let new = graph.nodes.len() - 1;
            for node in 0..new {
                if graph.nodes[node].length < f64::INFINITY {
                    graph.open(node, new);
                }
            }
        }
    }
}

impl Graph {
    fn open_from(&mut self, node: usize) {
        for other in 0..self.nodes.len() {
            self.open(node, other);
        }
    }

    fn open(&mut self, from: usize, to: usize) {
        let [a, b, end] = [self.nodes[from], self.nodes[to], self.nodes[1]];
        let length = a.length + (b.at - a.at).norm();
        // A shortest way bends towards the land at every corner.
        let (come, go) = (a.at - self.nodes[a.before].at, b.at - a.at);
        let is_taut = -SAME * SAME <= come.perp(&go) * come.perp(&(a.corner - a.at));
        if is_taut && length < b.length && self.legs[from * NODES_MAX + to] != Leg::Closed {
            // Lengths are not negative: their bits are in their order.
            let through = (length + (end.at - b.at).norm()).to_bits();
            self.open.push(Reverse((through, from, to)));
        }
    }

    fn way_to(&self, mut node: usize) -> Vec<Vector2<f64>> {
        let mut way = vec![self.nodes[node].at];
        while node != 0 {
            node = self.nodes[node].before;
            way.push(self.nodes[node].at);
        }
        way.reverse();
        way
    }
}

/// A corner of a border, or the end of a stretch of it.
#[derive(Clone, Copy)]
struct Corner {
    at: Vector2<f64>,
    /// Its index in its ring, if the land is convex here.
    of: Option<usize>,
}

/// The corner number `k` of a ring, round it.
fn around(ring: &[Vector2<f64>], k: usize) -> [Vector2<f64>; 3] {
    let n = ring.len();
    [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]]
}

/// The nodes at a convex corner of a ring, at `clearance`, m, whatever leg it is in the way of. Up
/// to `most` corners of a round cape share those of one polygon round it that is nowhere farther
/// off than half the clearance.
fn nodes_at(ring: &[Vector2<f64>], k: usize, clearance: f64, most: usize) -> Vec<Vector2<f64>> {
    let n = ring.len();
    let side = |k: usize| (ring[k % n], ring[(k + 1) % n] - ring[k % n]);
    let (before, after) = (side(k + n - 1), side(k));
    let bend = 0.5 * (before.1.norm() + after.1.norm()) * turn(before.1, after.1);
    let mut share = 1;
    while share < most && (2 * share).pow(2) as f64 * bend < 4.0 * clearance {
        share *= 2;
    }
    while 1 < share {
        let first = (k + n - 1) % n / share * share;
        let (begun, end) = (side(first), side(first + share));
        let beyond =
            meeting(begun, end).map(|at| (nearest_on(&ring[(first + 1) % n], &end.0, &at) - at).norm());
        let is_convex = (first + 1..=first + share).all(|k| {
            let [before, at, after] = around(ring, k % n);
            0.0 < (at - before).perp(&(after - at))
        });
        if is_convex && share < n && beyond.is_some_and(|beyond| beyond < 0.5 * clearance) {
            return between_lines(begun, end, clearance);
        }
        share /= 2;
    }
    between_lines(before, after, clearance)
}

/// The corners of the convex hull, with the inside to starboard of who sails along it. Source:
/// A. M. Andrew, Another efficient algorithm for convex hulls in two dimensions, 1979.
fn convex_hull(mut corners: Vec<Corner>) -> Vec<Corner> {
    corners.sort_by(|a, b| a.at.x.total_cmp(&b.at.x).then(a.at.y.total_cmp(&b.at.y)));
    let mut hull: Vec<Corner> = Vec::new();
    for is_back in [false, true] {
        let begun = hull.len();
        for k in 0..corners.len() {
            let corner = corners[if is_back { corners.len() - 1 - k } else { k }];
            while begun + 2 <= hull.len() {
                let [a, b] = [hull[hull.len() - 2].at, hull[hull.len() - 1].at];
                if 0.0 < (b - a).perp(&(corner.at - b)) {
                    break;
                }
                hull.pop();
            }
            hull.push(corner);
        }
        hull.pop();
    }
    hull
}

/// A line: a point on it and its direction.
type Line = (Vector2<f64>, Vector2<f64>);

/// Where two lines with less than a right angle between them meet, the second to the left.
fn meeting((a, along): Line, (b, other): Line) -> Option<Vector2<f64>> {
    let (sine, cosine) = (along.perp(&other), along.dot(&other));
    (0.0 < sine && 0.0 <= cosine).then(|| a + along * ((b - a).perp(&other) / sine))
}

/// Turn from a direction to another, rad, from 0 to a whole one.
fn turn(from: Vector2<f64>, to: Vector2<f64>) -> f64 {
    from.perp(&to).atan2(from.dot(&to)).rem_euclid(TAU)
}

/// The corners of a line round the corner between two sides at `clearance`, m, on their port side.
fn between_lines(a: Line, b: Line, clearance: f64) -> Vec<Vector2<f64>> {
    let aside = |(place, along): Line| {
        let along = along.normalize();
        (place - starboard_of(along) * clearance, along)
    };
    let middle = (FRAC_PI_2 + 1e-6 < turn(a.1, b.1)).then(|| {
        let [before, after] = [a.1, b.1].map(|along| along.normalize());
        // After half a turn the two cancel.
        (b.0, (before + after).try_normalize(1e-6).unwrap_or(starboard_of(before)))
    });
    let lines: Vec<_> = [Some(a), middle, Some(b)].into_iter().flatten().map(aside).collect();
    let crossing = |pair: &[Line]| {
        let [(a, along), (b, other)] = [pair[0], pair[1]];
        let sine = along.perp(&other);
        if sine.abs() < 1e-9 { b } else { a + along * ((b - a).perp(&other) / sine) }
    };
    lines.windows(2).map(crossing).collect()
}
