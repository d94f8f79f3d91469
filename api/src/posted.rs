//! JSON bodies, every rejection of which is a [`Problem`] that points at the fault.

use std::time::Duration;

use axum::{
    body::Bytes,
    extract::{
        FromRef, FromRequest, Request,
        rejection::{BytesRejection, FailedToBufferBody},
    },
    http::{HeaderMap, header},
};
use http_body::Body as _;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};
use serde_path_to_error::{Path, Segment};

use crate::problem::{FieldError, Problem};

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;

/// What UTF-8 text from some editors begins with, and JSON must not (RFC 8259, section 8.1).
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Longest time for a body to arrive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyTimeLimit(pub(crate) Duration);

/// A body that was JSON of the shape `T`.
#[derive(Debug)]
pub(crate) struct Posted<T>(pub(crate) T);

impl<T, S> FromRequest<S> for Posted<T>
where
    T: DeserializeOwned + Serialize,
    S: Send + Sync,
    BodyTimeLimit: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        require_json(request.headers())?;
        require_uncoded(request.headers())?;
        require_short(request.headers())?;
        let BodyTimeLimit(limit) = BodyTimeLimit::from_ref(state);
        let body = tokio::time::timeout(limit, Bytes::from_request(request, state))
            .await
            .map_err(|_| Problem::BodyTimedOut { limit })?
            .map_err(|rejection| match rejection {
                BytesRejection::FailedToBufferBody(FailedToBufferBody::LengthLimitError(_)) => {
                    Problem::TooLarge {
                        limit: BODY_BYTES_MAX,
                    }
                }
                _ => Problem::BodyUnreadable,
            })?;
        parse(&body).map(Self)
    }
}

/// A body of the shape `T`, or none, which means its default.
#[derive(Debug)]
pub(crate) struct PostedOrNothing<T>(pub(crate) T);

impl<T, S> FromRequest<S> for PostedOrNothing<T>
where
    T: DeserializeOwned + Serialize + Default,
    S: Send + Sync,
    BodyTimeLimit: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        if request.body().is_end_stream() {
            return Ok(Self(T::default()));
        }
        let Posted(posted) = Posted::from_request(request, state).await?;
        Ok(Self(posted))
    }
}

fn require_json(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(given) = headers.get(header::CONTENT_TYPE) else {
        return Err(Problem::NotJson { given: None });
    };
    let given = String::from_utf8_lossy(given.as_bytes());
    let mut parts = given.split(';').map(|part| part.trim().to_ascii_lowercase());
    let essence = parts.next().unwrap_or_default();
    if essence != "application/json" && !(essence.starts_with("application/") && essence.ends_with("+json")) {
        return Err(Problem::NotJson {
            given: Some(given.into_owned()),
        });
    }
    for parameter in parts {
        let charset = parameter
            .strip_prefix("charset=")
            .map(|name| name.trim_matches('"'));
        if charset.is_some_and(|name| name != "utf-8") {
            return Err(Problem::NotUtf8 {
                given: given.into_owned(),
            });
        }
    }
    Ok(())
}

fn require_uncoded(headers: &HeaderMap) -> Result<(), Problem> {
    for given in headers.get_all(header::CONTENT_ENCODING) {
        let given = String::from_utf8_lossy(given.as_bytes());
        if given
            .split(',')
            .any(|coding| !coding.trim().eq_ignore_ascii_case("identity"))
        {
            return Err(Problem::Coded {
                given: given.into_owned(),
            });
        }
    }
    Ok(())
}

/// A length that is no number is refused by hyper, and a body without one while it is read.
fn require_short(headers: &HeaderMap) -> Result<(), Problem> {
    let announced = headers.get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    if announced.is_some_and(|length| BODY_BYTES_MAX < length) {
        return Err(Problem::TooLarge {
            limit: BODY_BYTES_MAX,
        });
    }
    Ok(())
}

/// Reads `body` twice: first whether it is JSON at all, every ignored member of it too, then for what
/// is meant. What the second reading refuses is therefore never a matter of syntax.
pub(crate) fn parse<T: DeserializeOwned + Serialize>(body: &[u8]) -> Result<T, Problem> {
    let given: Value = read(body).map_err(|(pointer, error)| {
        let detail = if body.starts_with(BYTE_ORDER_MARK) {
            "starts with a byte order mark: send UTF-8 without one".to_owned()
        } else {
            plain_syntax(&error.to_string())
        };
        Problem::Syntax(Box::new(FieldError::new(pointer, "syntax", detail)))
    })?;
    let parsed =
        read(body).map_err(|(pointer, error)| Problem::Invalid(vec![misfit(&given, pointer, &error)]))?;
    let meant = serde_json::to_value(&parsed).expect("shapes have finite numbers and members with names");
    match misread(&given, &meant) {
        Some(error) => Err(Problem::Invalid(vec![error])),
        None => Ok(parsed),
    }
}

fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, (String, serde_json::Error)> {
    let mut json = serde_json::Deserializer::from_slice(body);
    let value = serde_path_to_error::deserialize(&mut json)
        .map_err(|error| (pointer(error.path()), error.into_inner()))?;
    json.end().map_err(|error| (String::new(), error))?;
    Ok(value)
}

