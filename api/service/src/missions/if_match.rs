//! The state of a mission that a caller has seen.

use axum::extract::FromRequestParts;
use axum::http::HeaderValue;
use axum::http::request::Parts;
use wire::mission::Mission;

use crate::edge::{problem::Problem, query::wrong_parameter};

/// The revisions for which a call is meant, from `If-Match`; `*` and a missing header match any.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct IfMatch(Option<Vec<u64>>);

impl IfMatch {
    /// Fails if `mission` has another revision.
    pub(super) fn check(&self, mission: &Mission) -> Result<(), Problem> {
        match &self.0 {
            Some(revisions) if !revisions.contains(&mission.revision) => {
                Err(Problem::Changed { revision: mission.revision, since: Vec::new() })
            }
            Some(_) | None => Ok(()),
        }
    }

    /// The tags of a header: quoted entity tags, separated by commas. Weak tags match no mission.
    fn of(header: &HeaderValue) -> Option<Self> {
        let text = header.to_str().ok()?.trim();
        if text == "*" {
            return Some(Self(None));
        }
        let mut revisions = Vec::new();
        for tag in text.split(',').map(str::trim) {
            let strong = tag.strip_prefix("W/").unwrap_or(tag);
            let opaque = strong.strip_prefix('"')?.strip_suffix('"')?;
            if strong == tag {
                revisions.extend(opaque.parse::<u64>().ok());
            }
        }
        Some(Self(Some(revisions)))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for IfMatch {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let mut given = parts.headers.get_all("if-match").iter();
        match (given.next(), given.next()) {
            (None, _) => Ok(Self::default()),
            (Some(header), None) if let Some(tags) = Self::of(header) => Ok(tags),
            (Some(_), _) => {
                let detail = "this header must be the ETag of a mission, in quotes, or *";
                Err(wrong_parameter("If-Match", "if_match", detail))
            }
        }
    }
}
