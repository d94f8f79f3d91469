//! The table as comma-separated values (RFC 4180, lines ended by LF): one header line, one line an observation.

use std::{
    fmt::Write as _,
    io::{self, Write},
};

use csv::ErrorKind;

use super::{
    RecordError, Story,
    row::{COLUMNS, Cell, Row},
};

/// Numbers have the fewest digits that give the same bits back. Nothing where there was nothing to tell.
pub(super) fn write(story: &Story<'_>, out: &mut impl Write) -> Result<(), RecordError> {
    let mut lines = csv::Writer::from_writer(out);
    lines
        .write_record(COLUMNS.map(|(name, _)| name))
        .map_err(not_written)?;
    let mut number = String::new();
    story.for_each_row(|row| Ok(line(&mut lines, row, &mut number).map_err(not_written)?))?;
    Ok(lines.flush()?)
}

fn line(lines: &mut csv::Writer<impl Write>, row: &Row<'_>, number: &mut String) -> csv::Result<()> {
    for (_, cell) in COLUMNS {
        number.clear();
        let digits = match cell {
            Cell::Word(read) => {
                lines.write_field(read(row).unwrap_or_default())?;
                continue;
            }
            Cell::Count(read) => write!(number, "{}", read(row)),
            Cell::Number(read) => read(row).map_or(Ok(()), |value| write!(number, "{value}")),
        };
        digits.expect("a string takes everything");
        lines.write_field(&number)?;
    }
    lines.write_record(None::<&[u8]>)
}

/// What the file refused with.
fn not_written(error: csv::Error) -> io::Error {
    match error.into_kind() {
        ErrorKind::Io(error) => error,
        kind => io::Error::other(format!("{kind:?}")),
    }
}
