//! The table as Apache Parquet, some rows at a time.

use std::{io::Write, sync::Arc};

use parquet::{
    basic::Type as PhysicalType,
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{properties::WriterProperties, writer::SerializedFileWriter},
};

use super::{
    RecordError, Story,
    row::{COLUMNS, Cell, Row},
};
use crate::export::parquet::{not_written, properties, schema_of, write_cells};

/// Rows that are in memory at once, here and with whoever reads the file: with what becomes of them, 9 MB. What the file
/// says of its groups is in memory until its end, 20 kB each: 6 MB after ten days of a plan and five observations a
/// second.
const GROUP: usize = 16_384;

pub(super) fn write(story: &Story<'_>, out: &mut (impl Write + Send)) -> Result<(), RecordError> {
    let schema = schema_of(
        "record",
        COLUMNS.iter().map(|(name, cell)| (*name, physical(cell))),
    )?;
    let properties: WriterProperties = properties(&story.about());
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let mut group = Group::default();
    story.for_each_row(|row| {
        group.push(row);
        if group.n_rows == GROUP {
            group.write(&mut file)?;
        }
        Ok(())
    })?;
    if 0 < group.n_rows {
        group.write(&mut file)?;
    }
    file.close()?;
    Ok(())
}

impl From<ParquetError> for RecordError {
    fn from(error: ParquetError) -> Self {
        Self::Write(not_written(error))
    }
}

fn physical(cell: &Cell) -> PhysicalType {
    match cell {
        Cell::Count(_) => PhysicalType::INT64,
        Cell::Number(_) => PhysicalType::DOUBLE,
        Cell::Word(_) => PhysicalType::BYTE_ARRAY,
    }
}

/// Rows, by columns.
struct Group {
    n_rows: usize,
    columns: [Cells; COLUMNS.len()],
}

enum Cells {
    Counts(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Words(Vec<Option<ByteArray>>),
}

impl Default for Group {
    fn default() -> Self {
        Self {
            n_rows: 0,
            columns: COLUMNS.map(|(_, cell)| match cell {
                Cell::Count(_) => Cells::Counts(vec![]),
                Cell::Number(_) => Cells::Numbers(vec![]),
                Cell::Word(_) => Cells::Words(vec![]),
            }),
        }
    }
}

impl Group {
    fn push(&mut self, row: &Row<'_>) {
        self.n_rows += 1;
        for ((_, cell), cells) in COLUMNS.iter().zip(&mut self.columns) {
            match (cell, cells) {
                (Cell::Count(read), Cells::Counts(counts)) => counts.push(i64::try_from(read(row)).ok()),
                (Cell::Number(read), Cells::Numbers(numbers)) => numbers.push(read(row)),
                (Cell::Word(read), Cells::Words(words)) => words.push(read(row).map(ByteArray::from)),
                _ => unreachable!("the columns are made of the cells"),
            }
        }
    }

    /// Writes the rows, and forgets them.
    fn write(&mut self, file: &mut SerializedFileWriter<impl Write + Send>) -> Result<(), ParquetError> {
        self.n_rows = 0;
        let mut group = file.next_row_group()?;
        for cells in &mut self.columns {
            let column = group.next_column()?.expect("the schema has as many columns");
            match cells {
                Cells::Counts(counts) => write_cells::<Int64Type>(counts.drain(..), column)?,
                Cells::Numbers(numbers) => write_cells::<DoubleType>(numbers.drain(..), column)?,
                Cells::Words(words) => write_cells::<ByteArrayType>(words.drain(..), column)?,
            }
        }
        group.close()?;
        Ok(())
    }
}
