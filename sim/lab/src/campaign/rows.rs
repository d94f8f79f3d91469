//! Results, a row for each run, written to Parquet and read back.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::sync::Arc;

use bytes::Bytes;
use parquet::{
    errors::ParquetError,
    file::reader::{FileReader as _, SerializedFileReader},
    record::Field,
};
use record::ExportError;
use record::parquet::write_table;
use record::table::{self, Kind};

/// Version of the table's columns.
pub const SCHEMA_VERSION: &str = "3";
/// Columns with measured times, which differ each time.
pub const MEASURED: [&str; 3] = ["solve_ms_p50", "solve_ms_p99", "run_s"];

/// Further columns in which less is better.
pub(super) const MORE: [&str; 4] = ["too_fast_steps_percent", "alarms", "alarm_s", "noticed_after_s"];

/// Columns of the planner's estimates: estimate, standard deviation, and step test.
pub(super) const LEARNT: [[&str; 3]; 3] = [
    ["heading_lag_s", "heading_lag_sigma_s", "heading_lag_tested_s"],
    ["surge_lag_s", "surge_lag_sigma_s", "surge_lag_tested_s"],
    ["sway_per_yaw_rate_s", "sway_per_yaw_rate_sigma_s", "sway_per_yaw_rate_tested_s"],
];

/// Columns of words; the others hold numbers.
const WORDS: [&str; 6] = ["scenario", "craft", "controller", "information", "objectives", "failure"];

/// Rows by the number of their run, all with the same columns; the first is `run`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    names: Vec<String>,
    rows: BTreeMap<u64, Vec<Cell>>,
}

#[derive(Clone, Debug, PartialEq)]
enum Cell {
    Number(Option<f64>),
    Word(Arc<str>),
}

/// Tables cannot be read or joined.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// Not Parquet.
    #[error("not Apache Parquet that this program wrote")]
    Parquet(#[from] ParquetError),
    /// The columns differ.
    #[error("its columns are not those of the other tables of this campaign: {0}")]
    Columns(String),
}

/// A row: names of its columns, and their cells. The first one is the run's number.
#[derive(Clone, Debug, Default)]
pub(super) struct RunRow(Vec<(String, Cell)>);

impl RunRow {
    pub(super) fn word(&mut self, name: &str, word: &str) {
        self.0.push((name.to_owned(), Cell::Word(word.into())));
    }

    pub(super) fn number(&mut self, name: &str, number: Option<f64>) {
        self.0.push((name.to_owned(), Cell::Number(number)));
    }

    pub(super) fn count(&mut self, name: &str, count: u64) {
        self.number(name, Some(count as f64));
    }
}

impl Rows {
    /// The table of these rows of one campaign.
    pub(super) fn of(rows: impl IntoIterator<Item = RunRow>) -> Self {
        let mut table = Self::default();
        for row in rows {
            let (names, cells) = row.0.into_iter().unzip();
            table.names = names;
            table.insert(cells);
        }
        table
    }

    /// The table with the columns of `row`.
    pub(super) fn without_rows(row: RunRow) -> Self {
        Self { rows: BTreeMap::new(), ..Self::of([row]) }
    }

    #[expect(clippy::cast_possible_truncation, reason = "numbers of runs, from 0 to 2⁵³")]
    fn insert(&mut self, cells: Vec<Cell>) {
        if let Some(Cell::Number(Some(run))) = cells.first() {
            self.rows.insert(*run as u64, cells);
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// `true` without rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The cells of a column, in the order of the runs.
    fn cells(&self, name: &str) -> Option<impl Iterator<Item = &Cell>> {
        let place = self.names.iter().position(|known| known == name)?;
        Some(self.rows.values().map(move |row| &row[place]))
    }

    /// A column's numbers in the order of the runs; `None` without a numeric column of that name.
    pub fn numbers(&self, name: &str) -> Option<Vec<Option<f64>>> {
        let number = |cell: &Cell| match cell {
            Cell::Number(number) => Some(*number),
            Cell::Word(_) => None,
        };
        self.cells(name)?.map(number).collect()
    }

    /// The words of a column, likewise.
    pub fn words(&self, name: &str) -> Option<Vec<&str>> {
        fn word(cell: &Cell) -> Option<&str> {
            match cell {
                Cell::Word(word) => Some(word),
                Cell::Number(_) => None,
            }
        }
        self.cells(name)?.map(word).collect()
    }

    pub(super) fn append(&mut self, other: Self) -> Result<(), RowsError> {
        if self.names.is_empty() {
            self.names = other.names;
        } else if self.names != other.names {
            return Err(RowsError::Columns(other.names.join(", ")));
        }
        self.rows.extend(other.rows);
        Ok(())
    }

    /// The row of a run; none if it is missing.
    pub(super) fn only(&self, number: u64) -> Option<Self> {
        Some(Self { names: self.names.clone(), rows: [(number, self.rows.get(&number)?.clone())].into() })
    }

    /// SHA-256 of all cells except the measured ones, column by column. Equal rows: equal digests.
    pub fn digest(&self) -> String {
        let mut bytes = vec![];
        let is_measured = |name: &str| MEASURED.contains(&name);
        for name in self.names.iter().filter(|name| !is_measured(name)) {
            bytes.extend(name.as_bytes());
            for cell in self.cells(name).into_iter().flatten() {
                match cell {
                    Cell::Number(number) => bytes.extend(number.map_or([0xff; 8], f64::to_le_bytes)),
                    Cell::Word(word) => {
                        bytes.extend(word.len().to_le_bytes());
                        bytes.extend(word.as_bytes());
                    }
                }
            }
        }
        wire::sha256(&bytes)
    }

    /// Writes Parquet; `about` goes into its metadata.
    pub(super) fn write(
        &self,
        about: &[(&'static str, String)],
        out: &mut (impl Write + Send),
    ) -> Result<(), ExportError> {
        fn exported(cell: &Cell) -> table::Cell<'_> {
            match cell {
                Cell::Number(number) => number.map_or(table::Cell::Nothing, table::Cell::Number),
                Cell::Word(word) => table::Cell::Word(word),
            }
        }
        let columns = self.names.iter().map(|name| {
            let is_word = WORDS.contains(&name.as_str());
            (name.as_str(), if is_word { Kind::Word } else { Kind::Number })
        });
        let rows = self.rows.values().map(|row| row.iter().map(exported));
        write_table("runs", columns, about, rows, out)
    }

    /// Reads what [`Self::write`] wrote.
    pub(super) fn read(bytes: Vec<u8>) -> Result<Self, RowsError> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let columns = file.metadata().file_metadata().schema_descr().columns().iter();
        let names = columns.map(|column| column.name().to_owned()).collect();
        // The same few names are in thousands of rows.
        let mut known: BTreeSet<Arc<str>> = BTreeSet::new();
        let mut word = |word: &str| {
            let word = known.get(word).cloned().unwrap_or_else(|| word.into());
            known.insert(Arc::clone(&word));
            Cell::Word(word)
        };
        let mut table = Self::default();
        for row in file.get_row_iter(None)? {
            let row = row?;
            let cells = row.get_column_iter().map(|(name, field)| match field {
                Field::Double(number) => Cell::Number(Some(*number)),
                Field::Str(text) => word(text),
                _ if WORDS.contains(&name.as_str()) => word(""),
                _ => Cell::Number(None),
            });
            table.insert(cells.collect());
        }
        Ok(Self { names, ..table })
    }
}
