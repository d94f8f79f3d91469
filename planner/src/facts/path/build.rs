//! Checked paths from segments, way-points or a circle.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use serde_json::json;

use crate::facts::angle::{direction, wrap};
use crate::facts::field_error::FieldError;
use crate::facts::path::curve::{Path, Side};
use crate::facts::path::limits::{GAP_MAX, InvalidPath, SEGMENTS_MAX, require_count, require_straight};
use crate::facts::path::piece::Piece;
use crate::facts::path::segment::Segment;
use crate::facts::path::waypoints::Overshot;

impl Path {
    /// Joined segments: each begins where the previous one ends, in the same direction, and if
    /// `closed` the first at the end of the last. A closed path of way-points alone returns to its
    /// first point, rounded there too.
    ///
    /// Fails with the first segment or point that is not finite, too short or too far
    /// ([`LENGTH_MIN`](super::LENGTH_MIN), [`LENGTH_MAX`](super::LENGTH_MAX)), begins elsewhere
    /// ([`GAP_MAX`]), turns at a point ([`KINK_MAX`](super::KINK_MAX)), or has legs too short for
    /// its `fillet_m`. Without a `fillet_m`, corners may have any angle.
    pub fn from_segments(segments: &[Segment], closed: bool) -> Result<Self, InvalidPath> {
        Self::turned(segments, closed, None)
    }

    /// [`Path::from_segments`] of a vehicle that may overshoot corners.
    pub(crate) fn turned(
        segments: &[Segment],
        closed: bool,
        overshot: Option<Overshot>,
    ) -> Result<Self, InvalidPath> {
        let given = segments.iter().map(Segment::count).sum();
        require_count(format_args!("/segments"), given, &(1..=SEGMENTS_MAX), "segments")?;
        let mut path = Self::starting_at(Vector2::zeros(), 0.0);
        let ring = closed && segments.len() == 1;
        for (i, segment) in segments.iter().enumerate() {
            let field = format!("/segments/{i}");
            let pieces = segment.pieces(&field, ring, overshot)?;
            if let (Some(next), false) = (pieces.first(), path.pieces.is_empty()) {
                path.require_joint(&field, next)?;
            }
            for piece in pieces {
                path.append(piece);
            }
            path.segments.push(segment.clone());
        }
        if let (Some(first), true) = (path.pieces.first(), closed) {
            path.require_joint("/segments/0", first)?;
        }
        path.closed = closed;
        Ok(path)
    }

    /// Straight legs between `points` (north, east), m, joined by fillets of `fillet_radius`
    /// metres, which may be 0 where there is no corner. If `closed`, the path returns to its first
    /// point (not repeated), has a fillet there, and begins where that fillet ends.
    ///
    /// Fails as [`Path::from_segments`]; the corner at fault is a point of `segments/0`.
    pub fn waypoints(points: &[Vector2<f64>], fillet_radius: f64, closed: bool) -> Result<Self, InvalidPath> {
        let points = points.iter().map(|point| [point.x, point.y]).collect();
        let waypoints =
            Segment::Waypoints { points, fillet_m: Some(fillet_radius), turn_radius_m: None, legs: vec![] };
        Self::from_segments(&[waypoints], closed)
    }

    /// A circle of `radius` metres to `side` around `centre`, which starts at `bearing`, rad.
    ///
    /// Fails as [`Path::from_segments`].
    pub fn circle(centre: Vector2<f64>, radius: f64, side: Side, bearing: f64) -> Result<Self, InvalidPath> {
        let from = centre + direction(bearing) * radius;
        let angle_rad = match side {
            Side::Port => -TAU,
            Side::Starboard => TAU,
        };
        let circle = Segment::Arc { from: from.into(), centre: centre.into(), angle_rad };
        Self::from_segments(&[circle], true)
    }

    /// Checks its segments like [`Path::from_segments`]; paths from lengths and angles may fail.
    pub fn check(&self) -> Result<(), InvalidPath> {
        Self::from_segments(&self.segments, self.closed).map(drop)
    }

    fn require_joint(&self, field: &str, next: &Piece) -> Result<(), InvalidPath> {
        let gap = (next.start - self.end.position).norm();
        if GAP_MAX < gap {
            let detail = format!("starts {gap} m from where the path is; at most {GAP_MAX} m is allowed");
            let fault = FieldError::new(field, "gap", detail).given(gap);
            return Err(Box::new(fault.limit(json!({ "most": GAP_MAX }))));
        }
        require_straight(format_args!("{field}"), wrap(next.tangent - self.end.tangent))
    }
}
