//! The files of a store's directory: their creation, permissions and settings.

use std::fs::{self, DirBuilder, File, OpenOptions, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::Path;

use rusqlite::{Connection, config::DbConfig};

use super::{error::StoreError, sql::LOCK_TIME};

/// Size to which the write-ahead file is truncated when it is empty, bytes.
const JOURNAL_BYTES: i64 = 16 << 20;

/// Creates the directory and the file if missing, for the service's user only; SQLite's other files
/// get the same mode. A symbolic link is refused: those files would be beside its target.
pub(super) fn make_private(directory: &Path, path: &Path) -> io::Result<File> {
    if fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink()) {
        let why = "it is a symbolic link: let --data name the directory of its target";
        return Err(io::Error::other(why));
    }
    DirBuilder::new().recursive(true).mode(0o700).create(directory)?;
    let database = private_file(path)?;
    File::open(directory)?.sync_all()?;
    Ok(database)
}

/// Opens a file at its end; creates it if missing, for this user only.
pub(super) fn private_file(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).create(true).mode(0o600).open(path)
}

/// Fails while the file of losses exists.
pub(super) fn require_no_loss(lost: &Path) -> Result<(), StoreError> {
    match fs::read_to_string(lost) {
        Ok(what) => Err(StoreError::Damaged(format!(
            "acknowledged events are missing. Read and delete {}: {what}",
            lost.display()
        ))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(StoreError::open(lost, &error)),
    }
}

pub(super) fn note_lost(path: &Path, lost: &str) -> io::Result<()> {
    let mut file = private_file(path)?;
    writeln!(file, "{lost}")?;
    file.sync_all()
}

/// Makes a file of an older version private.
pub(super) fn hide(path: &Path) {
    if let Err(error) = fs::set_permissions(path, Permissions::from_mode(0o600))
        && error.kind() != io::ErrorKind::NotFound
    {
        tracing::warn!(%error, path = %path.display(), "other users may read the mission log");
    }
}

/// Fails if the store's file is empty or missing: SQLite would delete its write-ahead file.
pub(super) fn require_file_of_write_ahead(path: &Path) -> Result<(), StoreError> {
    let bytes = |path: &Path| match fs::metadata(path) {
        Ok(file) => Ok(file.len()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(0),
        Err(error) => Err(StoreError::open(path, &error)),
    };
    let ahead = path.with_extension("sqlite3-wal");
    if bytes(path)? == 0 && 0 < bytes(&ahead)? {
        return Err(StoreError::Damaged(format!(
            "{} is empty or missing, but its write-ahead file {} is not; restore the directory from a backup",
            path.display(),
            ahead.display()
        )));
    }
    Ok(())
}

/// Sets WAL, and commits that wait for the disk.
pub(super) fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(LOCK_TIME)?;
    // Effective only before the first table; an older store keeps its free space until `VACUUM`.
    connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "journal_size_limit", JOURNAL_BYTES)?;
    // The writer merges by itself, so that it knows when everything is merged.
    connection.pragma_update(None, "wal_autocheckpoint", 0)?;
    // The last connection would delete whichever write-ahead file is then at the path.
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    connection.pragma_update(None, "foreign_keys", true)
}
