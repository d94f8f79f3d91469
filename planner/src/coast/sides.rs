//! Sides of polygons in a tree of boxes: queries look at what is near alone, at any scale.

use std::{cell::Cell, ops::ControlFlow};

use nalgebra::Vector2;

/// Most sides in a leaf of the tree.
const LEAF: usize = 6;

/// A side of a polygon's ring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    pub(crate) from: Vector2<f64>,
    pub(crate) to: Vector2<f64>,
    /// Indices of its polygon, of its ring among all rings, and of the side in the ring.
    pub(crate) polygon: usize,
    pub(crate) ring: usize,
    pub(crate) place: usize,
}

/// A box: least and largest coordinates, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) least: Vector2<f64>,
    pub(crate) most: Vector2<f64>,
}

impl Bounds {
    pub(crate) fn of(from: &Vector2<f64>, to: &Vector2<f64>) -> Self {
        Self { least: from.inf(to), most: from.sup(to) }
    }

    fn with(self, other: &Self) -> Self {
        Self { least: self.least.inf(&other.least), most: self.most.sup(&other.most) }
    }

    /// Distance of two boxes, m; 0 if they touch, and no more than that of their contents.
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        let apart = (self.least - other.most).sup(&(other.least - self.most));
        apart.x.max(0.0).hypot(apart.y.max(0.0))
    }
}

/// A node of the tree, in the order of a walk through it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Branch {
    bounds: Bounds,
    /// The sides of a leaf; none in a fork.
    sides: (usize, usize),
    /// The node after all below this one.
    after: usize,
}

/// Sides in a tree of boxes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sides {
    all: Vec<Side>,
    tree: Vec<Branch>,
}

impl Sides {
    pub(crate) fn new(mut all: Vec<Side>) -> Self {
        let mut tree = Vec::with_capacity(all.len());
        if !all.is_empty() {
            grow(&mut all, 0, &mut tree);
        }
        Self { all, tree }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Side> {
        self.all.iter()
    }

    /// Calls `each` for the sides in boxes that `accepts`, until it breaks.
    pub(crate) fn visit<B>(
        &self,
        accepts: impl Fn(&Bounds) -> bool,
        mut each: impl FnMut(&Side) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut at = 0;
        while let Some(branch) = self.tree.get(at) {
            if accepts(&branch.bounds) {
                let (first, last) = branch.sides;
                self.all[first..last].iter().try_for_each(&mut each)?;
                at += 1;
            } else {
                at = branch.after;
            }
        }
        ControlFlow::Continue(())
    }

    /// `true` if a side is nearer than `clearance`, m, to the segment, or touches it.
    pub(crate) fn block(&self, from: &Vector2<f64>, to: &Vector2<f64>, clearance: f64) -> bool {
        let segment = Bounds::of(from, to);
        let near = |side: &Side| {
            let gap = Gap::between((from, to), (&side.from, &side.to)).distance;
            if gap <= 0.0 || gap < clearance { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        self.visit(|bounds| bounds.gap(&segment) <= clearance, near).is_break()
    }

    /// Distance of the segment from the nearest side, m, or `most` if that is less.
    pub(crate) fn gap(&self, (from, to): (&Vector2<f64>, &Vector2<f64>), most: f64) -> f64 {
        let (segment, within) = (Bounds::of(from, to), Cell::new(most));
        let look = |side: &Side| {
            let gap = Gap::between((from, to), (&side.from, &side.to)).distance;
            within.set(within.get().min(gap));
            ControlFlow::<()>::Continue(())
        };
        let _ = self.visit(|bounds| bounds.gap(&segment) < within.get(), look);
        within.get()
    }

    /// The nearest place to `point` on a side that `counts`, and its distance, if within `most`, m.
    pub(crate) fn nearest(
        &self,
        point: &Vector2<f64>,
        most: f64,
        counts: impl Fn(&Side) -> bool,
    ) -> Option<(Vector2<f64>, f64)> {
        let (at, within) = (Bounds::of(point, point), Cell::new(most));
        let mut nearest = None;
        let look = |side: &Side| {
            let place = nearest_on(&side.from, &side.to, point);
            let distance = (place - point).norm();
            if distance < within.get() && counts(side) {
                within.set(distance);
                nearest = Some((place, distance));
            }
            ControlFlow::<()>::Continue(())
        };
        let _ = self.visit(|bounds| bounds.gap(&at) < within.get(), look);
        nearest
    }
}

/// Adds the tree of `sides`, the first of which has the index `first`.
fn grow(sides: &mut [Side], first: usize, tree: &mut Vec<Branch>) {
    let bounds = sides.iter().map(|side| Bounds::of(&side.from, &side.to));
    let Some(bounds) = bounds.reduce(|all, next| all.with(&next)) else { return };
    let at = tree.len();
    let is_leaf = sides.len() <= LEAF;
    let range = if is_leaf { (first, first + sides.len()) } else { (first, first) };
    tree.push(Branch { bounds, sides: range, after: 0 });
    if !is_leaf {
        let axis = (bounds.most - bounds.least).imax();
        let key = |side: &Side| (side.from + side.to)[axis];
        let half = sides.len() / 2;
        sides.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        let (left, right) = sides.split_at_mut(half);
        grow(left, first, tree);
        grow(right, first + half, tree);
    }
    tree[at].after = tree.len();
}

/// How two segments lie to each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Their distance, m; 0 if they cross.
    pub(crate) distance: f64,
    /// The nearest places on the first and on the second.
    pub(crate) here: Vector2<f64>,
    pub(crate) there: Vector2<f64>,
}

impl Gap {
    pub(crate) fn between(
        (a, b): (&Vector2<f64>, &Vector2<f64>),
        (c, d): (&Vector2<f64>, &Vector2<f64>),
    ) -> Self {
        if crosses((a, b), (c, d)) {
            let (along, side) = (b - a, d - c);
            let place = a + along * ((c - a).perp(&side) / along.perp(&side)).clamp(0.0, 1.0);
            return Self { distance: 0.0, here: place, there: place };
        }
        let ends = [
            (*a, nearest_on(c, d, a)),
            (*b, nearest_on(c, d, b)),
            (nearest_on(a, b, c), *c),
            (nearest_on(a, b, d), *d),
        ];
        let gaps = ends.map(|(here, there)| Self { distance: (there - here).norm(), here, there });
        gaps.into_iter()
            .reduce(|best, next| if next.distance < best.distance { next } else { best })
            .expect("four ends")
    }
}

/// `true` if two segments cross in the inside of both.
pub(crate) fn crosses(
    (a, b): (&Vector2<f64>, &Vector2<f64>),
    (c, d): (&Vector2<f64>, &Vector2<f64>),
) -> bool {
    let side =
        |from: &Vector2<f64>, to: &Vector2<f64>, point: &Vector2<f64>| (to - from).perp(&(point - from));
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

pub(crate) fn nearest_on(from: &Vector2<f64>, to: &Vector2<f64>, point: &Vector2<f64>) -> Vector2<f64> {
    let along = to - from;
    let length = along.norm_squared();
    let share = if 0.0 < length { ((point - from).dot(&along) / length).clamp(0.0, 1.0) } else { 0.0 };
    from + along * share
}
