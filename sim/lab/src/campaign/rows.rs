//! Results, a row for each run, written to Parquet and read back.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
    io::Write,
    sync::Arc,
};

use bytes::Bytes;
use parquet::{
    errors::ParquetError,
    file::reader::{FileReader as _, SerializedFileReader},
    record::Field,
};
use planner::los::LosTuning;
use record::{
    ExportError,
    parquet::{Column, Table, Values, write_table},
};

use super::{
    learnt::Learnt,
    score::{SCORES, Score},
};

/// Version of the table's columns.
pub const SCHEMA_VERSION: &str = "3";
/// Columns with measured times, which differ each time.
pub const MEASURED: [&str; 3] = ["solve_ms_p50", "solve_ms_p99", "run_s"];

/// The result of a run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RunResult {
    pub(super) run: u64,
    pub(super) scenario: String,
    pub(super) craft: String,
    pub(super) controller: String,
    pub(super) information: String,
    pub(super) objectives: String,
    pub(super) replicate: u64,
    pub(super) seed: u64,
    pub(super) tuning: Option<LosTuning>,
    /// Time of a rule, s.
    pub(super) dwell_s: Option<f64>,
    /// Values, in the campaign's order.
    pub(super) parameters: Vec<f64>,
    /// Its outcome, or why it failed.
    pub(super) outcome: Result<Outcome, String>,
    /// Step tests of the craft: heading lag, surge lag, sway per yaw rate, s.
    pub(super) tested: Option<[f64; 3]>,
    /// Time of a breakdown, s.
    pub(super) breaks_at_s: Option<f64>,
    pub(super) bound_rms_m: Option<f64>,
    pub(super) run_s: f64,
}

/// The outcome of a mission.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outcome {
    pub(super) score: Score,
    /// Share of seconds in which the heading reference steps by more than the craft can turn, %.
    pub(super) too_fast_steps_percent: Option<f64>,
    pub(super) learnt: Option<Learnt>,
}

/// Further columns in which less is better.
pub(super) const MORE: [&str; 4] = ["too_fast_steps_percent", "alarms", "alarm_s", "noticed_after_s"];

/// Columns of the planner's estimates: estimate, standard deviation, and step test.
pub(super) const LEARNT: [[&str; 3]; 3] = [
    ["heading_lag_s", "heading_lag_sigma_s", "heading_lag_tested_s"],
    ["surge_lag_s", "surge_lag_sigma_s", "surge_lag_tested_s"],
    [
        "sway_per_yaw_rate_s",
        "sway_per_yaw_rate_sigma_s",
        "sway_per_yaw_rate_tested_s",
    ],
];

/// Columns of words; the others hold numbers.
const WORDS: [&str; 6] = [
    "scenario",
    "craft",
    "controller",
    "information",
    "objectives",
    "failure",
];

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

/// A column to be: its name, and its cell of a row.
type Named<'a> = (String, Box<dyn Fn(&RunResult) -> Cell + 'a>);

fn words(name: &str, of: fn(&RunResult) -> &str) -> Named<'static> {
    (name.to_owned(), Box::new(move |row| Cell::Word(of(row).into())))
}

fn numbers<'a>(name: &str, of: impl Fn(&RunResult) -> Option<f64> + 'a) -> Named<'a> {
    (name.to_owned(), Box::new(move |row| Cell::Number(of(row))))
}

