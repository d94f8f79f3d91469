//! Errors of the event store. Messages call the store the mission log.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;

/// An error of the event store.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    #[error("cannot open the mission log {0}: {1}")]
    Open(PathBuf, String),
    #[error(
        "the mission log {0} has schema {1}, but this program knows schemas up to {2}: use the newer program"
    )]
    TooNew(PathBuf, u32, u32),
    #[error(
        "the mission log {0} has schema {1}, but this program reads {2}: start the service once to migrate it"
    )]
    TooOld(PathBuf, u32, u32),
    #[error(
        "the mission log {0} is in use by another pilotfish: stop it, or choose another --data directory"
    )]
    InUse(PathBuf),
    #[error(
        "the service had tokens, but {} holds none: restore the file from a backup, or create tokens with pilotfish token add",
        .0.display()
    )]
    Unprotected(PathBuf),
    #[error(
        "the disk of the mission log is full: nothing was stored; free some space and send the request again"
    )]
    Full,
    #[error(
        "the data directory was deleted or replaced while the service was running: {0} {1}. Nothing more is stored: stop \
         the service, put the directory back, and start the service again"
    )]
    Displaced(PathBuf, String),
    #[error("cannot write the list of acknowledged events: {0}; send the request again with the same key")]
    Unconfirmed(String),
    #[error(
        "the mission log was set back to an older state while the service was running: {0}. Nothing more is stored: stop all services of \
         this log, restore its newest state, and start them again"
    )]
    SetBack(String),
    #[error("the mission log is damaged: {0}")]
    Damaged(String),
    #[error("the mission was deleted")]
    Gone,
    #[error("cannot write the mission log: {0}; nothing was stored")]
    Refused(String),
    #[error("the mission log cannot be reached: {0}; nothing was stored")]
    Unavailable(String),
    #[error("this service may have lost the mission: its lease was not renewed in time")]
    Lapsed,
    #[error(
        "another program has locked the mission log: nothing was stored; end what has it open (a database viewer with unsaved \
         changes, a backup, a script) and try again"
    )]
    Locked,
    #[error("the mission log is overloaded: nothing was stored; try again in a moment")]
    Busy,
    #[error("the mission log failed before it answered: send the request again with the same key")]
    Unanswered,
    #[error("the mission log is closed")]
    Closed,
}

impl StoreError {
    pub(super) fn open(path: &Path, reason: &dyn Display) -> Self {
        Self::Open(path.to_owned(), reason.to_string())
    }

    /// Names the file of an error.
    pub(super) fn at<E: Display>(path: &Path) -> impl Fn(E) -> Self {
        move |error| Self::open(path, &error)
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        let text = error.to_string();
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => Self::Damaged(text),
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Locked,
            _ => Self::Refused(text),
        }
    }
}
