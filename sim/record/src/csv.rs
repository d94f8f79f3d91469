//! The table as comma-separated values (RFC 4180, lines end with LF): a header, one line a row.

use std::fmt::Write as _;
use std::io::{self, Write};

use csv::ErrorKind;

use crate::source::{Placed, Source};
use crate::table::{COLUMNS, Cell, Row};

/// Words that begin with these are formulas to a spreadsheet (OWASP, "CSV Injection").
const FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// Numbers have the fewest digits that give the same bits. Unknown values are empty.
pub(super) fn write<S: Source>(record: &Placed<'_, S>, out: &mut impl Write) -> Result<(), S::Error> {
    let mut lines = csv::Writer::from_writer(out);
    let header = COLUMNS.iter().map(|column| column.name);
    lines.write_record(header).map_err(not_written)?;
    let mut digits = String::new();
    record.for_each(&mut |entry| {
        for row in &entry.rows {
            line(&mut lines, row, &mut digits).map_err(not_written)?;
        }
        Ok(())
    })?;
    Ok(lines.flush()?)
}

fn line(lines: &mut csv::Writer<impl Write>, row: &Row<'_>, digits: &mut String) -> csv::Result<()> {
    for column in COLUMNS {
        digits.clear();
        let written = match (column.cell)(row) {
            Cell::Nothing => Ok(()),
            Cell::Count(count) => write!(digits, "{count}"),
            Cell::Number(number) => write!(digits, "{number}"),
            Cell::Word(word) => {
                if word.starts_with(FORMULA) {
                    lines.write_field(format!("'{word}"))?;
                } else {
                    lines.write_field(word)?;
                }
                continue;
            }
        };
        written.expect("a string takes everything");
        lines.write_field(&digits)?;
    }
    lines.write_record(None::<&[u8]>)
}

/// The I/O error behind `error`.
fn not_written(error: csv::Error) -> io::Error {
    match error.into_kind() {
        ErrorKind::Io(error) => error,
        kind => io::Error::other(format!("{kind:?}")),
    }
}
