//! Errors of writing a record.

use std::{io, path::PathBuf};

use geodesy::NotOnEarth;

/// Reason why a record was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The name of the file has no known extension.
    #[error("{path} has no known extension: use .csv, .parquet, .geojson, .mcap or .ndjson")]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The program is built without the format.
    #[error("this program is built without .{0} files: cargo build --release --features {0}")]
    LeftOut(&'static str),
    /// The format requires positions on Earth, and the record has no origin.
    #[error("GeoJSON needs positions on Earth: give the scenario an [origin] with lat_deg and lon_deg")]
    NoOrigin,
    /// The record's origin is not on Earth.
    #[error("the record's origin cannot be used")]
    Origin(#[from] NotOnEarth),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] io::Error),
}
