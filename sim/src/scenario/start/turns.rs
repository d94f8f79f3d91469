//! The path of a vehicle that turns late or early at way-points.

use nalgebra::Vector2;
use planner::path::{Path, Segment};

/// Distance of the return to the path beyond a way-point, in distances by which the turn is late.
const RETURN: f64 = 4.0;
/// Largest share of a leg that a late turn takes at either end.
const SHARE_MAX: f64 = 0.45;

/// The way of a vehicle along `plan` that turns `late` m beyond every way-point, before it if
/// negative, and heads for a later point of the next leg:
///
/// ```text
/// P  →  P + late a,  P + min(4 |late|, 0.45 L) b
/// ```
/// with the directions a and b of the legs before and after, the latter L long.
pub(super) fn turning_late(plan: &Path, late: f64) -> Result<Path, String> {
    let mut segments = plan.segments().to_vec();
    let mut with_turns = 0;
    for segment in &mut segments {
        if let Segment::Waypoints { points, .. } = segment {
            *points = turns(points, late, plan.is_closed());
            with_turns += 1;
        }
    }
    if with_turns == 0 {
        return Err("the path has no way-points".to_owned());
    }
    Path::from_segments(&segments, plan.is_closed()).map_err(|error| error.to_string())
}

fn turns(points: &[[f64; 2]], late: f64, closed: bool) -> Vec<[f64; 2]> {
    let n = points.len();
    let point = |k: usize| Vector2::from(points[k % n]);
    let turn = |k: usize| {
        let [before, after] = [point(k) - point(k + n - 1), point(k + 1) - point(k)];
        let beyond = late.max(-SHARE_MAX * before.norm());
        let back = (RETURN * late.abs()).min(SHARE_MAX * after.norm());
        [point(k) + before.normalize() * beyond, point(k) + after.normalize() * back]
    };
    if !closed {
        let within = (1..n.max(1) - 1).flat_map(turn).map(Into::into);
        let ends = [points[..1].to_vec(), points[n - 1..].to_vec()];
        let [first, last] = ends;
        return first.into_iter().chain(within).chain(last).collect();
    }
    let mut points: Vec<_> = (0..n).flat_map(turn).map(Into::into).collect();
    // It begins where it is back on its first leg.
    points.rotate_left(1);
    points
}
