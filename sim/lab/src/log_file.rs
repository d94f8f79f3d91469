//! Logs of references and motion from files.
//!
//! A log is a table with a row per sample: comma-separated values, Apache Parquet, or MCAP with the
//! table's rows as messages. [`crate::identify`] fits a craft to it.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use bytes::Bytes;
use mcap::MessageStream;
use nalgebra::Vector2;
use parquet::{
    file::reader::{FileReader as _, SerializedFileReader},
    record::Field,
};
use record::mcap::ROWS;
use record::table::{KNOWN, SURFACE_CRAFT};
use record::with_commas;
use serde_json::{Map, Value};

use crate::identify::{InvalidLog, Log, LogRow};

/// Largest file that is read, bytes: a day at 10 Hz as text.
const FILE_BYTES_MAX: u64 = 500_000_000;

/// The columns that a log must have; the first of these names that a row has counts.
const NEEDED: [&[&str]; 4] = [
    &["t_s"],
    &["reference_speed_mps"],
    &["reference_heading_rad", "reference_heading_deg"],
    &["heading_rad", "heading_deg"],
];
/// Optional column: rows of AUVs are skipped; rows without a vehicle hold references.
const VEHICLE: &str = "vehicle";
/// Optional column: rows of what was known are skipped; a record has the truth beside them.
const KIND: &str = "kind";

