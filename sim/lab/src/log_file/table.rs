//! A table of named columns, whatever the format of its file.

use std::collections::BTreeMap;

use bytes::Bytes;
use mcap::MessageStream;
use parquet::{
    file::reader::{FileReader as _, SerializedFileReader},
    record::Field,
};
use record::{mcap::ROWS, with_commas};
use serde_json::{Map, Value};

use super::LogFileError;

/// Rows by column name.
pub(super) struct Table {
    /// Place of each column in a row.
    names: BTreeMap<String, usize>,
    pub(super) rows: Vec<Vec<Cell>>,
}

/// A cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Nothing,
    Number(f64),
    Word(String),
}

impl Table {
    fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let places = names.enumerate().map(|(i, name)| (name.trim().to_owned(), i));
        Self {
            names: places.collect(),
            rows: Vec::new(),
        }
    }

    /// Place of the first of `names` that is a column.
    pub(super) fn column(&self, names: &[&'static str]) -> Option<(&'static str, usize)> {
        let place = |name: &&'static str| Some((*name, *self.names.get(*name)?));
        names.iter().find_map(place)
    }

    /// The word in a row's column; empty if it holds a number.
    pub(super) fn word(&self, row: usize, place: Option<usize>) -> Option<&str> {
        match self.rows[row].get(place?)? {
            Cell::Nothing => None,
            Cell::Number(_) => Some(""),
            Cell::Word(word) => Some(word),
        }
    }
}

pub(super) fn of_csv(bytes: &[u8]) -> Result<Table, LogFileError> {
    let bytes = with_commas(bytes);
    let mut reader = csv::Reader::from_reader(&*bytes);
    let mut table = Table::new(reader.headers()?.iter());
    for record in reader.records() {
        let cell = |text: &str| match (text.trim(), text.trim().parse()) {
            ("", _) => Cell::Nothing,
            (_, Ok(number)) => Cell::Number(number),
            (word, Err(_)) => Cell::Word(word.to_owned()),
        };
        table.rows.push(record?.iter().map(cell).collect());
    }
    Ok(table)
}

pub(super) fn of_parquet(bytes: Vec<u8>) -> Result<Table, LogFileError> {
    let file = SerializedFileReader::new(Bytes::from(bytes))?;
    let schema = file.metadata().file_metadata().schema_descr();
    let names: Vec<_> = schema
        .columns()
        .iter()
        .map(|column| column.name().to_owned())
        .collect();
    let mut table = Table::new(names.iter().map(String::as_str));
    for row in file.get_row_iter(None)? {
        let cell = |field: &Field| match field {
            Field::Double(number) => Cell::Number(*number),
            Field::Float(number) => Cell::Number(f64::from(*number)),
            Field::Int(number) => Cell::Number(f64::from(*number)),
            #[expect(clippy::cast_precision_loss, reason = "counts, and times in whole seconds")]
            Field::Long(number) => Cell::Number(*number as f64),
            Field::Str(word) => Cell::Word(word.clone()),
            _ => Cell::Nothing,
        };
        table
            .rows
            .push(row?.get_column_iter().map(|(_, field)| cell(field)).collect());
    }
    Ok(table)
}

pub(super) fn of_mcap(bytes: &[u8]) -> Result<Table, LogFileError> {
    let mut rows: Vec<Map<String, Value>> = Vec::new();
    for message in MessageStream::new(bytes)? {
        let message = message?;
        if message.channel.topic == ROWS {
            rows.extend(serde_json::from_slice::<Map<String, Value>>(&message.data).ok());
        }
    }
    let mut names: Vec<&str> = rows
        .iter()
        .flat_map(|row| row.keys().map(String::as_str))
        .collect();
    names.sort_unstable();
    names.dedup();
    if names.is_empty() {
        return Err(LogFileError::NoRows);
    }
    let cell = |row: &Map<String, Value>, name: &str| match row.get(name) {
        Some(Value::Number(number)) => number.as_f64().map_or(Cell::Nothing, Cell::Number),
        Some(Value::String(word)) => Cell::Word(word.clone()),
        Some(_) | None => Cell::Nothing,
    };
    let mut table = Table::new(names.iter().copied());
    table.rows = rows
        .iter()
        .map(|row| names.iter().map(|name| cell(row, name)).collect())
        .collect();
    Ok(table)
}
