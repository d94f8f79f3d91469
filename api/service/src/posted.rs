//! JSON bodies, every rejection of which is a [`Problem`].

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
use serde::de::DeserializeOwned;

use crate::problem::Problem;
use wire::Unread;

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;

/// Longest time for a body to arrive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyTimeLimit(pub(crate) Duration);

/// A body that was JSON of the shape `T`.
#[derive(Debug)]
pub(crate) struct Posted<T>(pub(crate) T);

impl<T, S> FromRequest<S> for Posted<T>
where
    T: DeserializeOwned,
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
            .map_err(|_| Problem::BodyTimedOut(limit))?
            .map_err(|rejection| match rejection {
                BytesRejection::FailedToBufferBody(FailedToBufferBody::LengthLimitError(_)) => {
                    Problem::TooLarge
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
    T: DeserializeOwned + Default,
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
        return Err(Problem::NotJson(None));
    };
    let given = String::from_utf8_lossy(given.as_bytes());
    let mut parts = given.split(';').map(|part| part.trim().to_ascii_lowercase());
    let essence = parts.next().unwrap_or_default();
    if essence != "application/json" && !(essence.starts_with("application/") && essence.ends_with("+json")) {
        return Err(Problem::NotJson(Some(given.into_owned())));
    }
    for parameter in parts {
        let charset = parameter
            .strip_prefix("charset=")
            .map(|name| name.trim_matches('"'));
        if charset.is_some_and(|name| name != "utf-8") {
            return Err(Problem::NotUtf8(given.into_owned()));
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
            return Err(Problem::Coded(given.into_owned()));
        }
    }
    Ok(())
}

/// A length that is no number is refused by hyper, and a body without one while it is read.
fn require_short(headers: &HeaderMap) -> Result<(), Problem> {
    let announced = headers.get(header::CONTENT_LENGTH);
    let announced = announced.and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    if announced.is_some_and(|length| BODY_BYTES_MAX < length) {
        return Err(Problem::TooLarge);
    }
    Ok(())
}

/// The `T` that `body` is.
pub(crate) fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
    wire::read(body).map_err(|unread| match unread {
        Unread::Syntax(error) => Problem::Syntax(error),
        Unread::Misfit(error) => Problem::Invalid(vec![*error]),
    })
}
