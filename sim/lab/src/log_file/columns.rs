//! The columns of a log, and the rows that they make.

use std::io::{self, Write};

use crate::identify::LogRow;
use nalgebra::Vector2;
use record::table::{KNOWN, SURFACE_CRAFT};

use super::{
    LogFileError,
    table::{Cell, Table},
};

/// A column of a log.
#[derive(Clone, Copy, Debug)]
pub struct LogColumn {
    /// Its name and the other names under which it is found, the first that a file has.
    pub names: &'static [&'static str],
    /// What it is.
    pub meaning: &'static str,
}

const TIME: LogColumn = LogColumn {
    names: &["t_s"],
    meaning: "time, on any clock",
};
const SPEED_REFERENCE: LogColumn = LogColumn {
    names: &["reference_speed_mps"],
    meaning: "speed reference in force from this row on; 0 where it is to make no way",
};
const HEADING_REFERENCE: LogColumn = LogColumn {
    names: &["reference_heading_rad", "reference_heading_deg"],
    meaning: "heading (or course) reference in force from this row on, 0 at north, clockwise",
};
const HEADING: LogColumn = LogColumn {
    names: &["heading_rad", "heading_deg"],
    meaning: "measured heading of the bow",
};
const SURGE: LogColumn = LogColumn {
    names: &["speed_mps"],
    meaning: "speed through the water, ahead, by a speed log",
};
const SWAY: LogColumn = LogColumn {
    names: &["sway_mps"],
    meaning: "speed through the water to starboard, by a two-axis log",
};
const GROUND_NORTH: LogColumn = LogColumn {
    names: &["ground_north_mps"],
    meaning: "velocity over ground, northward, by a satellite receiver",
};
const GROUND_EAST: LogColumn = LogColumn {
    names: &["ground_east_mps"],
    meaning: "velocity over ground, eastward",
};
const NORTH: LogColumn = LogColumn {
    names: &["north_m"],
    meaning: "position north of any datum; used where there is no velocity over ground",
};
const EAST: LogColumn = LogColumn {
    names: &["east_m"],
    meaning: "position east of it",
};
const POWER: LogColumn = LogColumn {
    names: &["power_w"],
    meaning: "electrical power of the propulsion",
};
/// Where a table has it, power is the increase of energy.
const ENERGY: &str = "energy_j";
/// Where a table has it, rows of other vehicles than the surface craft are passed over; rows of none tell references.
const VEHICLE: &str = "vehicle";
/// Where a table has it, rows of what was known are passed over: a record has the truth beside it.
const KIND: &str = "kind";

/// Every column, in the order in which logs are written.
pub const COLUMNS: [LogColumn; 11] = [
    TIME,
    SPEED_REFERENCE,
    HEADING_REFERENCE,
    HEADING,
    SURGE,
    SWAY,
    GROUND_NORTH,
    GROUND_EAST,
    NORTH,
    EAST,
    POWER,
];

/// Writes `rows` as comma-separated values: numbers with six decimals, nothing where there was nothing to tell.
pub fn write_csv(rows: &[LogRow], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.map(|column| column.names[0]).join(","))?;
    let values: [fn(&LogRow) -> Option<f64>; COLUMNS.len()] = [
        |row| Some(row.time),
        |row| Some(row.speed_reference),
        |row| Some(row.heading_reference),
        |row| Some(row.heading),
        |row| row.surge,
        |row| row.sway,
        |row| Some(row.ground_velocity?.x),
        |row| Some(row.ground_velocity?.y),
        |row| Some(row.position?.x),
        |row| Some(row.position?.y),
        |row| row.power,
    ];
    for row in rows {
        let cells = values.map(|value| value(row).map_or_else(String::new, |number| format!("{number:.6}")));
        writeln!(out, "{}", cells.join(","))?;
    }
    Ok(())
}

/// A number in the table, in SI and radians.
struct Reader<'a> {
    table: &'a Table,
    place: Option<(&'static str, usize)>,
}

impl<'a> Reader<'a> {
    fn of(table: &'a Table, column: LogColumn) -> Self {
        Self {
            table,
            place: table.column(column.names),
        }
    }

    fn needed(table: &'a Table, column: LogColumn) -> Result<Self, LogFileError> {
        let reader = Self::of(table, column);
        match reader.place {
            Some(_) => Ok(reader),
            None => Err(LogFileError::NoColumn(column.names[0])),
        }
    }

    fn at(&self, row: usize) -> Result<Option<f64>, LogFileError> {
        let Some((name, place)) = self.place else {
            return Ok(None);
        };
        match self.table.rows[row].get(place) {
            Some(Cell::Number(number)) if name.ends_with("_deg") => Ok(Some(number.to_radians())),
            Some(Cell::Number(number)) => Ok(Some(*number)),
            Some(Cell::Nothing) | None => Ok(None),
            Some(Cell::Word(given)) => Err(LogFileError::NotANumber {
                row: row + 1,
                column: name.to_owned(),
                given: given.clone(),
            }),
        }
    }
}

/// The samples of a table. References hold until the next; rows before the first, and without a heading, are passed over.
pub(super) fn rows(table: &Table) -> Result<Vec<LogRow>, LogFileError> {
    let time = Reader::needed(table, TIME)?;
    let speed_reference = Reader::needed(table, SPEED_REFERENCE)?;
    let heading_reference = Reader::needed(table, HEADING_REFERENCE)?;
    let heading = Reader::needed(table, HEADING)?;
    let [surge, sway, north_mps, east_mps, north, east, power] =
        [SURGE, SWAY, GROUND_NORTH, GROUND_EAST, NORTH, EAST, POWER].map(|column| Reader::of(table, column));
    let energy = Reader {
        table,
        place: table.column(&[ENERGY]),
    };
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
