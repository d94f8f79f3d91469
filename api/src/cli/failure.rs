//! Failures of commands, in words.

use std::error::Error;

/// A failure and its cause, which is printed after it.
#[derive(Debug, thiserror::Error)]
#[error("{what}")]
pub(crate) struct Failure {
    what: String,
    source: Box<dyn Error + Send + Sync>,
}

/// The failure in these words that an error causes.
pub(crate) fn because_of<E: Into<Box<dyn Error + Send + Sync>>>(
    what: impl Into<String>,
) -> impl FnOnce(E) -> Failure {
    let what = what.into();
    |error| Failure { what, source: error.into() }
}
