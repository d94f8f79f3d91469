//! JSON bodies, every rejection of which is a [`Problem`] that points at the fault.

use axum::{
    body::Bytes,
    extract::{
        FromRequest, Request,
        rejection::{BytesRejection, FailedToBufferBody},
    },
    http::{HeaderMap, header},
};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, error::Category};
use serde_path_to_error::{Path, Segment};

use crate::problem::{FieldError, Problem};

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;

/// A body that was JSON of the shape `T`.
#[derive(Debug)]
pub(crate) struct Posted<T>(pub(crate) T);

impl<T: DeserializeOwned + Serialize, S: Send + Sync> FromRequest<S> for Posted<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        require_json(request.headers())?;
        let body = Bytes::from_request(request, state)
            .await
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

fn require_json(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(given) = headers.get(header::CONTENT_TYPE) else {
        return Err(Problem::NotJson { given: None });
    };
    let given = String::from_utf8_lossy(given.as_bytes());
    let essence = given
        .split(';')
        .next()
        .unwrap_or_default()
        .trim()
        .to_ascii_lowercase();
    if essence == "application/json" || (essence.starts_with("application/") && essence.ends_with("+json")) {
        Ok(())
    } else {
        Err(Problem::NotJson {
            given: Some(given.into_owned()),
        })
    }
}

/// Reads `body` once, so the first fault on the way is the one reported, be it of syntax or of shape.
fn parse<T: DeserializeOwned + Serialize>(body: &[u8]) -> Result<T, Problem> {
    let mut json = serde_json::Deserializer::from_slice(body);
    let parsed = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let pointer = pointer(error.path());
        problem(pointer, error.inner())
    })?;
    json.end().map_err(|error| problem(String::new(), &error))?;
    forbid_lists_for_objects(body, &parsed)?;
    Ok(parsed)
}

/// serde takes a list for an object, members by their order. Here that is a mistake: `[1, 2]` says
/// nothing of north and east.
fn forbid_lists_for_objects<T: Serialize>(body: &[u8], parsed: &T) -> Result<(), Problem> {
    let (Ok(given), Ok(meant)) = (serde_json::from_slice(body), serde_json::to_value(parsed)) else {
        return Ok(());
    };
    match list_for_object(&given, &meant) {
        Some(pointer) => {
            let error = FieldError::new(pointer, "wrong_type", "invalid type: a list, expected an object");
            Err(Problem::Invalid(vec![error]))
        }
        None => Ok(()),
    }
}

/// The first place where `given` is a list and `meant` an object.
fn list_for_object(given: &Value, meant: &Value) -> Option<String> {
    let below = |token: &str, given: &Value, meant: &Value| {
        let rest = list_for_object(given, meant)?;
        let mut pointer = String::new();
        push_token(&mut pointer, token);
        Some(pointer + &rest)
    };
    match (given, meant) {
        (Value::Array(_), Value::Object(_)) => Some(String::new()),
        (Value::Array(given), Value::Array(meant)) => given
            .iter()
            .zip(meant)
            .enumerate()
            .find_map(|(i, (given, meant))| below(&i.to_string(), given, meant)),
        (Value::Object(given), Value::Object(meant)) => meant
            .iter()
            .find_map(|(name, meant)| below(name, given.get(name)?, meant)),
        _ => None,
    }
}

fn problem(mut pointer: String, error: &serde_json::Error) -> Problem {
    let detail = error.to_string();
    match error.classify() {
        Category::Syntax | Category::Eof | Category::Io => {
            Problem::Syntax(Box::new(FieldError::new(pointer, "syntax", detail)))
        }
        // serde has these as prose only; the tests pin the prose.
        Category::Data if detail.starts_with("missing field `") => {
            if let Some(name) = detail.split('`').nth(1) {
                push_token(&mut pointer, name);
            }
            Problem::Invalid(vec![FieldError::new(pointer, "missing", detail)])
        }
        Category::Data => {
            let code = ["unknown field", "unknown variant", "duplicate field"]
                .into_iter()
                .find(|prefix| detail.starts_with(prefix))
                .unwrap_or("wrong type");
            Problem::Invalid(vec![FieldError::new(pointer, &code.replace(' ', "_"), detail)])
        }
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
