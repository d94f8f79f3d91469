//! Logs of references and motion from files.
//!
//! A log is a table with a row per sample: comma-separated values, Apache Parquet, or MCAP with the
//! table's rows as messages. [`crate::identify`] fits a craft to it.

use std::{fs, io, path::Path};

use crate::identify::Log;

mod columns;
mod error;
mod table;

pub use columns::write_csv;
pub use error::LogFileError;

/// Largest file that is read, bytes: a day at 10 Hz as text.
const FILE_BYTES_MAX: u64 = 500_000_000;

/// The log in the file at `path`.
pub fn read(path: &Path) -> Result<Log, LogFileError> {
    if FILE_BYTES_MAX < fs::metadata(path)?.len() {
        return Err(io::Error::other("more than 500 MB").into());
    }
    let bytes = fs::read(path)?;
    let table = match path.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => table::of_csv(&bytes)?,
        Some("parquet") => table::of_parquet(bytes)?,
        Some("mcap") => table::of_mcap(&bytes)?,
        Some(_) | None => return Err(LogFileError::Ending),
    };
    Ok(Log::new(columns::rows(&table)?)?)
}
