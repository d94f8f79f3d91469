//! All no-go areas together: what is inside, and the nearest place outside.

use std::ops::ControlFlow;

use nalgebra::Vector2;
use smallvec::SmallVec;

use crate::coast::sides::{Bounds, Side, Sides, nearest_on};
use crate::facts::angle::starboard_of;
use crate::facts::bounds::doubled_area;
use crate::facts::no_go::{NoGo, corners_of};

/// Nearness to a side, m, that counts as inside.
const ON_THE_BORDER: f64 = 0.01;

/// Most places that are tried on the way out of overlapping areas.
const EXITS_MAX: usize = 256;

/// Checked no-go areas.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Land {
    pub(crate) sides: Sides,
    /// Corners of all borders and holes, with the land to starboard of who sails along them.
    pub(crate) rings: Vec<Vec<Vector2<f64>>>,
}

impl Land {
    pub(crate) fn new(no_go: &[NoGo]) -> Self {
        let (mut rings, mut sides) = (Vec::new(), Vec::new());
        for (polygon, area) in no_go.iter().enumerate() {
            for (k, ring) in area.rings().enumerate() {
                let mut corners = corners_of(ring);
                if (doubled_area(&corners) < 0.0) != (k > 0) {
                    corners.reverse();
                }
                sides.extend(sides_of(&corners, polygon, rings.len()));
                rings.push(corners);
            }
        }
        Self { sides: Sides::new(sides), rings }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rings.is_empty()
    }

    /// The area in which `point` is deepest, by index, and the way out of all areas, m.
    pub(crate) fn inside(&self, point: &Vector2<f64>) -> Option<(usize, f64)> {
        let around = self.around(point);
        let border = |polygon| self.sides.nearest(point, f64::INFINITY, |side| side.polygon == polygon);
        let depth = |polygon: usize| (polygon, border(polygon).map_or(0.0, |(_, depth)| depth));
        let depths = around.into_iter().map(depth);
        let (deepest, depth) = depths.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
        Some((deepest, self.way_out(point).map_or(depth, |(_, way)| way)))
    }

    /// The nearest place of a border behind which is no other area, and its distance, m: areas may
    /// touch and overlap.
    pub(crate) fn way_out(&self, point: &Vector2<f64>) -> Option<(Vector2<f64>, f64)> {
        let leads_out = |side: &Side| {
            let border = nearest_on(&side.from, &side.to, point);
            let out = (border - point).try_normalize(ON_THE_BORDER);
            out.is_none_or(|out| !self.covers(&(border + out * (2.0 * ON_THE_BORDER))))
        };
        self.sides.nearest(point, f64::INFINITY, leads_out)
    }

    /// The areas around `point`: those whose sides a ray from it meets an odd number of times.
    fn around(&self, point: &Vector2<f64>) -> SmallVec<[usize; 4]> {
        let mut around = SmallVec::new();
        let is_ahead = |bounds: &Bounds| {
            bounds.least.y <= point.y && point.y <= bounds.most.y && point.x <= bounds.most.x
        };
        let meet = |side: &Side| {
            let (from, to) = (side.from - point, side.to - point);
            // Half-open: a ray through a corner meets one of its two sides, or both or none.
            let is_met = (0.0 < from.y) != (0.0 < to.y) && 0.0 < from.perp(&to) * (to.y - from.y);
            if is_met {
                match around.iter().position(|polygon| *polygon == side.polygon) {
                    Some(met) => drop(around.swap_remove(met)),
                    None => around.push(side.polygon),
                }
            }
            ControlFlow::<()>::Continue(())
        };
        let _ = self.sides.visit(is_ahead, meet);
        around
    }

    pub(crate) fn covers(&self, point: &Vector2<f64>) -> bool {
        !self.around(point).is_empty()
    }

    /// `true` outside all areas, and at least `clearance` from them, m.
    pub(crate) fn is_free(&self, point: &Vector2<f64>, clearance: f64) -> bool {
        !self.sides.block(point, point, clearance) && !self.covers(point)
    }

    /// `point`, or, if it is inside or on the border, the nearest place that is `clearance` off, m.
    pub(crate) fn permitted(&self, point: &Vector2<f64>, clearance: f64) -> Vector2<f64> {
        if self.is_free(point, ON_THE_BORDER) {
            return *point;
        }
        let exit = |side: &Side| {
            let border = nearest_on(&side.from, &side.to, point);
            let out = (border - point).try_normalize(ON_THE_BORDER);
            let port = -starboard_of((side.to - side.from).normalize());
            (border - point, border + out.unwrap_or(port) * clearance)
        };
        let mut exits: Vec<_> = self.sides.iter().map(exit).collect();
        let nearer =
            |a: &(Vector2<f64>, _), b: &(Vector2<f64>, _)| a.0.norm_squared().total_cmp(&b.0.norm_squared());
        if EXITS_MAX < exits.len() {
            exits.select_nth_unstable_by(EXITS_MAX, nearer);
            exits.truncate(EXITS_MAX);
        }
        exits.sort_by(nearer);
        let free = |off: f64| exits.iter().map(|(_, exit)| *exit).find(|exit| self.is_free(exit, off));
        free(0.9 * clearance).or_else(|| free(ON_THE_BORDER)).unwrap_or(*point)
    }
}

/// Depth, m, of positions (north, east) in checked no-go areas; 0 outside.
pub fn no_go_depths(no_go: &[NoGo]) -> impl Fn(&Vector2<f64>) -> f64 + use<> {
    let land = Land::new(no_go);
    move |position| land.inside(position).map_or(0.0, |(_, depth)| depth)
}

pub(crate) fn sides_of(corners: &[Vector2<f64>], polygon: usize, ring: usize) -> impl Iterator<Item = Side> {
    let next = corners.iter().cycle().skip(1);
    let side = move |(place, (from, to)): (usize, (&Vector2<f64>, &Vector2<f64>))| Side {
        from: *from,
        to: *to,
        polygon,
        ring,
        place,
    };
    corners.iter().zip(next).enumerate().map(side)
}
