//! The state of a mission that a caller has seen.

use axum::http::HeaderValue;
use wire::mission::Mission;

use crate::edge::problem::Problem;

/// The revisions of a mission for which a call is meant; none for any.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct IfMatch(Option<Vec<u64>>);

impl IfMatch {
    /// Fails if `mission` has another revision.
    pub(super) fn check(&self, mission: &Mission) -> Result<(), Problem> {
        match &self.0 {
            Some(revisions) if !revisions.contains(&mission.revision) => Err(Problem::Changed {
                revision: mission.revision,
                since: Vec::new(),
            }),
            Some(_) | None => Ok(()),
        }
    }

    /// The tags of a header: quoted entity tags, separated by commas. Weak tags match no mission.
    pub(super) fn of(header: &HeaderValue) -> Option<Self> {
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
