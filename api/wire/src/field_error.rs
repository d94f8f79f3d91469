//! A wrong field of a request: its place, its fault and the accepted values.

use std::{fmt::Display, ops::RangeInclusive};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::ToSchema;

/// Longest part of a request that a document repeats, characters.
const QUOTE_LENGTH_MAX: usize = 200;

/// One wrong field of a request: a member of its body, or a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FieldError {
    /// Its place, as a JSON pointer (RFC 6901); empty for the whole body and for a parameter.
    pub pointer: String,
    /// Name of the faulty parameter of the query or header, if it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
    /// The fault, for programs.
    pub code: String,
    /// The fault, for people.
    pub detail: String,
    /// The given value, if it is a number or a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Value)]
    pub given: Option<Value>,
    /// The accepted values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Value)]
    pub limit: Option<Value>,
}

impl FieldError {
    /// An error at `pointer`.
    pub fn new(pointer: impl Into<String>, code: &str, detail: impl Into<String>) -> Self {
        Self {
            pointer: pointer.into(),
            parameter: None,
            code: code.to_owned(),
            detail: shortened(detail.into()),
            given: None,
            limit: None,
        }
    }

    /// An error in the parameter `name`.
    #[must_use]
    pub fn of_parameter(name: &str, code: &str, detail: impl Into<String>) -> Self {
        Self {
            parameter: Some(shortened(name.to_owned())),
            ..Self::new("", code, detail)
        }
    }

    /// A time at `pointer`, s, outside its range around `now` on `clock`. States the difference: if
    /// the client meant the present, the skew of its clock.
    pub fn off_the_clock(
        pointer: impl Into<String>,
        given: f64,
        clock: &str,
        now: f64,
        range: &RangeInclusive<f64>,
    ) -> Self {
        let (least, most) = (*range.start(), *range.end());
        let (side, allowed) = if given < least {
            ("behind", now - least)
        } else {
            ("ahead of", most - now)
        };
        let apart = (given - now).abs();
        let detail = format!(
            "is {apart:.1} s {side} {clock}, which shows {now:.1} s, and at most {allowed} s is accepted: set the clock \
             that times are taken from"
        );
        Self {
            detail,
            ..Self::out_of_range(pointer, given, least, most)
        }
    }

    /// A list or a text at `pointer` with `given` items or bytes, more than `most`.
    pub fn too_long(pointer: impl Into<String>, given: usize, most: usize) -> Self {
        Self::new(
            pointer,
            "too_long",
            format!("must be at most {most} long, not {given}"),
        )
        .given(given)
        .limit(json!({ "most": most }))
    }

    /// The error of a number at `pointer` outside its range.
    pub fn outside<T: Copy + Display + PartialOrd + Serialize>(
        pointer: impl Into<String>,
        given: T,
        range: &RangeInclusive<T>,
    ) -> Option<Self> {
        (!range.contains(&given)).then(|| Self::out_of_range(pointer, given, *range.start(), *range.end()))
    }

    pub(crate) fn out_of_range<T: Copy + Display + Serialize>(
        pointer: impl Into<String>,
        given: T,
        least: T,
        most: T,
    ) -> Self {
        Self::new(pointer, "out_of_range", format!("must be from {least} to {most}"))
            .given(json!(given))
            .limit(json!({ "least": least, "most": most }))
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
#[must_use]
pub fn shortened(text: String) -> String {
    match text.char_indices().nth(QUOTE_LENGTH_MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
