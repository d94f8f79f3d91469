//! The formats of a record's files.

use std::{fmt, path::Path};

use crate::error::ExportError;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values: one header line, one line a row of the table.
    Csv,
    /// Apache Parquet: the same table with nulls, compressed.
    Parquet,
    /// `GeoJSON` (RFC 7946): tracks, paths and bounds on Earth.
    Geojson,
    /// MCAP with the schemas of Foxglove and Lichtblick.
    Mcap,
    /// Lines of JSON: an object a row of the table.
    Ndjson,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 5] = [Self::Csv, Self::Parquet, Self::Geojson, Self::Mcap, Self::Ndjson];

    /// The format of the extension of `path`, in upper or lower case.
    pub fn of(path: &Path) -> Result<Self, ExportError> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        Self::ALL
            .into_iter()
            .find(|format| extension.is_some_and(|given| given.eq_ignore_ascii_case(format.extension())))
            .ok_or_else(|| ExportError::UnknownExtension { path: path.to_owned() })?
            .built()
    }

    /// This format, if the program is built with it.
    pub fn built(self) -> Result<Self, ExportError> {
        match self {
            Self::Parquet if !cfg!(feature = "parquet") => Err(ExportError::LeftOut(self.extension())),
            Self::Mcap if !cfg!(feature = "mcap") => Err(ExportError::LeftOut(self.extension())),
            Self::Csv | Self::Parquet | Self::Geojson | Self::Mcap | Self::Ndjson => Ok(self),
        }
    }

    /// The extension of its files, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Geojson => "geojson",
            Self::Mcap => "mcap",
            Self::Ndjson => "ndjson",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}
