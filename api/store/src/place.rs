//! The store's files: locked by one writer, and compared with what is at their paths before anything is acknowledged.

use std::{
    fs::{self, File, TryLockError},
    io,
    os::unix::fs::MetadataExt as _,
    path::{Path, PathBuf},
};

use super::error::StoreError;

/// The files of an open store.
///
/// The lock is one of `flock`, on the database itself: it holds whatever happens to other files of the directory, and is
/// independent of SQLite's own locks. Those end when any descriptor of the database is closed in this process, so every
/// connection is dropped before the last handle of this.
#[derive(Debug)]
pub(super) struct Place {
    _database: File,
    files: Vec<(PathBuf, Identity)>,
}

/// Device and inode of a file.
type Identity = (u64, u64);

impl Place {
    /// The locked `database` at `path`, once its other files exist.
    pub(super) fn new(path: &Path, database: File) -> io::Result<Self> {
        let main = database.metadata()?;
        let mut files = vec![(path.to_owned(), (main.dev(), main.ino()))];
        for extension in ["sqlite3-wal", "sqlite3-shm"] {
            let beside = path.with_extension(extension);
            let identity = identity(&beside)?;
            files.push((beside, identity));
        }
        Ok(Self {
            _database: database,
            files,
        })
    }

    /// Fails if a file was deleted or replaced since the store was opened: what is written to it is lost with the process.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        for (path, opened) in &self.files {
            let why = match identity(path) {
                Ok(found) if found == *opened => continue,
                Ok(_) => "is another file".to_owned(),
                Err(error) => format!("cannot be found ({error})"),
            };
            return Err(StoreError::Displaced {
                path: path.clone(),
                why,
            });
        }
        Ok(())
    }
}

fn identity(path: &Path) -> io::Result<Identity> {
    let file = fs::metadata(path)?;
    Ok((file.dev(), file.ino()))
}

/// Locks the database for this process.
pub(super) fn lock(database: &File, path: &Path) -> Result<(), StoreError> {
    match database.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse {
            path: path.to_owned(),
        }),
        Err(TryLockError::Error(error)) => Err(StoreError::open(path, &error)),
    }
}
