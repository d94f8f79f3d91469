//! The columns of a log, and the rows that they make.

use std::io::{self, Write};

use crate::identify::LogRow;
use nalgebra::Vector2;
use record::table::{KNOWN, SURFACE_CRAFT};

use super::{
    LogFileError,
    table::{Cell, Table},
};

/// Names of a column in radians or degrees; the first that a file has counts.
const HEADING_REFERENCE: &[&str] = &["reference_heading_rad", "reference_heading_deg"];
const HEADING: &[&str] = &["heading_rad", "heading_deg"];
/// Optional column: power is the increase of energy.
const ENERGY: &str = "energy_j";
/// Optional column: rows of AUVs are skipped; rows without a vehicle hold references.
const VEHICLE: &str = "vehicle";
/// Optional column: rows of what was known are skipped; a record has the truth beside them.
const KIND: &str = "kind";

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

/// A number in the table, in SI and radians.
struct Reader<'a> {
    table: &'a Table,
    place: Option<(&'static str, usize)>,
}

impl<'a> Reader<'a> {
    fn of(table: &'a Table, names: &[&'static str]) -> Self {
        Self {
            table,
            place: table.column(names),
        }
    }

    fn needed(table: &'a Table, names: &[&'static str]) -> Result<Self, LogFileError> {
        let reader = Self::of(table, names);
        let found = reader.place.is_some();
        found.then_some(reader).ok_or(LogFileError::NoColumn(names[0]))
    }

    fn at(&self, row: usize) -> Result<Option<f64>, LogFileError> {
        let Some((name, place)) = self.place else {
            return Ok(None);
        };
        match self.table.rows[row].get(place) {
            Some(Cell::Number(number)) if name.ends_with("_deg") => Ok(Some(number.to_radians())),
            Some(Cell::Number(number)) => Ok(Some(*number)),
            Some(Cell::Nothing) | None => Ok(None),
            Some(Cell::Word(given)) => Err(LogFileError::NotANumber(row + 1, name.to_owned(), given.clone())),
        }
    }
}

/// The samples of a table. Rows without a reference (held until the next) or heading are skipped.
pub(super) fn rows(table: &Table) -> Result<Vec<LogRow>, LogFileError> {
    let time = Reader::needed(table, &["t_s"])?;
    let speed_reference = Reader::needed(table, &["reference_speed_mps"])?;
    let heading_reference = Reader::needed(table, HEADING_REFERENCE)?;
    let heading = Reader::needed(table, HEADING)?;
    let [surge, sway, north_mps, east_mps, north, east, power, energy] = [
        "speed_mps",
        "sway_mps",
        "ground_north_mps",
        "ground_east_mps",
        "north_m",
        "east_m",
        "power_w",
        ENERGY,
    ]
    .map(|name| Reader::of(table, &[name]));
    let place = |name| table.column(&[name]).map(|(_, place)| place);
    let (vehicle, kind) = (place(VEHICLE), place(KIND));

    let mut rows: Vec<LogRow> = Vec::new();
    let (mut speed_now, mut heading_now) = (None, None);
    let mut energy_before: Option<(f64, f64)> = None;
    for i in 0..table.rows.len() {
        let whose = table.word(i, vehicle);
        if whose.is_some_and(|whose| whose != SURFACE_CRAFT) {
            continue;
        }
        speed_now = speed_reference.at(i)?.or(speed_now);
        heading_now = heading_reference.at(i)?.or(heading_now);
        let references_alone = vehicle.is_some() && whose.is_none();
        if references_alone || table.word(i, kind) == Some(KNOWN) {
            continue;
        }
        let (Some(time), Some(heading)) = (time.at(i)?, heading.at(i)?) else {
            continue;
        };
        let mut power = power.at(i)?;
        if let Some(energy) = energy.at(i)? {
            let drawn = energy_before.map(|(then, before)| (energy - before) / (time - then));
            power = power.or(drawn.filter(|power| power.is_finite()));
            energy_before = Some((time, energy));
        }
        let (Some(speed), Some(course)) = (speed_now, heading_now) else {
            continue;
        };
        let pair = |x: Option<f64>, y: Option<f64>| Some(Vector2::new(x?, y?));
        rows.push(LogRow {
            time,
            speed_reference: speed,
            heading_reference: course,
            heading,
            surge: surge.at(i)?,
            sway: sway.at(i)?,
            ground_velocity: pair(north_mps.at(i)?, east_mps.at(i)?),
            position: pair(north.at(i)?, east.at(i)?),
            power,
        });
    }
    Ok(rows)
}
