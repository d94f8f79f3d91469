//! Errors about members of a scenario that do not fit the others.

use std::fmt::Display;

/// A member of a scenario that does not fit the others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct InvalidScenario {
    /// The member, as `auvs[0].path`.
    pub field: String,
    /// The mistake, with the value and the limit.
    pub reason: String,
}

pub(super) fn invalid(field: impl Into<String>, reason: impl Display) -> InvalidScenario {
    InvalidScenario {
        field: field.into(),
        reason: reason.to_string(),
    }
}
