//! Tables as Apache Parquet (Snappy): full precision, null if unknown, metadata as key-value pairs.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

use crate::ExportError;
use crate::source::{Placed, Source, plain};
use crate::table::{COLUMNS, Cell, Kind};

/// Rows of a group in memory of writer and reader.
const GROUP: usize = 16_384;

/// Definition levels of an optional column's cells.
const NULL: i16 = 0;
const VALUE: i16 = 1;

/// Writes a table of any columns, each with its name and kind. Equal tables give equal bytes.
pub fn write_table<'a>(
    name: &str,
    columns: impl Iterator<Item = (&'a str, Kind)>,
    about: &[(&'static str, String)],
    rows: impl Iterator<Item = impl Iterator<Item = Cell<'a>>>,
    out: &mut (impl Write + Send),
) -> Result<(), ExportError> {
    let mut file = File::new(name, columns, about, out)?;
    for row in rows {
        let cells = file.columns.iter_mut().zip(row);
        cells.for_each(|(column, cell)| column.push(cell));
    }
    file.end_group()?;
    Ok(file.finish()?)
}

/// Writes the record, a group of rows at a time.
pub(super) fn write<S: Source>(
    record: &Placed<'_, S>,
    out: &mut (impl Write + Send),
) -> Result<(), S::Error> {
    in_groups(record, GROUP, out)
}

fn in_groups<S: Source>(
    record: &Placed<'_, S>,
    group: usize,
    out: &mut (impl Write + Send),
) -> Result<(), S::Error> {
    let about: Vec<_> = record.record.about().iter().map(|(key, value)| (*key, plain(value))).collect();
    let columns = COLUMNS.iter().map(|column| (column.name, column.kind));
    let mut file = File::new("record", columns, &about, out).map_err(not_written)?;
    record.for_each(&mut |entry| {
        for row in &entry.rows {
            for (column, cells) in COLUMNS.iter().zip(&mut file.columns) {
                cells.push((column.cell)(row));
            }
            if file.n_rows() == group {
                file.end_group().map_err(not_written)?;
            }
        }
        Ok(())
    })?;
    let ended = file.end_group().and_then(|()| file.finish());
    Ok(ended.map_err(not_written)?)
}

/// The I/O error behind `error`.
fn not_written(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(source) => io::Error::other(source),
        },
        error => io::Error::other(error),
    }
}

impl From<ParquetError> for ExportError {
    fn from(error: ParquetError) -> Self {
        Self::Write(not_written(error))
    }
}

/// An open file with the current group of rows.
struct File<W: Write + Send> {
    out: SerializedFileWriter<W>,
    columns: Vec<Cells>,
}

impl<W: Write + Send> File<W> {
    /// A table of columns whose cells may be null.
    fn new<'a>(
        name: &str,
        columns: impl Iterator<Item = (&'a str, Kind)>,
        about: &[(&'static str, String)],
        out: W,
    ) -> Result<Self, ParquetError> {
        let (mut fields, mut gathered) = (vec![], vec![]);
        for (name, kind) in columns {
            let (cells, physical) = match kind {
                Kind::Count => (Present::Counts(vec![]), PhysicalType::INT64),
                Kind::Number => (Present::Numbers(vec![]), PhysicalType::DOUBLE),
                Kind::Word => (Present::Words(vec![]), PhysicalType::BYTE_ARRAY),
            };
            let field = Type::primitive_type_builder(name, physical)
                .with_logical_type((kind == Kind::Word).then_some(LogicalType::String))
                .with_repetition(Repetition::OPTIONAL);
            fields.push(Arc::new(field.build()?));
            gathered.push(Cells { levels: vec![], values: cells });
        }
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let pairs = about.iter().map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone()));
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(pairs.collect()));
        Ok(Self {
            out: SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build()))?,
            columns: gathered,
        })
    }

    fn n_rows(&self) -> usize {
        self.columns.first().map_or(0, |cells| cells.levels.len())
    }

    /// Writes and clears the current group of rows, if there are any.
    fn end_group(&mut self) -> Result<(), ParquetError> {
        if self.n_rows() == 0 {
            return Ok(());
        }
        let mut group = self.out.next_row_group()?;
        for cells in &mut self.columns {
            let column = group.next_column()?.expect("the schema has as many columns");
            cells.write(column)?;
        }
        group.close()?;
        Ok(())
    }

    fn finish(self) -> Result<(), ParquetError> {
        self.out.close()?;
        Ok(())
    }
}