/// A log cannot be read.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum LogFileError {
    #[error("cannot read the log")]
    Read(#[from] io::Error),
    #[error("a log is a .csv, .parquet or .mcap file")]
    Ending,
    #[error("not comma-separated values with a header line")]
    Csv(#[from] csv::Error),
    #[error("not Apache Parquet, plain or compressed with Snappy")]
    Parquet(#[from] parquet::errors::ParquetError),
    #[error("not MCAP without compression")]
    Mcap(#[from] mcap::McapError),
    #[error("no messages on {}, which are the rows of a record", record::mcap::ROWS)]
    NoRows,
    #[error("no column {0}: see docs/commissioning.md for the columns of a log")]
    NoColumn(&'static str),
    /// A cell is not a number: its row, from 1 on, the header not counted, its column, its text.
    #[error("row {0}, column {1}: {2:?} is not a number")]
    NotANumber(usize, String, String),
    #[error(transparent)]
    Invalid(#[from] InvalidLog),
}

/// The log in the file at `path`.
pub fn read(path: &Path) -> Result<Log, LogFileError> {
    if FILE_BYTES_MAX < fs::metadata(path)?.len() {
        return Err(io::Error::other("more than 500 MB").into());
    }
    let bytes = fs::read(path)?;
    let mut samples = Samples::default();
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => {
            let bytes = with_commas(&bytes);
            let mut reader = csv::ReaderBuilder::new();
            let mut reader = reader.trim(csv::Trim::All).from_reader(&*bytes);
            let names = reader.headers()?.clone();
            for record in reader.records() {
                samples.add(&names.iter().zip(record?.iter().map(of_text)).collect())?;
            }
        }
        Some("parquet") => {
            let file = SerializedFileReader::new(Bytes::from(bytes))?;
            for row in file.get_row_iter(None)? {
                let row = row?;
                let cells = row.get_column_iter();
                let cells = cells.map(|(name, field)| (name.as_str(), of_field(field)));
                samples.add(&cells.collect())?;
            }
        }
        Some("mcap") => {
            let mut rows: Vec<Map<String, Value>> = vec![];
            for message in MessageStream::new(&bytes)? {
                let message = message?;
                if message.channel.topic == ROWS {
                    rows.extend(serde_json::from_slice::<Map<String, Value>>(&message.data).ok());
                }
            }
            if rows.iter().all(Map::is_empty) {
                return Err(LogFileError::NoRows);
            }
            // A message has no members for unknown values.
            samples.has_vehicles = rows.iter().any(|row| row.contains_key(VEHICLE));
            for row in &rows {
                let cells = row.iter().map(|(name, value)| (name.as_str(), of_value(value)));
                samples.add(&cells.collect())?;
            }
        }
        Some(_) | None => return Err(LogFileError::Ending),
    }
    samples.log()
}

/// A cell of a row.
enum CellValue {
    Number(f64),
    Word(String),
}

fn of_text(text: &str) -> Option<CellValue> {
    let known = text.parse().map(CellValue::Number);
    (!text.is_empty()).then(|| known.unwrap_or_else(|_| CellValue::Word(text.to_owned())))
}

fn of_field(field: &Field) -> Option<CellValue> {
    match field {
        Field::Double(number) => Some(CellValue::Number(*number)),
        Field::Float(number) => Some(CellValue::Number(f64::from(*number))),
        Field::Int(number) => Some(CellValue::Number(f64::from(*number))),
        Field::Long(number) => Some(CellValue::Number(*number as f64)),
        Field::Str(word) => Some(CellValue::Word(word.clone())),
        _ => None,
    }
}

fn of_value(value: &Value) -> Option<CellValue> {
    let word = value.as_str().map(|word| CellValue::Word(word.to_owned()));
    word.or_else(|| value.as_f64().map(CellValue::Number))
}

/// The samples of a table, row by row.
#[derive(Default)]
struct Samples {
    rows: Vec<LogRow>,
    n_read: usize,
    /// The columns of [`NEEDED`] that the table has.
    found: [bool; 4],
    /// `true` if the table has a column [`VEHICLE`], also where a row has not.
    has_vehicles: bool,
    /// References of speed, m/s, and heading, rad, which hold until the next ones.
    references: [Option<f64>; 2],
    /// Time, s, and energy, J, of the last row with an energy.
    energy: Option<(f64, f64)>,
}

impl Samples {
    /// Takes a row by its columns. Rows without a heading, or before a reference, are skipped.
    fn add(&mut self, row: &BTreeMap<&str, Option<CellValue>>) -> Result<(), LogFileError> {
        self.n_read += 1;
        for (names, found) in NEEDED.iter().zip(&mut self.found) {
            *found |= names.iter().any(|name| row.contains_key(*name));
        }
        let word = |name: &str| match row.get(name)?.as_ref()? {
            CellValue::Number(_) => Some(""),
            CellValue::Word(word) => Some(word.as_str()),
        };
        let n_read = self.n_read;
        // In SI and radians.
        let number = |names: &[&str]| {
            let mut cells = names.iter().filter_map(|name| Some((*name, row.get(*name)?.as_ref()?)));
            Ok(match cells.next() {
                None => None,
                Some((name, CellValue::Number(degrees))) if name.ends_with("_deg") => {
                    Some(degrees.to_radians())
                }
                Some((_, CellValue::Number(number))) => Some(*number),
                Some((name, CellValue::Word(word))) => {
                    return Err(LogFileError::NotANumber(n_read, name.to_owned(), word.clone()));
                }
            })
        };
        let vehicle = word(VEHICLE);
        if vehicle.is_some_and(|vehicle| vehicle != SURFACE_CRAFT) {
            return Ok(());
        }
        let [time, speed, course, heading] = NEEDED;
        let [held_speed, held_course] = self.references;
        self.references = [number(speed)?.or(held_speed), number(course)?.or(held_course)];
        let has_vehicles = self.has_vehicles || row.contains_key(VEHICLE);
        if has_vehicles && vehicle.is_none() || word(KIND) == Some(KNOWN) {
            return Ok(());
        }
        let (Some(time), Some(heading)) = (number(time)?, number(heading)?) else { return Ok(()) };
        let mut power = number(&["power_w"])?;
        // Power is the increase of energy.
        if let Some(energy) = number(&["energy_j"])? {
            let drawn = self.energy.map(|(then, before)| (energy - before) / (time - then));
            power = power.or(drawn.filter(|power| power.is_finite()));
            self.energy = Some((time, energy));
        }
        let [Some(speed_reference), Some(heading_reference)] = self.references else {
            return Ok(());
        };
        let pair = |[x, y]: [&str; 2]| {
            let (x, y) = (number(&[x])?, number(&[y])?);
            Ok::<_, LogFileError>(x.zip(y).map(|(x, y)| Vector2::new(x, y)))
        };
        self.rows.push(LogRow {
            time,
            speed_reference,
            heading_reference,
            heading,
            surge: number(&["speed_mps"])?,
            sway: number(&["sway_mps"])?,
            ground_velocity: pair(["ground_north_mps", "ground_east_mps"])?,
            position: pair(["north_m", "east_m"])?,
            power,
        });
        Ok(())
    }

    fn log(self) -> Result<Log, LogFileError> {
        let missing = NEEDED.iter().zip(self.found).find(|(_, found)| !found);
        if let Some((names, _)) = missing.filter(|_| 0 < self.n_read) {
            return Err(LogFileError::NoColumn(names[0]));
        }
        Ok(Log::new(self.rows)?)
    }
}

/// A column of a log: its name, and its value in a row.
type LogColumn = (&'static str, fn(&LogRow) -> Option<f64>);

/// The columns that [`write_csv`] writes. docs/commissioning.md says what each means.
const COLUMNS: [LogColumn; 11] = [
    ("t_s", |row| Some(row.time)),
    ("reference_speed_mps", |row| Some(row.speed_reference)),
    ("reference_heading_rad", |row| Some(row.heading_reference)),
    ("heading_rad", |row| Some(row.heading)),
    ("speed_mps", |row| row.surge),
    ("sway_mps", |row| row.sway),
    ("ground_north_mps", |row| Some(row.ground_velocity?.x)),
    ("ground_east_mps", |row| Some(row.ground_velocity?.y)),
    ("north_m", |row| Some(row.position?.x)),
    ("east_m", |row| Some(row.position?.y)),
    ("power_w", |row| row.power),
];

/// Writes `rows` as comma-separated values: numbers with six decimals; unknown values are empty.
pub fn write_csv(rows: &[LogRow], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.map(|(name, _)| name).join(","))?;
    for row in rows {
        let cell = |number: Option<f64>| number.map_or_else(String::new, |number| format!("{number:.6}"));
        writeln!(out, "{}", COLUMNS.map(|(_, value)| cell(value(row))).join(","))?;
    }
    Ok(())
}
