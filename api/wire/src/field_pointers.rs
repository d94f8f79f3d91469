//! Converts the planner's faults of fields to those of problem documents.

use std::ops::RangeInclusive;

use planner::snapshot::{ANGLE, InvalidField, InvalidReason};
use serde_json::json;

use crate::{DIRECTIONS, FieldError};

impl From<&InvalidField> for FieldError {
    fn from(invalid: &InvalidField) -> Self {
        let InvalidField { field, reason } = invalid;
        let pointer = format!("/{field}");
        let of = |code: &str| Self::new(pointer.as_str(), code, reason.to_string());
        match reason {
            InvalidReason::OutOfRange { given, least, most } => {
                perhaps_degrees(Self::out_of_range(pointer, *given, *least, *most), *given)
            }
            InvalidReason::OffTheClock {
                given,
                now,
                least,
                most,
            } => Self::off_the_clock(pointer, *given, "the request's `t_s`", *now, &(*least..=*most)),
            InvalidReason::Horizon { given, least, most } => of("out_of_range")
                .given(*given)
                .limit(json!({ "least": least, "most": most })),
            InvalidReason::Effort {
                steps,
                iterations,
                most,
            } => of("out_of_range")
                .given(steps * iterations)
                .limit(json!({ "most": most })),
            InvalidReason::Length {
                unit,
                given,
                least,
                most,
            } => length(pointer, *given, *least..=*most, unit),
            InvalidReason::Duplicate { given } => {
                Self::new(pointer, "duplicate", "duplicate name").given(given.as_str())
            }
            InvalidReason::ControlCharacter { given } => {
                Self::new(pointer, "control_character", "a name has no control characters")
                    .given(given.as_str())
            }
            InvalidReason::UnknownVehicle { given } => {
                Self::new(pointer, "unknown_vehicle", "no vehicle in `auvs` has this id")
                    .given(given.as_str())
            }
            InvalidReason::UnknownPreset { given, known } => {
                let detail = format!("the known craft are {}", known.join(", "));
                Self::new(pointer, "unknown_preset", detail)
                    .given(given.as_str())
                    .limit(json!(known))
            }
            InvalidReason::NoPath { given } => {
                Self::new(pointer, "no_path", "this vehicle has no `path`").given(given.as_str())
            }
            InvalidReason::NoCommonPath => of("no_path"),
            InvalidReason::Incomplete { .. } => of("missing"),
            InvalidReason::Unexpected { .. } => of("unexpected"),
            InvalidReason::AllZero => of("all_zero"),
            InvalidReason::OnePlace { .. } => of("one_place"),
            InvalidReason::NotIncreasing { given, before } => of("not_increasing")
                .given(*given)
                .limit(json!({ "above": before })),
            InvalidReason::NegativeVariance { given } => {
                of("negative_variance").given(*given).limit(json!({ "least": 0 }))
            }
            InvalidReason::NotConvex { given } => {
                of("not_convex").given(*given).limit(json!({ "least": 0.0 }))
            }
            InvalidReason::Gap { given, most } => of("gap").given(*given).limit(json!({ "most": most })),
            InvalidReason::Kink { given, most } => of("kink").given(*given).limit(json!({ "most": most })),
            InvalidReason::Fillet { given, most } => {
                let detail = format!("{reason}; without `fillet_m` every corner gets the radius that fits");
                Self::new(pointer, "fillet", detail)
                    .given(*given)
                    .limit(json!({ "most": most }))
            }
            InvalidReason::TooNear { given, least } => {
                of("too_near").given(*given).limit(json!({ "least": least }))
            }
            InvalidReason::TooNarrow { given, least } => {
                of("too_narrow").given(*given).limit(json!({ "least": least }))
            }
        }
    }
}

/// Asks whether an angle of more than a turn is in degrees.
fn perhaps_degrees(mut error: FieldError, given: f64) -> FieldError {
    let name = error.pointer.rsplit('/').next().unwrap_or_default();
    // An earlier answer has radians.
    if name.ends_with("_rad") && !ANGLE.contains(&given) && !error.pointer.contains("/previous_plan/") {
        error.detail += " rad: may be degrees";
        if let Some([degrees, _]) = DIRECTIONS.iter().find(|[_, radians]| name == *radians) {
            error.detail.extend([": `", degrees, "`"]);
        }
    }
    error
}

pub(super) fn length(pointer: String, given: usize, range: RangeInclusive<usize>, unit: &str) -> FieldError {
    let (least, most) = range.into_inner();
    FieldError::new(pointer, "length", format!("must have {least} to {most} {unit}"))
        .given(given)
        .limit(json!({ "least": least, "most": most }))
}
