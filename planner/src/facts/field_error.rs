//! A wrong field of a request: its place, its fault and the accepted values.

use std::fmt::{self, Display};
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::ranges::{ANGLE, DIRECTIONS};

/// Longest part of a request that a document repeats, characters.
const QUOTE_LENGTH_MAX: usize = 200;

/// `name` as a token of a JSON pointer. Source: RFC 6901, section 3.
pub fn pointer_token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// One wrong field of a request: a member of its body, or a parameter.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FieldError {
    /// Its place, as a JSON pointer (RFC 6901); empty for the whole body and for a parameter.
    pub pointer: String,
    /// Name of the faulty parameter of the query or header, if it is one.
    pub parameter: Option<String>,
    /// The fault, for programs.
    pub code: String,
    /// The fault, for people.
    pub detail: String,
    /// The given value, if it is a number or a name.
    #[schema(value_type = Value)]
    pub given: Option<Value>,
    /// The accepted values.
    #[schema(value_type = Value)]
    pub limit: Option<Value>,
}

impl Display for FieldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.pointer, self.words())
    }
}

impl std::error::Error for FieldError {}

impl FieldError {
    /// An error at `pointer`.
    pub fn new(pointer: impl Display, code: &str, detail: impl Into<String>) -> Self {
        Self {
            pointer: pointer.to_string(),
            parameter: None,
            code: code.to_owned(),
            detail: shortened(detail.into()),
            given: None,
            limit: None,
        }
    }

    /// An error in the parameter `name`.
    pub fn of_parameter(name: &str, code: &str, detail: impl Into<String>) -> Self {
        Self { parameter: Some(shortened(name.to_owned())), ..Self::new("", code, detail) }
    }

    /// A time at `pointer`, s, outside its range around `now` on `clock`. States the difference: if
    /// the client meant the present, the skew of its clock.
    pub fn off_the_clock(
        pointer: impl Display,
        given: f64,
        clock: &str,
        now: f64,
        range: &RangeInclusive<f64>,
    ) -> Self {
        let (least, most) = (*range.start(), *range.end());
        let (side, allowed) = if given < least { ("behind", now - least) } else { ("ahead of", most - now) };
        let apart = (given - now).abs();
        let units = [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")];
        // Small times are in range in many units.
        let unit = units.iter().find(|(of, _)| 1e3 <= given / of && range.contains(&(given / of)));
        let detail = if let Some((_, unit)) = unit {
            format!("is in {unit}: give seconds")
        } else {
            format!(
                "is {apart:.1} s {side} {clock}, which shows {now:.1} s, and at most {allowed} s is accepted: set the \
                 clock that times are taken from"
            )
        };
        Self { detail, ..Self::out_of_range(pointer, given, least, most) }
    }

    /// A list or a text at `pointer` with `given` items or bytes, more than `most`.
    pub fn too_long(pointer: impl Display, given: usize, most: usize) -> Self {
        Self::new(pointer, "too_long", format!("must be at most {most} long, not {given}"))
            .given(given)
            .limit(json!({ "most": most }))
    }

    /// The error of a list or text with too few or too many of `unit`, such as `items` or `bytes`.
    pub fn of_length(
        pointer: impl Display,
        given: usize,
        range: &RangeInclusive<usize>,
        unit: &str,
    ) -> Option<Self> {
        let (least, most) = (range.start(), range.end());
        (!range.contains(&given)).then(|| {
            Self::new(pointer, "length", format!("must have {least} to {most} {unit}"))
                .given(given)
                .limit(json!({ "least": least, "most": most }))
        })
    }

    /// The error of a number that is not above the previous one.
    pub fn not_increasing(pointer: impl Display, given: f64, before: f64) -> Self {
        let detail = format!("{given} must be greater than the previous value, {before}");
        let fault = Self::new(pointer, "not_increasing", detail);
        fault.given(given).limit(json!({ "above": before }))
    }

    /// The error of a number at `pointer` outside its range.
    pub fn outside<T: Copy + Display + PartialOrd + Serialize>(
        pointer: impl Display,
        given: T,
        range: &RangeInclusive<T>,
    ) -> Option<Self> {
        (!range.contains(&given)).then(|| Self::out_of_range(pointer, given, *range.start(), *range.end()))
    }

    /// Asks whether an angle of more than a turn is in degrees.
    fn out_of_range<T: Copy + Display + Serialize>(
        pointer: impl Display,
        given: T,
        least: T,
        most: T,
    ) -> Self {
        let mut error = Self::new(pointer, "out_of_range", format!("must be from {least} to {most}"))
            .given(json!(given))
            .limit(json!({ "least": least, "most": most }));
        let name = error.pointer.rsplit('/').next().unwrap_or_default();
        let given = error.given.as_ref().and_then(Value::as_f64);
        let is_turn = given.is_some_and(|given| ANGLE.contains(&given));
        // An earlier answer has radians.
        if name.ends_with("_rad") && !is_turn && !error.pointer.contains("/previous_plan/") {
            let degrees = DIRECTIONS.iter().find(|[_, radians]| name == *radians);
            error.detail += " rad, not degrees";
            if let Some([degrees, _]) = degrees {
                error.detail.extend([" (`", degrees, "` takes degrees)"]);
            }
        }
        error
    }

    /// The fault and the given value, for people.
    pub fn words(&self) -> String {
        match &self.given {
            Some(given) => format!("{} (given: {given})", self.detail),
            None => self.detail.clone(),
        }
    }

    /// The same error with `place` before its pointer.
    #[must_use]
    pub fn within(mut self, place: &str) -> Self {
        self.pointer.insert_str(0, place);
        self
    }

    /// Adds the given value.
    #[must_use]
    pub fn given(mut self, given: impl Into<Value>) -> Self {
        self.given = Some(match given.into() {
            Value::String(text) => Value::String(shortened(text)),
            other => other,
        });
        self
    }

    /// Adds the accepted values.
    #[must_use]
    pub fn limit(mut self, limit: impl Into<Value>) -> Self {
        self.limit = Some(limit.into());
        self
    }
}

/// `text`, cut to the length that a document repeats.
pub fn shortened(text: String) -> String {
    match text.char_indices().nth(QUOTE_LENGTH_MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
