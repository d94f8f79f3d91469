//! A record as comma-separated values: one header line, one line a tick.

use std::io::{self, Write};

use sim::record::{Record, Values};

/// Writes `record`: numbers with six decimals, nothing where there was nothing to tell.
pub(super) fn write(record: &Record, out: &mut impl Write) -> io::Result<()> {
    let columns = record.columns();
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    writeln!(out, "{}", names.join(","))?;
    for i in 0..record.rows.len() {
        for (k, column) in columns.iter().enumerate() {
            if 0 < k {
                out.write_all(b",")?;
            }
            match &column.values {
                Values::Numbers(numbers) => {
                    if let Some(number) = numbers[i] {
                        write!(out, "{number:.6}")?;
                    }
                }
                Values::Words(words) => out.write_all(words[i].as_bytes())?,
            }
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}
