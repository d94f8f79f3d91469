//! Logs of references and motion from files, the craft that they show as a file and as a page.
//!
//! What the numbers mean and how they are fitted is [`crate::identify`]'s affair. A log is a table with a row a sample:
//! comma-separated values, Apache Parquet, or MCAP with the table's rows as messages, which are the formats that this
//! project writes records in.

use std::{fs, io, path::Path};

use crate::identify::{InvalidLog, Log};

mod columns;
mod table;

pub use columns::{COLUMNS, LogColumn, write_csv};

/// Largest file that is read, bytes: a day at 10 Hz as text.
const FILE_BYTES_MAX: u64 = 500_000_000;

/// Why a file is no log.
#[derive(Debug, thiserror::Error)]
pub enum LogFileError {
    /// It cannot be read.
    #[error("cannot read the log")]
    Read(#[from] io::Error),
    /// Nothing tells what is in it.
    #[error("a log is a .csv, .parquet or .mcap file")]
    Ending,
    /// Not comma-separated values.
    #[error("not comma-separated values with a header line")]
    Csv(#[from] csv::Error),
    /// Not Parquet.
    #[error("not Apache Parquet, plain or compressed with Snappy")]
    Parquet(#[from] parquet::errors::ParquetError),
    /// Not MCAP.
    #[error("not MCAP without compression")]
    Mcap(#[from] mcap::McapError),
    /// No messages that are rows of a table.
    #[error("no messages on {}, which are the rows of a record", record::mcap::ROWS)]
    NoRows,
    /// A column that is needed.
    #[error("no column {0}: see docs/commissioning.md for the columns of a log")]
    NoColumn(&'static str),
    /// A cell that is no number.
    #[error("row {row}, column {column}: {given:?} is not a number")]
    NotANumber {
        /// The row, from 1 on, the header not counted.
        row: usize,
        /// The column.
        column: String,
        /// What is there.
        given: String,
    },
    /// Numbers that make no log.
    #[error(transparent)]
    Invalid(#[from] InvalidLog),
}

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
