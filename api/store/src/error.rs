//! Errors of the event store. Messages call the store the mission log.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;

/// An error of the event store.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// The directory or the file cannot be used.
    #[error("cannot open the mission log {0}: {1}")]
    Open(PathBuf, String),
    /// The file was written by a later version of this program: its schema, and the newest known.
    #[error(
        "the mission log {0} has schema {1}, but this program knows schemas up to {2}: use the newer program"
    )]
    TooNew(PathBuf, u32, u32),
    /// The file was written by an earlier version of this program: its schema, and the one read.
    #[error(
        "the mission log {0} has schema {1}, but this program reads {2}: start the service once to migrate it"
    )]
    TooOld(PathBuf, u32, u32),
    /// Another program writes to it.
    #[error(
        "the mission log {0} is in use by another pilotfish: stop it, or choose another --data directory"
    )]
    InUse(PathBuf),
    /// The service had tokens, but has none now.
    #[error(
        "the service had tokens, but {} holds none: restore the file from a backup, or create tokens with pilotfish token add",
        .0.display()
    )]
    Unprotected(PathBuf),
    /// The disk is full.
    #[error(
        "the disk of the mission log is full: nothing was stored; free some space and send the request again"
    )]
    Full,
    /// A file of the store was deleted or replaced while it was open, and the fault of its path.
    #[error(
        "the data directory was deleted or replaced while the service was running: {0} {1}. Nothing more is stored: stop \
         the service, put the directory back, and start the service again"
    )]
    Displaced(PathBuf, String),
    /// The events are stored, but are missing from the list of acknowledged events.
    #[error("cannot write the list of acknowledged events: {0}; send the request again with the same key")]
    Unconfirmed(String),
    /// The store lacks acknowledged events: an older state of it was restored.
    #[error(
        "the mission log was set back to an older state while the service was running: {0}. Nothing more is stored: stop all services of \
         this log, restore its newest state, and start them again"
    )]
    SetBack(String),
    /// The file is damaged.
    #[error("the mission log is damaged: {0}")]
    Damaged(String),
    /// The mission was deleted.
    #[error("the mission was deleted")]
    Gone,
    /// The write failed.
    #[error("cannot write the mission log: {0}; nothing was stored")]
    Refused(String),
    /// The database cannot be reached, or refuses to write.
    #[error("the mission log cannot be reached: {0}; nothing was stored")]
    Unavailable(String),
    /// This service has not renewed its lease.
    #[error("this service may have lost the mission: its lease was not renewed in time")]
    Lapsed,
    /// Another program holds a lock for longer than a write may wait.
    #[error(
        "another program has locked the mission log: nothing was stored; end what has it open (a database viewer with unsaved \
         changes, a backup, a script) and try again"
    )]
    Locked,
    /// Too many writes wait for the disk.
    #[error("the mission log is overloaded: nothing was stored; try again in a moment")]
    Busy,
    /// The writer panicked or ended before it replied.
    #[error("the mission log failed before it answered: send the request again with the same key")]
    Unanswered,
    /// The writer has ended.
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
