//! Lanes over an area.

use crate::route::POINTS_MAX;

/// Spacing and direction of lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawnMower {
    /// Distance between two lanes, m.
    pub spacing_m: f64,
    /// Heading of the first lane, rad.
    pub heading_rad: f64,
}

/// There are no lanes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoLanes {
    /// An area of fewer than three corners, or one that is not finite.
    #[error("an area needs three corners or more, all finite")]
    NoArea,
    /// A spacing that gives no lane or too many.
    #[error("lanes {0} m apart give none or more than {POINTS_MAX} points; change the spacing")]
    Spacing(f64),
}

/// Way-points (north, east), m, of lanes over the polygon of `corners` (north, east), m: about half
/// a spacing inside both sides, in turn along and against the heading. Where the area is not
/// convex, a lane runs from its first edge to its last.
pub fn lanes_over(corners: &[[f64; 2]], mower: &LawnMower) -> Result<Vec<[f64; 2]>, NoLanes> {
    let finite = corners.iter().flatten().all(|number| number.is_finite());
    if corners.len() < 3 || !finite || !mower.heading_rad.is_finite() {
        return Err(NoLanes::NoArea);
    }
    // (ahead, starboard) of the heading.
    let (sin, cos) = mower.heading_rad.sin_cos();
    let turned: Vec<[f64; 2]> = corners.iter().map(|[n, e]| [n * cos + e * sin, e * cos - n * sin]).collect();
    let across = || turned.iter().map(|corner| corner[1]);
    let least = across().fold(f64::INFINITY, f64::min);
    let most = across().fold(f64::NEG_INFINITY, f64::max);
    let spacing = mower.spacing_m;
    let n_lanes = ((most - least) / spacing).round().max(1.0);
    let n_lanes_max = POINTS_MAX as f64 / 2.0;
    if !(0.0 < spacing && n_lanes <= n_lanes_max) {
        return Err(NoLanes::Spacing(spacing));
    }
    let margin = 0.5 * (most - least - (n_lanes - 1.0) * spacing);
    let mut points = Vec::new();
    let (mut lane, mut back) = (0.0, false);
    while lane < n_lanes {
        let starboard = least + margin + lane * spacing;
        let mut ends = crossings(&turned, starboard);
        if ends[0] < ends[1] {
            if back {
                ends.reverse();
            }
            points.extend(ends.map(|ahead| [ahead * cos - starboard * sin, ahead * sin + starboard * cos]));
            back = !back;
        }
        lane += 1.0;
    }
    if points.is_empty() {
        return Err(NoLanes::Spacing(spacing));
    }
    Ok(points)
}

/// First and last crossing of the polygon's edges with the line at `starboard`, m ahead.
fn crossings(corners: &[[f64; 2]], starboard: f64) -> [f64; 2] {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], (a, b)| {
        let (low, high) = (a[1].min(b[1]), a[1].max(b[1]));
        if low == high || starboard < low || high < starboard {
            return [first, last];
        }
        let ahead = a[0] + (b[0] - a[0]) * (starboard - a[1]) / (b[1] - a[1]);
        [first.min(ahead), last.max(ahead)]
    })
}
