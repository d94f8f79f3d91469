//! From a path in a client's JSON to one that an AUV can be forecast along.

use std::sync::Arc;

use nalgebra::Vector2;
use planner::{path, snapshot::KnownPath};

use super::{
    field_pointers::members_fit,
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
    let Segment {
        kind,
        from,
        to,
        centre,
        angle_rad,
        points,
        fillet_m,
    } = segment;
    let needed: &[&str] = match kind {
        SegmentKind::Line => &["from", "to"],
        SegmentKind::Arc => &["from", "centre", "angle_rad"],
        SegmentKind::Waypoints => &["points", "fillet_m"],
    };
    let present = [
        ("from", from.is_some()),
        ("to", to.is_some()),
        ("centre", centre.is_some()),
        ("angle_rad", angle_rad.is_some()),
        ("points", points.is_some()),
        ("fillet_m", fillet_m.is_some()),
    ];
    if !members_fit(pointer, "segment", needed, &present, invalid) {
        return None;
    }
    let vector = |point: &[f64; 2]| Vector2::from(*point);
    Some(match kind {
        SegmentKind::Line => path::Segment::Line {
            from: vector(from.as_ref()?),
            to: vector(to.as_ref()?),
        },
        SegmentKind::Arc => path::Segment::Arc {
            from: vector(from.as_ref()?),
            centre: vector(centre.as_ref()?),
            angle: (*angle_rad)?,
        },
        SegmentKind::Waypoints => path::Segment::Waypoints {
            points: points.as_ref()?.iter().map(vector).collect(),
            fillet_radius: (*fillet_m)?,
        },
    })
}
