//! Limits of a path's parts, and the error for violations.

use std::{f64::consts::TAU, fmt};

use crate::facts::{
    invalid_field::{InvalidField, InvalidReason},
    ranges::COORDINATE_MAX,
};

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

/// Largest change of direction between two segments, rad: a millimetre on a metre, 0.06°. A vehicle
/// that turns at 0.3 rad/s makes it in 3 ms.
pub const KINK_MAX: f64 = 1e-3;

/// Largest angle of an arc, rad: a full circle, with rounding.
pub const ARC_ANGLE_MAX: f64 = TAU + KINK_MAX;

/// The first field at fault, as slash-separated names (`segments/2/points/0/1` is the east of the
/// first point of the third segment).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct InvalidPath(pub InvalidField);

pub(super) fn require_straight(field: fmt::Arguments<'_>, turn: f64) -> Result<(), InvalidPath> {
    let (given, most) = (turn.abs(), KINK_MAX);
    if most < given {
        return Err(invalid(field, InvalidReason::Kink { given, most }));
    }
    Ok(())
}

pub(super) fn require_point(field: fmt::Arguments<'_>, [north, east]: &[f64; 2]) -> Result<(), InvalidPath> {
    require_within(format_args!("{field}/0"), *north, -COORDINATE_MAX, COORDINATE_MAX)?;
    require_within(format_args!("{field}/1"), *east, -COORDINATE_MAX, COORDINATE_MAX)
}

pub(super) fn require_count(
    field: fmt::Arguments<'_>,
    given: usize,
    range: std::ops::RangeInclusive<usize>,
    unit: &'static str,
) -> Result<(), InvalidPath> {
    if range.contains(&given) {
        return Ok(());
    }
    let (least, most) = range.into_inner();
    Err(invalid(
        field,
        InvalidReason::Length {
            unit,
            given,
            least,
            most,
        },
    ))
}

pub(crate) fn require_within(
    field: fmt::Arguments<'_>,
    given: f64,
    least: f64,
    most: f64,
) -> Result<(), InvalidPath> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    Err(invalid(field, InvalidReason::OutOfRange { given, least, most }))
}

pub(crate) fn invalid(field: fmt::Arguments<'_>, reason: InvalidReason) -> InvalidPath {
    InvalidPath(InvalidField {
        field: field.to_string(),
        reason,
    })
}
