//! Faults of the shapes of no-go areas.

use std::ops::ControlFlow;

use crate::coast::{
    land::{Land, sides_of},
    sides::{Bounds, Side, Sides, crosses},
};
use crate::facts::{
    bounds::{SIZE_MIN, doubled_area, too_near, too_small},
    field_error::FieldError,
    no_go::{NoGo, corners_of},
};

/// Most pairs of sides of one area that are compared; a chart has a few for each of its sides.
const PAIRS_MAX: usize = 2_000_000;

/// The first fault of the shape of each of `no_go`, whose numbers are in their ranges.
pub(crate) fn shape_faults(no_go: &[NoGo]) -> Vec<FieldError> {
    let faults = no_go.iter().enumerate().map(|(i, area)| (i, fault(area)));
    faults.filter_map(|(i, fault)| Some(fault?.within(&format!("/no_go/{i}")))).collect()
}

fn fault(area: &NoGo) -> Option<FieldError> {
    let mut sides = Vec::new();
    for (k, ring) in area.rings().enumerate() {
        let (place, corners) = (NoGo::pointer(k), corners_of(ring));
        for side in sides_of(&corners, 0, k) {
            let next = (side.place + 1) % corners.len();
            let too_near = too_near(format_args!("{place}/{next}"), (side.to - side.from).norm());
            if too_near.is_some() {
                return too_near;
            }
            sides.push(side);
        }
    }
    let (sides, mut pairs) = (Sides::new(sides), 0);
    let crossing = sides.iter().find_map(|side| crossing(side, &sides, &mut pairs));
    crossing.or_else(|| area.rings().enumerate().find_map(too_little)).or_else(|| hole_outside(area))
}

/// The fault of a ring round next to nothing.
fn too_little((k, ring): (usize, &Vec<[f64; 2]>)) -> Option<FieldError> {
    let given = (0.5 * doubled_area(&corners_of(ring)).abs()).sqrt();
    let detail = format!("is no larger than a square of {given} m, less than {SIZE_MIN} m");
    (given < SIZE_MIN).then(|| too_small(NoGo::pointer(k), "too_small", detail, given))
}

/// The fault of a side that crosses another, or of too many that might.
fn crossing(side: &Side, sides: &Sides, pairs: &mut usize) -> Option<FieldError> {
    let bounds = Bounds::of(&side.from, &side.to);
    let is_crossed = |other: &Side| {
        *pairs += 1;
        let is_crossed = crosses((&side.from, &side.to), (&other.from, &other.to));
        if is_crossed || PAIRS_MAX < *pairs { ControlFlow::Break(*other) } else { ControlFlow::Continue(()) }
    };
    let other = sides.visit(|other| other.gap(&bounds) <= 0.0, is_crossed).break_value()?;
    if PAIRS_MAX < *pairs {
        let detail = "too many of its sides are long and side by side to find out whether they cross";
        return Some(FieldError::new("/polygon", "too_dense", detail));
    }
    let place = |side: &Side| format!("{}/{}", NoGo::pointer(side.ring), side.place);
    let detail = format!("the side after this corner crosses the side after {}", place(&other));
    Some(FieldError::new(place(side), "crosses", detail))
}

/// The fault of a hole that is not within the border.
fn hole_outside(area: &NoGo) -> Option<FieldError> {
    let whole = (!area.holes.is_empty()).then(|| Land::new(&[NoGo::new(area.polygon.clone())]))?;
    let is_outside = |hole: &Vec<[f64; 2]>| !corners_of(hole).iter().any(|corner| whole.covers(corner));
    let outside = area.holes.iter().position(is_outside)?;
    let detail = "a hole is within the border of its area";
    Some(FieldError::new(NoGo::pointer(outside + 1), "hole_outside", detail))
}
