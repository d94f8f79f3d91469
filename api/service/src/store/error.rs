//! Why the event store does not do what it should.

use std::{
    fmt::Display,
    path::{Path, PathBuf},
};

use rusqlite::ErrorCode;

/// Why the event store does not do what it should. Its messages call the store the mission log.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// The directory or the file cannot be used.
    #[error("cannot open the mission log {path}: {reason}")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file was written by a later version of this program.
    #[error(
        "the mission log {path} has schema {found}, this program knows up to {known}: use the newer program"
    )]
    TooNew {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: u32,
        /// The newest known.
        known: u32,
    },
    /// The file was written by an earlier version of this program.
    #[error(
        "the mission log {path} has schema {found}, this program reads {known}: start the service once, which brings \
         it there"
    )]
    TooOld {
        /// The file.
        path: PathBuf,
        /// Its schema.
        found: u32,
        /// What is read.
        known: u32,
    },
    /// Another program writes to it.
    #[error(
        "the mission log {path} is in use by another pilotfish: stop that one, or choose another --data directory"
    )]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// There is no room.
    #[error("the disk under the mission log is full: nothing was stored; make room and send it again")]
    Full,
    /// What was written cannot be read back as it was.
    #[error("the mission log is damaged: {0}")]
    Damaged(String),
    /// The mission was deleted.
    #[error("the mission was deleted")]
    Gone,
    /// The disk does not take it.
    #[error("the mission log cannot be written: {0}; nothing was stored")]
    Refused(String),
    /// More is to be written than the disk takes.
    #[error("the mission log is behind: nothing was stored; try again in a moment")]
    Busy,
    /// The writer has ended.
    #[error("the mission log is closed")]
    Closed,
}

impl StoreError {
    pub(super) fn open(path: &Path, reason: &dyn Display) -> Self {
        Self::Open {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        let text = error.to_string();
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => Self::Damaged(text),
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Busy,
            _ => Self::Refused(text),
        }
    }
}
