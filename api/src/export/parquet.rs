//! A record as Apache Parquet: the columns of the CSV with full precision, nulls where there was nothing to
//! tell, and what the record is of in the file's key-value metadata.

use std::{
    io::{self, Write},
    sync::Arc,
};

use parquet::{
    basic::{LogicalType, Repetition, Type as PhysicalType},
    data_type::{ByteArrayType, DataType, DoubleType},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::{DEFAULT_MAX_ROW_GROUP_ROW_COUNT, WriterProperties},
        writer::{SerializedColumnWriter, SerializedFileWriter},
    },
    schema::types::Type,
};
use sim::record::{Column, Record, Values};

use super::{ExportError, about};

/// Definition levels of an optional column's cells.
const NULL: i16 = 0;
const VALUE: i16 = 1;

pub(super) fn write(record: &Record, out: &mut (impl Write + Send)) -> Result<(), ExportError> {
    write_table(&table(record), out)
}

/// Columns of equal length, as a file.
pub(crate) struct Table {
    /// The schema's name.
    pub(crate) name: &'static str,
    /// The columns, at least one.
    pub(crate) columns: Vec<Column>,
    /// What the file says of itself.
    pub(crate) about: Vec<(&'static str, String)>,
}

fn table(record: &Record) -> Table {
    Table {
        name: "record",
        columns: record.columns(),
        about: about(record).into(),
    }
}

/// Writes `table`. Equal tables give equal bytes.
pub(crate) fn write_table(table: &Table, out: &mut (impl Write + Send)) -> Result<(), ExportError> {
    write_in_groups(table, DEFAULT_MAX_ROW_GROUP_ROW_COUNT, out)
        .map_err(|error| ExportError::Write(not_written(error)))
}

/// What a file refused with, where it was the file.
pub(crate) fn not_written(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(source) => io::Error::other(source),
        },
        error => io::Error::other(error),
    }
}

/// Readers hold a row group at a time: one, unless the mission is of millions of ticks.
fn write_in_groups(
    table: &Table,
    rows_per_group: usize,
    out: &mut (impl Write + Send),
) -> Result<(), ParquetError> {
    let n_rows = table.columns.first().map_or(0, |column| match &column.values {
        Values::Numbers(numbers) => numbers.len(),
        Values::Words(words) => words.len(),
    });
    let mut file =
        SerializedFileWriter::new(out, Arc::new(schema(table)?), Arc::new(properties(&table.about)))?;
    for start in (0..n_rows).step_by(rows_per_group) {
        let rows = start..n_rows.min(start + rows_per_group);
        let mut group = file.next_row_group()?;
        for column in &table.columns {
            let cells = group
                .next_column()?
                .expect("the schema has as many columns as the table");
            match &column.values {
                Values::Numbers(numbers) => {
                    write_cells::<DoubleType>(numbers[rows.clone()].iter().copied(), cells)?;
                }
                Values::Words(words) => {
                    let words = words[rows.clone()].iter();
                    write_cells::<ByteArrayType>(words.map(|word| Some(word.as_ref().into())), cells)?;
                }
            }
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

fn schema(table: &Table) -> Result<Type, ParquetError> {
    let columns = table.columns.iter().map(|column| {
        let physical = match column.values {
            Values::Numbers(_) => PhysicalType::DOUBLE,
            Values::Words(_) => PhysicalType::BYTE_ARRAY,
        };
        (column.name.as_str(), physical)
    });
    schema_of(table.name, columns)
}

/// A table of columns whose cells may be null. Bytes are words.
pub(crate) fn schema_of<'a>(
    name: &str,
    columns: impl Iterator<Item = (&'a str, PhysicalType)>,
) -> Result<Type, ParquetError> {
    let fields = columns
        .map(|(name, physical)| {
            let is_word = physical == PhysicalType::BYTE_ARRAY;
            Type::primitive_type_builder(name, physical)
                .with_logical_type(is_word.then_some(LogicalType::String))
                .with_repetition(Repetition::OPTIONAL)
                .build()
                .map(Arc::new)
        })
        .collect::<Result<_, _>>()?;
    Type::group_type_builder(name).with_fields(fields).build()
}

/// What the file says of itself.
pub(crate) fn properties(about: &[(&'static str, String)]) -> WriterProperties {
    let pairs = about
        .iter()
        .map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone()));
    WriterProperties::builder()
        .set_key_value_metadata(Some(pairs.collect()))
        .build()
}

/// Writes the cells of a column.
pub(crate) fn write_cells<D: DataType>(
    cells: impl Iterator<Item = Option<D::T>>,
    mut column: SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (vec![], vec![]);
    for cell in cells {
        levels.push(if cell.is_some() { VALUE } else { NULL });
        values.extend(cell);
    }
    column.typed::<D>().write_batch(&values, Some(&levels), None)?;
    column.close()
}

#[cfg(test)]
mod tests {
    use axum::body::Bytes;
    use parquet::{
        file::reader::{FileReader as _, SerializedFileReader},
        record::Field,
    };

    use super::*;
    use crate::export::sample;

    fn read(rows_per_group: usize) -> SerializedFileReader<Bytes> {
        let mut bytes = vec![];
        write_in_groups(&table(&sample::record()), rows_per_group, &mut bytes).expect("can be written");
        SerializedFileReader::new(Bytes::from(bytes)).expect("is a Parquet file")
    }

    #[test]
    fn every_cell_comes_back_bit_for_bit_however_the_rows_are_grouped() {
        let columns = sample::record().columns();
        for (rows_per_group, groups) in [(1_000, 1), (2, 2), (1, 3)] {
            let file = read(rows_per_group);
            assert_eq!(file.num_row_groups(), groups);
            let mut n_rows = 0;
            for (i, row) in file.get_row_iter(None).expect("has rows").enumerate() {
                let row = row.expect("can be read");
                assert_eq!(row.len(), columns.len());
                n_rows += 1;
                for ((name, field), column) in row.get_column_iter().zip(&columns) {
                    assert_eq!(name, &column.name);
                    let expected = match &column.values {
                        Values::Numbers(numbers) => numbers[i].map_or(Field::Null, Field::Double),
                        Values::Words(words) => Field::Str(words[i].to_string()),
                    };
                    assert_eq!(field, &expected, "{name} of row {i}");
                }
            }
            assert_eq!(n_rows, 3);
        }
    }

    #[test]
    fn the_file_says_what_it_is_of() {
        let file = read(10);
        let pairs = file
            .metadata()
            .file_metadata()
            .key_value_metadata()
            .expect("has pairs");
        let value = |key: &str| {
            let pair = pairs.iter().find(|pair| pair.key == key);
            pair.and_then(|pair| pair.value.as_deref())
        };
        assert_eq!(value("schema_version"), Some("1"));
        assert_eq!(value("scenario"), Some("by-hand"));
        assert_eq!(value("title"), Some("Three ticks, made by hand"));
        assert_eq!(value("guide"), Some("mpc"));
        assert_eq!(value("seed"), Some("7"));
        assert_eq!(value("interval_s"), Some("0.5"));
    }
}