impl Rows {
    /// The table of `rows`; `parameters` are the keys of the parameters.
    pub(super) fn of(rows: &[RunResult], parameters: &[&str]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "runs and seeds are below 2⁵³")]
        fn count(value: u64) -> f64 {
            value as f64
        }
        let score = |row: &RunResult| row.outcome.as_ref().ok().map(|outcome| outcome.score.clone());
        let learnt = |row: &RunResult| row.outcome.as_ref().ok()?.learnt.clone();
        let mut columns = vec![
            numbers("run", |row| Some(count(row.run))),
            words("scenario", |row| &row.scenario),
            words("craft", |row| &row.craft),
            words("controller", |row| &row.controller),
            words("information", |row| &row.information),
            words("objectives", |row| &row.objectives),
            numbers("replicate", |row| Some(count(row.replicate))),
            numbers("seed", |row| Some(count(row.seed))),
            numbers("look_ahead_m", |row| Some(row.tuning?.gains.look_ahead)),
            numbers("along_track_gain_per_s", |row| {
                Some(row.tuning?.gains.along_track_gain)
            }),
            numbers("integral_gain_mps", |row| Some(row.tuning?.integral_gain)),
            numbers("dwell_s", |row| row.dwell_s),
        ];
        for (k, key) in parameters.iter().enumerate() {
            let name = format!("param.{key}");
            columns.push(numbers(&name, move |row| row.parameters.get(k).copied()));
        }
        columns.extend(SCORES.map(|column| numbers(column.0, move |row| score(row)?.value(column))));
        let [too_fast, alarms, alarm_s, noticed] = MORE;
        #[expect(clippy::cast_precision_loss, reason = "an alarm a second at most")]
        columns.extend([
            numbers(too_fast, |row| row.outcome.as_ref().ok()?.too_fast_steps_percent),
            numbers(alarms, |row| Some(learnt(row)?.alarms_at_s.len() as f64)),
            numbers(alarm_s, |row| Some(learnt(row)?.alarm_s)),
            numbers(noticed, |row| learnt(row)?.noticed_after_s(row.breaks_at_s?)),
        ]);
        for (k, [value, sigma, tested]) in LEARNT.into_iter().enumerate() {
            columns.extend([
                numbers(value, move |row| Some(learnt(row)?.estimates?[k].0)),
                numbers(sigma, move |row| Some(learnt(row)?.estimates?[k].1)),
                numbers(tested, move |row| Some(row.tested?[k])),
            ]);
        }
        columns.extend([
            numbers("bound_rms_m", |row| row.bound_rms_m),
            words("failure", |row| row.outcome.as_ref().err().map_or("", |why| why)),
            numbers("solve_ms_p50", |row| score(row)?.metrics.solve_ms_p50),
            numbers("solve_ms_p99", |row| score(row)?.metrics.solve_ms_p99),
            numbers("run_s", |row| Some(row.run_s)),
        ]);
        let cells = |row: &RunResult| columns.iter().map(|(_, of)| of(row)).collect();
        Self {
            rows: rows.iter().map(|row| (row.run, cells(row))).collect(),
            names: columns.iter().map(|(name, _)| name.clone()).collect(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// `true` without rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The cells of a column, in the order of the runs.
    fn cells(&self, name: &str) -> Option<impl Iterator<Item = &Cell>> {
        let place = self.names.iter().position(|known| known == name)?;
        Some(self.rows.values().map(move |row| &row[place]))
    }

    /// A column's numbers in the order of the runs; `None` without a numeric column of that name.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<Vec<Option<f64>>> {
        let number = |cell: &Cell| match cell {
            Cell::Number(number) => Some(*number),
            Cell::Word(_) => None,
        };
        self.cells(name)?.map(number).collect()
    }

    /// The words of a column, likewise.
    #[must_use]
    pub fn words(&self, name: &str) -> Option<Vec<&str>> {
        fn word(cell: &Cell) -> Option<&str> {
            match cell {
                Cell::Word(word) => Some(word),
                Cell::Number(_) => None,
            }
        }
        self.cells(name)?.map(word).collect()
    }

    /// Adds the rows of `other`.
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
        Some(Self {
            names: self.names.clone(),
            rows: [(number, self.rows.get(&number)?.clone())].into(),
        })
    }

    /// SHA-256 of all cells except the measured ones, column by column. Equal rows: equal digests.
    #[must_use]
    pub fn digest(&self) -> String {
        let mut bytes = vec![];
        for name in self
            .names
            .iter()
            .filter(|name| !MEASURED.contains(&name.as_str()))
        {
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
        about: Vec<(&'static str, String)>,
        out: &mut (impl Write + Send),
    ) -> Result<(), ExportError> {
        let values = |name: &str| {
            if WORDS.contains(&name) {
                let words = self.words(name).unwrap_or_default();
                return Values::Words(
                    words
                        .into_iter()
                        .map(|word| Cow::Owned(word.to_owned()))
                        .collect(),
                );
            }
            Values::Numbers(self.numbers(name).unwrap_or_default())
        };
        let columns = self.names.iter().map(|name| Column {
            name: name.clone(),
            values: values(name),
        });
        let table = Table {
            name: "runs",
            columns: columns.collect(),
            about,
        };
        write_table(&table, out)
    }

    /// Reads what [`Self::write`] wrote.
    pub(super) fn read(bytes: Vec<u8>) -> Result<Self, RowsError> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let schema = file.metadata().file_metadata().schema_descr();
        let names: Vec<String> = schema
            .columns()
            .iter()
            .map(|column| column.name().to_owned())
            .collect();
        // The same few names are in thousands of rows.
        let mut known: BTreeSet<Arc<str>> = BTreeSet::new();
        let mut word = |word: &str| {
            let word = known.get(word).cloned().unwrap_or_else(|| word.into());
            known.insert(Arc::clone(&word));
            Cell::Word(word)
        };
        let mut rows = BTreeMap::new();
        for row in file.get_row_iter(None)? {
            let row = row?;
            let cells = row.get_column_iter().map(|(name, field)| match field {
                Field::Double(number) => Cell::Number(Some(*number)),
                Field::Str(text) => word(text),
                _ if WORDS.contains(&name.as_str()) => word(""),
                _ => Cell::Number(None),
            });
            let cells: Vec<Cell> = cells.collect();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "numbers of runs, from 0 to 2⁵³"
            )]
            if let Some(Cell::Number(Some(run))) = cells.first() {
                rows.insert(*run as u64, cells);
            }
        }
        Ok(Self { names, rows })
    }
}
