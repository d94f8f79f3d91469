//! From a path in a client's JSON to one that an AUV can be forecast along.

use std::sync::Arc;

use nalgebra::Vector2;
use planner::{path, snapshot::KnownPath};

use super::{
    field_pointers::{members_fit, present},
    request::{Path, Segment, SegmentKind},
};
use crate::FieldError;

/// How many segments it has, every way-point counted as one, an empty list of them too.
pub(super) fn count(path: &Path) -> usize {
    let of = |segment: &Segment| segment.points.as_ref().map_or(1, |points| points.len().max(1));
    path.segments.iter().map(of).sum()
}

/// The path at `pointer`, if it is one; else what is wrong goes into `invalid`.
pub(super) fn known_path(pointer: &str, given: &Path, invalid: &mut Vec<FieldError>) -> Option<KnownPath> {
    let segments: Vec<_> = given
        .segments
        .iter()
        .enumerate()
        .map(|(i, given)| segment(&format!("{pointer}/segments/{i}"), given, invalid))
        .collect();
    let segments: Vec<_> = segments.into_iter().collect::<Option<_>>()?;
    match path::Path::from_segments(&segments, given.closed) {
        Ok(path) => Some(KnownPath {
            path: Arc::new(path),
            horizontal_speed: given.speed_mps,
        }),
        Err(path::InvalidPath(fault)) => {
            let mut fault = FieldError::from(&fault);
            fault.pointer.insert_str(0, pointer);
            invalid.push(fault);
            None
        }
    }
}

/// The segment, if every member that its kind needs is there; what is missing or too much goes into `invalid`.
fn segment(pointer: &str, segment: &Segment, invalid: &mut Vec<FieldError>) -> Option<path::Segment> {
    let needed: &[&str] = match segment.kind {
        SegmentKind::Line => &["from", "to"],
        SegmentKind::Arc => &["from", "centre", "angle_rad"],
        SegmentKind::Waypoints => &["points", "fillet_m"],
    };
    let present = present!(segment; from, to, centre, angle_rad, points, fillet_m);
    if !members_fit(pointer, "segment", needed, &present, invalid) {
        return None;
    }
    Some(match segment.kind {
        SegmentKind::Line => path::Segment::Line {
            from: segment.from?.into(),
            to: segment.to?.into(),
        },
        SegmentKind::Arc => path::Segment::Arc {
            from: segment.from?.into(),
            centre: segment.centre?.into(),
            angle: segment.angle_rad?,
        },
        SegmentKind::Waypoints => path::Segment::Waypoints {
            points: segment
                .points
                .iter()
                .flatten()
                .map(|point| Vector2::from(*point))
                .collect(),
            fillet_radius: segment.fillet_m?,
        },
    })
}
