//! Records as files that other programs open.

use std::{
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
};

use sim::{datum::NotOnEarth, record::Record};

mod csv;
pub(crate) mod geojson;
pub(crate) mod mcap;
pub(crate) mod parquet;
#[cfg(test)]
mod sample;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values: one header line, one line a tick.
    Csv,
    /// Apache Parquet: the same table with full precision and nulls.
    Parquet,
    /// `GeoJSON` (RFC 7946): tracks, paths and bounds on Earth.
    Geojson,
    /// MCAP with the schemas of Foxglove and Lichtblick.
    Mcap,
}

/// Why a record was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The name of the file says no format.
    #[error("{path} has no ending that says what to write: .csv, .parquet, .geojson or .mcap")]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The format holds places on Earth and the record none.
    #[error("GeoJSON needs the place on Earth: give the scenario an [origin] with lat_deg and lon_deg")]
    NoOrigin,
    /// The record's origin is no place on Earth.
    #[error("the record's origin cannot be used")]
    Origin(#[from] NotOnEarth),
    /// The file did not take it.
    #[error(transparent)]
    Write(#[from] io::Error),
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 4] = [Self::Csv, Self::Parquet, Self::Geojson, Self::Mcap];

    /// The format that the ending of `path` names, in capitals or not.
    pub fn of(path: &Path) -> Result<Self, ExportError> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        Self::ALL
            .into_iter()
            .find(|format| extension.is_some_and(|given| given.eq_ignore_ascii_case(format.extension())))
            .ok_or_else(|| ExportError::UnknownExtension {
                path: path.to_owned(),
            })
    }

    /// The ending of its files, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Geojson => "geojson",
            Self::Mcap => "mcap",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

/// Writes `record` to `out`. Equal records give equal bytes.
pub fn write(record: &Record, format: Format, out: &mut (impl Write + Send)) -> Result<(), ExportError> {
    match format {
        Format::Csv => csv::write(record, out)?,
        Format::Parquet => parquet::write(record, out)?,
        Format::Geojson => geojson::write(record, out)?,
        Format::Mcap => mcap::write(record, out)?,
    }
    Ok(out.flush()?)
}

/// What a file says of its record as a whole, as names and values.
fn about(record: &Record) -> [(&'static str, String); 6] {
    [
        ("schema_version", "1".to_owned()),
        ("scenario", record.scenario.clone()),
        ("title", record.title.clone()),
        ("guide", record.guide.clone()),
        ("seed", record.seed.to_string()),
        ("interval_s", record.interval.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_names_the_format_in_capitals_or_not() {
        for format in Format::ALL {
            let path = format!("some.where/run.2.{format}");
            assert_eq!(Format::of(Path::new(&path)).expect("is known"), format);
            let shouted = path.to_uppercase();
            assert_eq!(Format::of(Path::new(&shouted)).expect("is known"), format);
        }
    }

    #[test]
    fn another_ending_is_refused_with_the_four_that_work() {
        for path in ["run.xlsx", "run", "csv", ".csv", "run.csv.gz"] {
            let said = Format::of(Path::new(path)).expect_err("is unknown").to_string();
            assert!(said.contains(path), "{said}");
            for format in Format::ALL {
                assert!(said.contains(&format!(".{format}")), "{said}");
            }
        }
    }

    #[test]
    fn equal_records_give_equal_bytes_in_every_format() {
        for format in Format::ALL {
            let bytes = || {
                let mut bytes = vec![];
                write(&sample::record(), format, &mut bytes).expect("can be written");
                bytes
            };
            let first = bytes();
            assert!(!first.is_empty());
            // Hashed containers differ from one instance to the next.
            for _ in 0..5 {
                assert!(first == bytes(), "{format}");
            }
        }
    }

    #[test]
    fn a_file_that_takes_nothing_is_an_error_and_no_panic() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Err(io::ErrorKind::StorageFull.into())
            }
        }
        for format in Format::ALL {
            let error = write(&sample::record(), format, &mut Full).expect_err("is full");
            assert!(
                matches!(&error, ExportError::Write(error) if error.kind() == io::ErrorKind::StorageFull),
                "{format}: {error:?}"
            );
        }
    }

    #[test]
    fn only_geojson_needs_an_origin_and_says_what_to_do() {
        let record = Record {
            origin: None,
            ..sample::record()
        };
        for format in Format::ALL {
            let written = write(&record, format, &mut vec![]);
            match format {
                Format::Geojson => {
                    let error = written.expect_err("has no place on Earth");
                    assert!(error.to_string().contains("[origin]"), "{error}");
                }
                Format::Csv | Format::Parquet | Format::Mcap => written.expect("can be written"),
            }
        }
    }

    #[test]
    fn a_record_without_rows_or_vehicles_is_written_too() {
        let empty = Record {
            rows: vec![],
            paths: vec![],
            bounds: sim::record::Bounds::default(),
            ..sample::record()
        };
        for format in Format::ALL {
            write(&empty, format, &mut vec![]).expect("can be written");
        }
    }
}
