//! What is wrong with a field, from the planner's words to a problem document's.

use std::ops::RangeInclusive;

use planner::snapshot::{InvalidField, InvalidReason};
use serde_json::json;

use crate::FieldError;

impl From<&InvalidField> for FieldError {
    fn from(invalid: &InvalidField) -> Self {
        let pointer = format!("/{}", invalid.field);
        match &invalid.reason {
            InvalidReason::OutOfRange { given, least, most } => {
                Self::out_of_range(pointer, *given, *least, *most)
            }
            InvalidReason::OffTheClock {
                given,
                now,
                least,
                most,
            } => Self::off_the_clock(pointer, *given, "the request's `t_s`", *now, &(*least..=*most)),
            InvalidReason::Length { given, least, most } => {
                // Names are measured in bytes, lists in items.
                let unit = if pointer.ends_with("/id") {
                    "bytes"
                } else {
                    "items"
                };
                length(pointer, *given, *least..=*most, unit)
            }
            InvalidReason::Duplicate { given } => {
                Self::new(pointer, "duplicate", "this name stands twice").given(given.as_str())
            }
            InvalidReason::ControlCharacter { given } => {
                Self::new(pointer, "control_character", "a name has no control characters")
                    .given(given.as_str())
            }
            InvalidReason::UnknownVehicle { given } => {
                Self::new(pointer, "unknown_vehicle", "no vehicle in `auvs` has this id")
                    .given(given.as_str())
            }
            InvalidReason::Incomplete { detail } => Self::new(pointer, "missing", *detail),
            InvalidReason::Unexpected { detail } => Self::new(pointer, "unexpected", *detail),
            InvalidReason::UnknownPreset { given, known } => unknown_preset(pointer, given, known),
            InvalidReason::AllZero => Self::new(pointer, "all_zero", "at least one of them must be above 0"),
            InvalidReason::NoPath { given: Some(given) } => {
                Self::new(pointer, "no_path", "this vehicle has no `path`").given(given.as_str())
            }
            InvalidReason::NoPath { given: None } => Self::new(
                pointer,
                "no_path",
                "only a goal that follows one vehicle at a time has a path",
            ),
            InvalidReason::NotIncreasing { given, before } => Self::new(
                pointer,
                "not_increasing",
                format!("must come after {before} s, the time before it"),
            )
            .given(*given)
            .limit(json!({ "above": before })),
            InvalidReason::NegativeVariance { given } => Self::new(
                pointer,
                "negative_variance",
                format!("no covariance has the eigenvalue {given}"),
            )
            .given(*given)
            .limit(json!({ "least": 0 })),
            InvalidReason::Gap { given, most } => above_most(
                pointer,
                "gap",
                format!("begins {given} m from where the path is"),
                *given,
                *most,
            ),
            InvalidReason::Kink { given, most } => above_most(pointer, "kink", kink(*given), *given, *most),
            InvalidReason::Fillet { given, most } => {
                above_most(pointer, "fillet", fillet(*most), *given, *most)
            }
            InvalidReason::OnePlace { .. } => Self::new(pointer, "one_place", invalid.reason.to_string()),
            InvalidReason::NotConvex { given } => Self::new(
                pointer,
                "not_convex",
                "the corners, in order, must go once round a convex area; this one does not fit",
            )
            .given(*given)
            .limit(json!({ "least": 0.0 })),
            InvalidReason::TooNear { given, least } => below_least(
                pointer,
                "too_near",
                format!("is {given} m from the corner before it; give every corner once"),
                *given,
                *least,
            ),
            InvalidReason::TooNarrow { given, least } => below_least(
                pointer,
                "too_narrow",
                format!("the area is only {given} m wide"),
                *given,
                *least,
            ),
        }
    }
}

fn kink(given: f64) -> String {
    format!("the path turns by {given} rad at a point; put an arc there, or way-points without `fillet_m`")
}

fn fillet(most: f64) -> String {
    format!(
        "the legs that meet here have room for fillets of {most} m only; without `fillet_m` every corner gets the radius \
         that fits"
    )
}

fn unknown_preset(pointer: String, given: &str, known: &[&str]) -> FieldError {
    let detail = format!("the known craft are {}", known.join(", "));
    FieldError::new(pointer, "unknown_preset", detail)
        .given(given)
        .limit(json!(known))
}

fn below_least(pointer: String, code: &str, detail: String, given: f64, least: f64) -> FieldError {
    FieldError::new(pointer, code, detail)
        .given(given)
        .limit(json!({ "least": least }))
}

fn above_most(pointer: String, code: &str, detail: String, given: f64, most: f64) -> FieldError {
    FieldError::new(pointer, code, detail)
        .given(given)
        .limit(json!({ "most": most }))
}

pub(super) fn length(pointer: String, given: usize, range: RangeInclusive<usize>, unit: &str) -> FieldError {
    let (least, most) = range.into_inner();
    FieldError::new(pointer, "length", format!("must have {least} to {most} {unit}"))
        .given(given)
        .limit(json!({ "least": least, "most": most }))
}
