//! Errors of writing a record.

use std::{io, path::PathBuf};

use geodesy::NotOnEarth;

/// Reason why a record was not written.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error("{path} has no known extension: use .csv, .parquet, .geojson, .mcap or .ndjson")]
    UnknownExtension { path: PathBuf },
    #[error("this program is built without .{0} files: cargo build --release --features {0}")]
    LeftOut(&'static str),
    #[error("GeoJSON needs positions on Earth: give the scenario an [origin] with lat_deg and lon_deg")]
    NoOrigin,
    #[error("the record's origin cannot be used")]
    Origin(#[from] NotOnEarth),
    #[error(transparent)]
    Write(#[from] io::Error),
}
