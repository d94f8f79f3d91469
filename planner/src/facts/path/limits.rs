//! Limits of a path's parts, and the error for violations.

use std::{f64::consts::TAU, fmt, ops::RangeInclusive};

use serde_json::json;

use crate::facts::{field_error::FieldError, ranges::COORDINATE_MAX};

/// Most segments of a path, every way-point counted as one.
pub const SEGMENTS_MAX: usize = 10_000;

/// Radius of turn of an unknown vehicle, m: 1.5 m/s at 0.15 rad/s, as survey AUVs turn.
pub const TURN_RADIUS: f64 = 10.0;

/// Longest line or leg, and largest radius, m: the same as the largest coordinate.
pub const LENGTH_MAX: f64 = COORDINATE_MAX;

/// Shortest line or leg, and smallest radius, m; rounded to millimetres they keep a direction.
pub const LENGTH_MIN: f64 = 1e-3;

/// Largest gap between two segments, m: coordinates rounded to millimetres miss by up to 0.7 mm.
pub const GAP_MAX: f64 = 1e-3;

/// Largest change of direction between segments, rad: 0.06°, turned in 3 ms at 0.3 rad/s.
pub const KINK_MAX: f64 = 1e-3;

/// Largest angle of an arc, rad: a full circle, with rounding.
pub const ARC_ANGLE_MAX: f64 = TAU + KINK_MAX;

/// The first fault (`/segments/2/points/0/1` is the east of the first point of the third segment).
pub type InvalidPath = Box<FieldError>;

pub(super) fn require_straight(field: fmt::Arguments<'_>, turn: f64) -> Result<(), InvalidPath> {
    let given = turn.abs();
    if given <= KINK_MAX {
        return Ok(());
    }
    let detail = format!(
        "the direction changes by {given} rad at a point (at most {KINK_MAX} rad): insert an arc, or way-points with \
         room to turn"
    );
    let fault = FieldError::new(field, "kink", detail).given(given);
    Err(Box::new(fault.limit(json!({ "most": KINK_MAX }))))
}

pub(super) fn require_point(field: fmt::Arguments<'_>, [north, east]: &[f64; 2]) -> Result<(), InvalidPath> {
    require_within(format_args!("{field}/0"), *north, -COORDINATE_MAX, COORDINATE_MAX)?;
    require_within(format_args!("{field}/1"), *east, -COORDINATE_MAX, COORDINATE_MAX)
}

pub(super) fn require_count(
    field: fmt::Arguments<'_>,
    given: usize,
    range: &RangeInclusive<usize>,
    unit: &str,
) -> Result<(), InvalidPath> {
    FieldError::of_length(field, given, range, unit).map_or(Ok(()), |fault| Err(Box::new(fault)))
}

pub(crate) fn require_within(
    field: fmt::Arguments<'_>,
    given: f64,
    least: f64,
    most: f64,
) -> Result<(), InvalidPath> {
    FieldError::outside(field, given, &(least..=most)).map_or(Ok(()), |fault| Err(Box::new(fault)))
}

/// Points at one place: `all points` or `both ends`, at most `within` m from the first.
pub(super) fn one_place(field: fmt::Arguments<'_>, points: &str, within: f64) -> InvalidPath {
    let detail = format!("{points} are within {within} m; give at least two places");
    Box::new(FieldError::new(field, "one_place", detail))
}
