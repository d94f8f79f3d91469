//! The store's files: locked by one writer, and checked before each acknowledgement.

use std::fs::{self, File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use super::error::StoreError;

/// The files of an open store.
///
/// The lock is `flock` on the database itself. It is independent of the directory's other files and
/// of SQLite's locks. Those end when this process closes any descriptor of the database, so every
/// connection is dropped before this.
#[derive(Debug)]
pub(super) struct OpenFiles {
    _database: File,
    /// The store's file first.
    files: Vec<(PathBuf, Identity)>,
}

/// Device and inode of a file.
type Identity = (u64, u64);

impl OpenFiles {
    /// Notes the locked `database` at `path` and its other files, which exist.
    pub(super) fn new(path: &Path, database: File) -> io::Result<Self> {
        let main = database.metadata()?;
        let mut files = vec![(path.to_owned(), (main.dev(), main.ino()))];
        for extension in ["sqlite3-wal", "sqlite3-shm"] {
            let beside = path.with_extension(extension);
            let identity = identity(&beside)?;
            files.push((beside, identity));
        }
        Ok(Self { _database: database, files })
    }

    pub(super) fn path(&self) -> &Path {
        &self.files[0].0
    }

    /// Fails if a file was deleted or replaced since the start: writes to it would be lost.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        for (path, opened) in &self.files {
            let why = match identity(path) {
                Ok(found) if found == *opened => continue,
                Ok(_) => "is another file".to_owned(),
                Err(error) => format!("cannot be found ({error})"),
            };
            return Err(StoreError::Displaced(path.clone(), why));
        }
        Ok(())
    }
}

fn identity(path: &Path) -> io::Result<Identity> {
    let file = fs::metadata(path)?;
    Ok((file.dev(), file.ino()))
}

pub(super) fn lock(database: &File, path: &Path) -> Result<(), StoreError> {
    match database.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse(path.to_owned())),
        Err(TryLockError::Error(error)) => Err(StoreError::open(path, &error)),
    }
}