/// The cells of a column: definition levels and values.
struct Cells {
    levels: Vec<i16>,
    values: Present,
}

enum Present {
    Counts(Vec<i64>),
    Numbers(Vec<f64>),
    Words(Vec<ByteArray>),
}

impl Cells {
    fn push(&mut self, cell: Cell<'_>) {
        self.levels.push(if cell == Cell::Nothing { NULL } else { VALUE });
        match (&mut self.values, cell) {
            (_, Cell::Nothing) => {}
            (Present::Counts(counts), Cell::Count(count)) => counts.push(count.cast_signed()),
            (Present::Numbers(numbers), Cell::Number(number)) => numbers.push(number),
            (Present::Words(words), Cell::Word(word)) => words.push(word.into()),
            _ => unreachable!("a column's cells are of its kind"),
        }
    }

    fn write(&mut self, column: SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        let Self { levels, values } = self;
        match values {
            Present::Counts(counts) => write_cells::<Int64Type>(levels, counts, column),
            Present::Numbers(numbers) => write_cells::<DoubleType>(levels, numbers, column),
            Present::Words(words) => write_cells::<ByteArrayType>(levels, words, column),
        }
    }
}

fn write_cells<D: DataType>(
    levels: &mut Vec<i16>,
    values: &mut Vec<D::T>,
    mut column: SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    column.typed::<D>().write_batch(values, Some(levels), None)?;
    levels.clear();
    values.clear();
    column.close()
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use parquet::{
        file::reader::{FileReader as _, SerializedFileReader},
        record::Field,
    };

    use super::*;
    use crate::sample_for_tests;

    fn read(group: usize) -> SerializedFileReader<Bytes> {
        let mut bytes = vec![];
        let record = sample_for_tests::record();
        let placed = Placed { record: &record, datum: None };
        in_groups(&placed, group, &mut bytes).expect("can be written");
        SerializedFileReader::new(Bytes::from(bytes)).expect("is a Parquet file")
    }

    #[test]
    fn every_cell_is_read_back_to_the_bit_for_any_grouping() {
        let expected = sample_for_tests::record().rows();
        for (group, groups) in [(1_000, 1), (10, 2), (1, expected.len())] {
            let file = read(group);
            assert_eq!(file.num_row_groups(), groups);
            let rows: Vec<_> = file.get_row_iter(None).expect("has rows").collect();
            assert_eq!(rows.len(), expected.len());
            for (row, expected) in rows.into_iter().zip(&expected) {
                let row = row.expect("can be read");
                assert_eq!(row.len(), COLUMNS.len());
                for ((name, field), column) in row.get_column_iter().zip(COLUMNS) {
                    assert_eq!(name, column.name);
                    let expected = match (column.cell)(expected) {
                        Cell::Nothing => Field::Null,
                        Cell::Count(count) => Field::Long(count.cast_signed()),
                        Cell::Number(number) => Field::Double(number),
                        Cell::Word(word) => Field::Str(word.to_owned()),
                    };
                    assert_eq!(field, &expected, "{name}");
                }
            }
        }
    }

    #[test]
    fn the_columns_are_compressed() {
        let file = read(1_000);
        let group = file.metadata().row_group(0);
        assert!(group.columns().iter().all(|column| column.compression() == Compression::SNAPPY));
    }
}
