//! Results as a table with a row for each run, written to Parquet and read back.

use std::{borrow::Cow, collections::BTreeMap, io::Write};

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
    /// Step tests of the craft: lag of the heading loop, lag of the surge loop, sway per yaw rate, s.
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

/// Columns of what the planner learnt: estimate, standard deviation, and step test.
pub(super) const LEARNT: [[&str; 3]; 3] = [
    ["heading_lag_s", "heading_lag_sigma_s", "heading_lag_tested_s"],
    ["surge_lag_s", "surge_lag_sigma_s", "surge_lag_tested_s"],
    [
        "sway_per_yaw_rate_s",
        "sway_per_yaw_rate_sigma_s",
        "sway_per_yaw_rate_tested_s",
    ],
];

/// Rows in any order, stored by column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    columns: Vec<Column>,
}

/// Why tables cannot be read or joined.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// Not Parquet.
    #[error("not Apache Parquet that this program wrote")]
    Parquet(#[from] ParquetError),
    /// The columns differ.
    #[error("its columns are not those of the other tables of this campaign: {0}")]
    Columns(String),
}

impl Rows {
    /// The table of `rows`; `parameters` are the keys of the parameters.
    pub(super) fn of(rows: &[RunResult], parameters: &[&str]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "runs and seeds are below 2⁵³")]
        fn count(value: u64) -> f64 {
            value as f64
        }
        type Number<'a> = &'a dyn Fn(&RunResult) -> Option<f64>;
        let words = |name: &str, of: fn(&RunResult) -> &str| Column {
            name: name.to_owned(),
            values: Values::Words(rows.iter().map(|row| Cow::Owned(of(row).to_owned())).collect()),
        };
        let numbers = |name: &str, of: Number<'_>| Column {
            name: name.to_owned(),
            values: Values::Numbers(rows.iter().map(of).collect()),
        };
        let score = |row: &RunResult| row.outcome.as_ref().ok().map(|outcome| outcome.score.clone());
        let learnt = |row: &RunResult| row.outcome.as_ref().ok()?.learnt.clone();
        let mut columns = vec![
            numbers("run", &|row| Some(count(row.run))),
            words("scenario", |row| &row.scenario),
            words("craft", |row| &row.craft),
            words("controller", |row| &row.controller),
            words("information", |row| &row.information),
            words("objectives", |row| &row.objectives),
            numbers("replicate", &|row| Some(count(row.replicate))),
            numbers("seed", &|row| Some(count(row.seed))),
            numbers("look_ahead_m", &|row| Some(row.tuning?.gains.look_ahead)),
            numbers("along_track_gain_per_s", &|row| {
                Some(row.tuning?.gains.along_track_gain)
            }),
            numbers("integral_gain_mps", &|row| Some(row.tuning?.integral_gain)),
            numbers("dwell_s", &|row| row.dwell_s),
        ];
        for (k, key) in parameters.iter().enumerate() {
            let name = format!("param.{key}");
            columns.push(numbers(&name, &|row| row.parameters.get(k).copied()));
        }
        columns.extend(SCORES.map(|column| numbers(column.0, &|row| score(row)?.value(column))));
        let [too_fast, alarms, alarm_s, noticed] = MORE;
        #[expect(clippy::cast_precision_loss, reason = "an alarm a second at most")]
        columns.extend([
            numbers(too_fast, &|row| row.outcome.as_ref().ok()?.too_fast_steps_percent),
            numbers(alarms, &|row| Some(learnt(row)?.alarms_at_s.len() as f64)),
            numbers(alarm_s, &|row| Some(learnt(row)?.alarm_s)),
            numbers(noticed, &|row| learnt(row)?.noticed_after_s(row.breaks_at_s?)),
        ]);
        for (k, [value, sigma, tested]) in LEARNT.into_iter().enumerate() {
            columns.extend([
                numbers(value, &|row| Some(learnt(row)?.estimates?[k].0)),
                numbers(sigma, &|row| Some(learnt(row)?.estimates?[k].1)),
                numbers(tested, &|row| Some(row.tested?[k])),
            ]);
        }
        columns.extend([
            numbers("bound_rms_m", &|row| row.bound_rms_m),
            words("failure", |row| row.outcome.as_ref().err().map_or("", |why| why)),
            numbers("solve_ms_p50", &|row| score(row)?.metrics.solve_ms_p50),
            numbers("solve_ms_p99", &|row| score(row)?.metrics.solve_ms_p99),
            numbers("run_s", &|row| Some(row.run_s)),
        ]);
        Self { columns }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |column| match &column.values {
            Values::Numbers(numbers) => numbers.len(),
            Values::Words(words) => words.len(),
        })
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    fn column(&self, name: &str) -> Option<&Values> {
        let mut columns = self.columns.iter();
        Some(&columns.find(|column| column.name == name)?.values)
    }

    /// The numbers of a column; none where no column of numbers has that name.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<&[Option<f64>]> {
        match self.column(name)? {
            Values::Numbers(numbers) => Some(numbers),
            Values::Words(_) => None,
        }
    }

    /// The words of a column; none where no column of words has that name.
    #[must_use]
    pub fn words(&self, name: &str) -> Option<&[Cow<'static, str>]> {
        match self.column(name)? {
            Values::Words(words) => Some(words),
            Values::Numbers(_) => None,
        }
    }

    /// Appends `other`.
    pub(super) fn append(&mut self, other: Self) -> Result<(), RowsError> {
        if self.columns.is_empty() {
            *self = other;
            return Ok(());
        }
        if !self.names().eq(other.names()) {
            return Err(RowsError::Columns(other.names().collect::<Vec<_>>().join(", ")));
        }
        for (column, more) in self.columns.iter_mut().zip(other.columns) {
            match (&mut column.values, more.values) {
                (Values::Numbers(all), Values::Numbers(more)) => all.extend(more),
                (Values::Words(all), Values::Words(more)) => all.extend(more),
                _ => return Err(RowsError::Columns(column.name.clone())),
            }
        }
        Ok(())
    }

    /// The row of a run; none if it is missing.
    pub(super) fn only(&self, number: u64) -> Option<Self> {
        #[expect(clippy::cast_precision_loss, reason = "runs are below 2⁵³")]
        let wanted = Some(number as f64);
        let place = self.numbers("run")?.iter().position(|run| *run == wanted)?;
        Some(self.picked(&[place]))
    }

    /// The rows in the order of the runs.
    pub(super) fn sorted(&self) -> Self {
        let runs = self.numbers("run").unwrap_or_default().iter();
        let runs: Vec<f64> = runs.map(|run| run.unwrap_or(f64::NAN)).collect();
        let mut order: Vec<usize> = (0..runs.len()).collect();
        order.sort_by(|&a, &b| runs[a].total_cmp(&runs[b]));
        self.picked(&order)
    }

    /// The rows at these places.
    fn picked(&self, places: &[usize]) -> Self {
        let columns = self.columns.iter().map(|column| Column {
            name: column.name.clone(),
            values: match &column.values {
                Values::Numbers(numbers) => Values::Numbers(places.iter().map(|&i| numbers[i]).collect()),
                Values::Words(words) => Values::Words(places.iter().map(|&i| words[i].clone()).collect()),
            },
        });
        Self {
            columns: columns.collect(),
        }
    }

    /// SHA-256 of all cells except the measured ones, in the order of the runs. Equal results have equal digests.
    #[must_use]
    pub fn digest(&self) -> String {
        let mut bytes = vec![];
        let sorted = self.sorted();
        for column in sorted
            .columns
            .iter()
            .filter(|column| !MEASURED.contains(&column.name.as_str()))
        {
            bytes.extend(column.name.as_bytes());
            match &column.values {
                Values::Numbers(numbers) => {
                    for number in numbers {
                        bytes.extend(number.map_or([0xff; 8], f64::to_le_bytes));
                    }
                }
                Values::Words(words) => {
                    for word in words {
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
        write_table(
            &Table {
                name: "runs",
                columns: self.columns.clone(),
                about,
            },
            out,
        )
    }

    /// Reads what [`Self::write`] wrote.
    pub(super) fn read(bytes: Vec<u8>) -> Result<Self, RowsError> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let schema = file.metadata().file_metadata().schema_descr();
        let mut columns: Vec<Column> = schema
            .columns()
            .iter()
            .map(|column| Column {
                name: column.name().to_owned(),
                values: if column.physical_type() == parquet::basic::Type::BYTE_ARRAY {
                    Values::Words(vec![])
                } else {
                    Values::Numbers(vec![])
                },
            })
            .collect();
        // The same few names are in thousands of rows.
        let mut known: BTreeMap<String, Cow<'static, str>> = BTreeMap::new();
        for row in file.get_row_iter(None)? {
            for (column, (_, field)) in columns.iter_mut().zip(row?.get_column_iter()) {
                match (&mut column.values, field) {
                    (Values::Numbers(numbers), Field::Double(number)) => numbers.push(Some(*number)),
                    (Values::Numbers(numbers), _) => numbers.push(None),
                    (Values::Words(words), Field::Str(word)) => {
                        words.push(
                            known
                                .entry(word.clone())
                                .or_insert_with(|| Cow::Owned(word.clone()))
                                .clone(),
                        );
                    }
                    (Values::Words(words), _) => words.push(Cow::Borrowed("")),
                }
            }
        }
        Ok(Self { columns })
    }
}
