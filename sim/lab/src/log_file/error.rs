//! Errors of reading a log.

use std::io;

use crate::identify::InvalidLog;

/// A log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LogFileError {
    /// It cannot be read.
    #[error("cannot read the log")]
    Read(#[from] io::Error),
    /// Its format is unknown.
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
    /// No messages with rows of a table.
    #[error("no messages on {}, which are the rows of a record", record::mcap::ROWS)]
    NoRows,
    /// A required column is missing.
    #[error("no column {0}: see docs/commissioning.md for the columns of a log")]
    NoColumn(&'static str),
    /// A cell is not a number: its row, from 1 on, the header not counted, its column, its text.
    #[error("row {0}, column {1}: {2:?} is not a number")]
    NotANumber(usize, String, String),
    /// The numbers are not a log.
    #[error(transparent)]
    Invalid(#[from] InvalidLog),
}
