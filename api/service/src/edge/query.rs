//! Query parameters.

use std::{collections::HashSet, fmt::Display};

use axum::{extract::FromRequestParts, http::request::Parts};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::json;
use wire::FieldError;

use crate::edge::problem::Problem;

/// The query of a request. Its faults are [`Problem`]s.
pub(crate) struct ValidQuery<T>(pub(crate) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for ValidQuery<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let query = parts.uri.query().unwrap_or_default().as_bytes();
        let mut names = HashSet::new();
        for (name, _) in form_urlencoded::parse(query) {
            if let Some(twice) = names.replace(name) {
                return Err(wrong_parameter(&twice, "duplicate_field", "is given twice"));
            }
        }
        let pairs = serde_urlencoded::Deserializer::new(form_urlencoded::parse(query));
        let read = serde_path_to_error::deserialize(pairs).map_err(|error| {
            let name = error.path().to_string();
            let detail = match error.into_inner().to_string() {
                text if text.contains("float literal") => "must be a number".to_owned(),
                text if text.contains("invalid digit") => "must be a whole number, 0 or more".to_owned(),
                text => text,
            };
            wrong_parameter(&name, "query", detail)
        });
        read.map(Self)
    }
}

pub(crate) fn wrong_parameter(name: &str, code: &str, detail: impl Into<String>) -> Problem {
    Problem::Invalid(vec![FieldError::of_parameter(name, code, detail)])
}

pub(crate) fn out_of_range<T: Display + Serialize>(name: &str, given: T, least: i32, most: T) -> Problem {
    let detail = format!("must be from {least} to {most}");
    let error = FieldError::of_parameter(name, "out_of_range", detail).given(json!(given));
    Problem::Invalid(vec![error.limit(json!({ "least": least, "most": most }))])
}