/// serde_json's words where they are about its own reading and not about the text.
fn plain_syntax(detail: &str) -> String {
    let (what, place) = detail.split_once(" at line ").unwrap_or((detail, "1"));
    let what = match what {
        "expected ident" | "expected value" => "there is no JSON value",
        "number out of range" => "the number is too large",
        "recursion limit exceeded" => "nested too deeply",
        ended if ended.starts_with("EOF") => "the text ends before the value does",
        other => other,
    };
    format!("{what} at line {place}")
}

/// Why JSON does not have the shape. serde has these as prose only; the tests pin the prose.
fn misfit(given: &Value, mut pointer: String, error: &serde_json::Error) -> FieldError {
    let detail = error.to_string();
    let detail = detail
        .rsplit_once(" at line ")
        .map_or(detail.as_str(), |(what, _)| what);
    let expected = detail.rsplit(", expected ").next().unwrap_or_default();
    let named = [
        ("missing field `", "missing", "must be given"),
        ("duplicate field `", "duplicate_field", "stands twice"),
    ];
    for (prefix, code, plain) in named {
        if let Some(rest) = detail.strip_prefix(prefix) {
            // The path ends above the member that the text names.
            push_token(&mut pointer, rest.trim_end_matches('`'));
            return FieldError::new(pointer, code, plain);
        }
    }
    if detail.starts_with("unknown field `") {
        let known = expected.trim_start_matches("one of ");
        return FieldError::new(
            pointer,
            "unknown_field",
            format!("there is no such member, only {known}"),
        );
    }
    if detail.starts_with("unknown variant `") {
        return FieldError::new(pointer, "unknown_variant", format!("must be {expected}"));
    }
    // serde_json counts where there are too few, and takes the first too many for a mistake in the text.
    let too_many = detail == "trailing characters";
    let list = (too_many || expected.starts_with("an array of length "))
        .then(|| fixed_list(&pointer))
        .flatten();
    let given = given.pointer(&pointer);
    if let (Some((n_items, what)), Some(Value::Array(items))) = (list, given) {
        let n_given = items.len();
        let detail = format!("must have {n_items} items, not {n_given}: {what}");
        return FieldError::new(pointer, "length", detail)
            .given(n_given)
            .limit(json!({ "least": n_items, "most": n_items }));
    }
    let expected = match (list, expected) {
        (Some((_, what)), _) => what,
        (None, "f64") => "a number",
        (None, "a boolean") => "true or false",
        (None, "a sequence") => "a list",
        (None, map) if too_many || map == "a map" || map.starts_with("struct ") => "an object",
        // Text, and the names of variants, of which serde_json says only that no value is there.
        (None, _) => "text",
    };
    let given = given.map_or("this", type_name);
    FieldError::new(pointer, "wrong_type", format!("must be {expected}, not {given}"))
}

/// How many items the list at `pointer` always has, and what it is: a matrix, a row of one, or a point.
fn fixed_list(pointer: &str) -> Option<(usize, &'static str)> {
    let mut tokens = pointer.rsplit('/');
    match (tokens.next()?, tokens.next()?) {
        ("covariance", _) => Some((
            4,
            "a symmetric positive semidefinite 4×4 matrix, a list of 4 rows",
        )),
        (_, "covariance") => Some((
            4,
            "a row of 4 numbers of a symmetric positive semidefinite 4×4 matrix",
        )),
        ("from" | "to" | "centre", _) | (_, "points" | "area") => {
            Some((2, "a point, a list of its north and east"))
        }
        _ => None,
    }
}

/// The first place that serde took for something else: a list for an object, members by their order,
/// where `[1, 2]` says nothing of north and east; or `{"track": null}` for the name `track`.
fn misread(given: &Value, meant: &Value) -> Option<FieldError> {
    let below = |token: &str, given: &Value, meant: &Value| {
        let mut error = misread(given, meant)?;
        let mut pointer = String::new();
        push_token(&mut pointer, token);
        error.pointer.insert_str(0, &pointer);
        Some(error)
    };
    match (given, meant) {
        (Value::Array(given), Value::Array(meant)) => given
            .iter()
            .zip(meant)
            .enumerate()
            .find_map(|(i, (given, meant))| below(&i.to_string(), given, meant)),
        (Value::Object(given), Value::Object(meant)) => meant
            .iter()
            .find_map(|(name, meant)| below(name, given.get(name)?, meant)),
        (Value::Array(_) | Value::Object(_), _) => {
            let detail = format!("must be {}, not {}", type_name(meant), type_name(given));
            Some(FieldError::new("", "wrong_type", detail))
        }
        _ => None,
    }
}

fn type_name(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

fn pointer(path: &Path) -> String {
    let mut pointer = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => push_token(&mut pointer, &index.to_string()),
            Segment::Map { key } => push_token(&mut pointer, key),
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointer
}

/// Source: RFC 6901, section 3.
fn push_token(pointer: &mut String, token: &str) {
    /// Longest name of a member that is repeated, characters.
    const TOKEN_LENGTH_MAX: usize = 80;
    pointer.push('/');
    let short: String = token.chars().take(TOKEN_LENGTH_MAX).collect();
    pointer.push_str(&short.replace('~', "~0").replace('/', "~1"));
}
