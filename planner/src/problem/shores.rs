//! No-go areas at the intervals: half-planes that hold the guessed way and no border near it.

use std::ops::ControlFlow;

use nalgebra::Vector2;

use crate::coast::land::Land;
use crate::coast::sides::{Bounds, Gap, Side};
use crate::craft::response::Stage;
use crate::facts::angle::starboard_of;
use crate::problem::frame::Frame;
use crate::problem::limits::Shore;

/// Half-planes of an interval: beside, on the other side, ahead, and as many for corners.
pub(crate) const SHORES: usize = 6;

/// Distance of borders from a guess that a solution may reach: least, m, and time at full speed, s.
const LEFT_BY: (f64, f64) = (30.0, 10.0);

/// Least distance with a direction, m.
const APART: f64 = 1e-6;

/// Half-planes beside `land` about `stages` for a craft that keeps `margin` from the borders, m.
pub(crate) fn shores(land: &Land, frame: &Frame, stages: &[Stage], speed: f64, margin: f64) -> Vec<Shore> {
    let n = stages.len();
    let none = Shore { points: vec![Vector2::zeros(); n], normals: vec![Vector2::zeros(); n], margin };
    let mut shores = vec![none; SHORES];
    let within = LEFT_BY.0.max(LEFT_BY.1 * speed);
    let places: Vec<_> = stages.iter().map(|stage| frame.ned_position(&stage.position)).collect();
    for k in 1..n {
        for (shore, (point, normal)) in
            shores.iter_mut().zip(planes(land, (&places[k - 1], &places[k]), within))
        {
            shore.points[k] = frame.position(&point);
            shore.normals[k] = frame.vector(&normal);
        }
    }
    shores
}

/// Half-planes beside a chord, each by a point of its edge and its unit vector to the craft's side.
///
/// The nearest border is separated from the chord, with all behind the same line, then the nearest
/// of what is left. A chord ends where it meets land; from within, the nearest way out counts.
fn planes(
    land: &Land,
    (from, to): (&Vector2<f64>, &Vector2<f64>),
    within: f64,
) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    if land.covers(from) {
        let out =
            land.way_out(from).and_then(|(place, _)| Some((place, (place - from).try_normalize(APART)?)));
        return out.into_iter().collect();
    }
    let (chord, mut near) = (Bounds::of(from, to), Vec::new());
    let look = |side: &Side| {
        let gap = Gap::between((from, to), (&side.from, &side.to));
        if gap.distance < within {
            near.push((gap, *side));
        }
        ControlFlow::<()>::Continue(())
    };
    let _ = land.sides.visit(|bounds| bounds.gap(&chord) < within, look);
    let met = near.iter().filter(|(gap, _)| gap.distance < APART).map(|(gap, _)| gap.here);
    let met = met.min_by(|a, b| (a - from).norm_squared().total_cmp(&(b - from).norm_squared()));
    if let Some(end) = met {
        for (gap, side) in &mut near {
            *gap = Gap::between((from, &end), (&side.from, &side.to));
        }
    }
    let mut planes = Vec::with_capacity(SHORES);
    while planes.len() < SHORES {
        let nearest = near.iter().min_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        let Some((gap, side)) = nearest.copied() else { break };
        let along_border = || {
            let beside = starboard_of((side.to - side.from).normalize());
            if (from - side.from).dot(&beside) < 0.0 { -beside } else { beside }
        };
        let normal = (gap.here - gap.there).try_normalize(APART).unwrap_or_else(along_border);
        planes.push((gap.there, normal));
        let is_behind = |place: &Vector2<f64>| normal.dot(&(place - gap.there)) <= APART;
        near.retain(|(_, side)| !(is_behind(&side.from) && is_behind(&side.to)));
    }
    planes
}
