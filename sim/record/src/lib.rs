//! Records of missions, live or simulated, as files for other programs.
//!
//! ```text
//! simulated run ┐                                ┌► csv, parquet, ndjson: the table
//!               ├► Source: entries, each of rows ┼► mcap: the table, poses, the scene, events
//! mission ──────┘                                └► geojson: tracks and the scene on Earth
//! ```
//! [`table`] defines the table, `docs/records.md` explains it. No writer holds a record in memory.
//! [`geodesy`] places the local frame (north, east, m) on Earth.

#![cfg_attr(
    not(all(feature = "mcap", feature = "parquet")),
    expect(dead_code, reason = "the formats that are left out share it")
)]

use std::io::{self, BufWriter, Write};

mod csv;
mod error;
mod format;
mod geojson;
#[cfg(feature = "mcap")]
pub mod mcap;
#[cfg(feature = "parquet")]
pub mod parquet;
#[cfg(test)]
mod sample_for_tests;
mod separators;
mod source;
pub mod table;

pub use error::ExportError;
pub use format::Format;
pub use geodesy::Origin;
pub use separators::with_commas;
pub use source::{Disc, Entry, Scene, Source};

use source::Placed;

/// The version of the table in files.
pub const SCHEMA_VERSION: &str = "3";

/// Size of the write buffer, bytes.
const PIECE: usize = 64 << 10;

/// Writes the record to `out`. Equal records give equal bytes. Output is incomplete after an error.
pub fn write<S: Source>(source: &S, format: Format, out: &mut (impl Write + Send)) -> Result<(), S::Error> {
    let record = Placed::new(source)?;
    let mut out = BufWriter::with_capacity(PIECE, out);
    match format {
        Format::Csv => csv::write(&record, &mut out)?,
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::write(&record, &mut out)?,
        Format::Geojson => geojson::write(&record, &mut out)?,
        #[cfg(feature = "mcap")]
        Format::Mcap => mcap::write(&record, &mut out)?,
        Format::Ndjson => ndjson(&record, &mut out)?,
        #[cfg(not(all(feature = "mcap", feature = "parquet")))]
        left_out => return Err(ExportError::LeftOut(left_out.extension()).into()),
    }
    Ok(out.flush()?)
}

fn ndjson<S: Source>(record: &Placed<'_, S>, out: &mut impl Write) -> Result<(), S::Error> {
    record.for_each(&mut |entry| {
        for row in &entry.rows {
            serde_json::to_writer(&mut *out, row).map_err(io::Error::from)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use geodesy::Datum;
    use serde_json::Value;

    use super::{source::plain, *};

    #[test]
    fn the_extension_determines_the_format_in_either_case() {
        for format in Format::ALL {
            let path = format!("some.where/run.2.{format}");
            assert_eq!(Format::of(Path::new(&path)).expect("is known"), format);
            let shouted = path.to_uppercase();
            assert_eq!(Format::of(Path::new(&shouted)).expect("is known"), format);
        }
    }

    #[test]
    fn equal_records_give_equal_bytes_in_every_format() {
        for format in Format::ALL {
            let bytes = || {
                let mut bytes = vec![];
                write(&sample_for_tests::record(), format, &mut bytes).expect("can be written");
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
    fn only_geojson_needs_an_origin_and_its_error_names_the_remedy() {
        let mut record = sample_for_tests::record();
        record.origin = None;
        for format in Format::ALL {
            let written = write(&record, format, &mut vec![]);
            match format {
                Format::Geojson => {
                    let error = written.expect_err("has no place on Earth");
                    assert!(error.to_string().contains("[origin]"), "{error}");
                }
                Format::Csv | Format::Parquet | Format::Mcap | Format::Ndjson => {
                    written.expect("can be written");
                }
            }
        }
    }

    #[test]
    fn every_position_has_latitude_and_longitude_if_the_datum_has() {
        let record = sample_for_tests::record();
        let datum = Datum::new(&record.origin.expect("is there")).expect("is on Earth");
        let mut bytes = vec![];
        write(&record, Format::Ndjson, &mut bytes).expect("can be written");
        let mut n_places = 0;
        for line in String::from_utf8(bytes).expect("is text").lines() {
            let row: Value = serde_json::from_str(line).expect("is JSON");
            let number = |name: &str| row.get(name).and_then(Value::as_f64);
            let degrees = (number("lat_deg"), number("lon_deg"));
            let (Some(north), Some(east)) = (number("north_m"), number("east_m")) else {
                assert_eq!(degrees, (None, None));
                continue;
            };
            let place = Origin {
                latitude: degrees.0.expect("is there").to_radians(),
                longitude: degrees.1.expect("is there").to_radians(),
            };
            let local = datum.to_local(&place).expect("is on Earth");
            assert!((local.x - north).hypot(local.y - east) < 1e-6, "{line}");
            n_places += 1;
        }
        assert!(0 < n_places);
    }

    #[test]
    fn lines_of_json_and_csv_match_the_rows() {
        let mut record = sample_for_tests::record();
        record.origin = None;
        let written = |format| {
            let mut bytes = vec![];
            write(&record, format, &mut bytes).expect("can be written");
            String::from_utf8(bytes).expect("is text")
        };
        let (ndjson, csv) = (written(Format::Ndjson), written(Format::Csv));
        let names: Vec<&str> = csv.lines().next().expect("is a header").split(',').collect();
        assert_eq!(names, table::COLUMNS.iter().map(|column| column.name).collect::<Vec<_>>());
        let rows = record.rows();
        assert_eq!((ndjson.lines().count(), csv.lines().count()), (rows.len(), rows.len() + 1));
        for ((object, line), row) in ndjson.lines().zip(csv.lines().skip(1)).zip(rows) {
            let object: Value = serde_json::from_str(object).expect("is JSON");
            assert_eq!(object, serde_json::to_value(row).expect("is JSON"));
            for (name, cell) in names.iter().zip(line.split(',')) {
                let value = object.get(*name);
                let expected = match value {
                    // Whole numbers have no decimal point in a table.
                    Some(Value::Number(number)) => number.as_f64().expect("is one").to_string(),
                    Some(word) => plain(word),
                    None => String::new(),
                };
                assert_eq!(cell, expected, "{name}");
            }
        }
    }
}
