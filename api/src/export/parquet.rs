//! A record as Apache Parquet: the columns of the CSV with full precision, nulls where there was nothing to
//! tell, and what the record is of in the file's key-value metadata.

use std::{
    borrow::Cow,
    io::{self, Write},
    sync::Arc,
};

use parquet::{
    basic::{LogicalType, Repetition, Type as PhysicalType},
    data_type::{ByteArray, ByteArrayType, DoubleType},
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
    write_in_groups(table, DEFAULT_MAX_ROW_GROUP_ROW_COUNT, out).map_err(|error| {
        ExportError::Write(match error {
            ParquetError::External(source) => match source.downcast::<io::Error>() {
                Ok(error) => *error,
                Err(source) => io::Error::other(source),
            },
            error => io::Error::other(error),
        })
    })
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
    let mut file = SerializedFileWriter::new(out, Arc::new(schema(table)?), Arc::new(properties(table)))?;
    for start in (0..n_rows).step_by(rows_per_group) {
        let rows = start..n_rows.min(start + rows_per_group);
        let mut group = file.next_row_group()?;
        for column in &table.columns {
            let cells = group
                .next_column()?
                .expect("the schema has as many columns as the table");
            match &column.values {
                Values::Numbers(numbers) => write_numbers(&numbers[rows.clone()], cells)?,
                Values::Words(words) => write_words(&words[rows.clone()], cells)?,
            }
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

fn schema(table: &Table) -> Result<Type, ParquetError> {
    let fields = table
        .columns
        .iter()
        .map(|column| {
            let (physical, logical) = match column.values {
                Values::Numbers(_) => (PhysicalType::DOUBLE, None),
                Values::Words(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
            };
            Type::primitive_type_builder(&column.name, physical)
                .with_logical_type(logical)
                .with_repetition(Repetition::OPTIONAL)
                .build()
                .map(Arc::new)
        })
        .collect::<Result<_, _>>()?;
    Type::group_type_builder(table.name).with_fields(fields).build()
}

fn properties(table: &Table) -> WriterProperties {
    let pairs = table.about.iter();
    let pairs = pairs.map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone()));
    WriterProperties::builder()
        .set_key_value_metadata(Some(pairs.collect()))
        .build()
}

fn write_numbers(numbers: &[Option<f64>], mut cells: SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
    let levels: Vec<i16> = numbers
        .iter()
        .map(|number| if number.is_some() { VALUE } else { NULL })
        .collect();
    let values: Vec<f64> = numbers.iter().copied().flatten().collect();
    cells
        .typed::<DoubleType>()
        .write_batch(&values, Some(&levels), None)?;
    cells.close()
}

fn write_words(
    words: &[Cow<'static, str>],
    mut cells: SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    let values: Vec<ByteArray> = words.iter().map(|word| ByteArray::from(word.as_ref())).collect();
    let levels = vec![VALUE; words.len()];
    cells
        .typed::<ByteArrayType>()
        .write_batch(&values, Some(&levels), None)?;
    cells.close()
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
