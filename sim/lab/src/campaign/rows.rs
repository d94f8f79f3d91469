//! Results as a table: a row a run, and its way into Parquet and back.

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
    fly::Learnt,
    score::{SCORES, Score},
};

/// Version of the table's columns.
pub const SCHEMA_VERSION: &str = "2";
/// Columns that are measured by the clock, and are other ones each time.
pub const MEASURED: [&str; 3] = ["solve_ms_p50", "solve_ms_p99", "run_s"];
/// What begins the names of columns that hold parameters.
pub const PARAMETER: &str = "param.";

/// What a run came to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) run: u64,
    pub(super) scenario: String,
    pub(super) craft: String,
    pub(super) controller: String,
    pub(super) information: String,
    pub(super) objectives: String,
    pub(super) replicate: u64,
    pub(super) seed: u64,
    pub(super) tuning: Option<LosTuning>,
    /// Values, in the campaign's order.
    pub(super) parameters: Vec<f64>,
    /// What it came to, or why it failed.
    pub(super) outcome: Result<Outcome, String>,
    /// What step tests of the craft found: lag of the heading loop, lag of the surge loop, sway per yaw rate, s.
    pub(super) tested: Option<[f64; 3]>,
    /// When something breaks, s.
    pub(super) breaks_at_s: Option<f64>,
    pub(super) bound_rms_m: Option<f64>,
    pub(super) run_s: f64,
}

/// What a mission came to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outcome {
    pub(super) score: Score,
    /// Share of the seconds at whose end the heading reference steps by more than the craft turns in one, %.
    pub(super) too_fast_steps_percent: Option<f64>,
    pub(super) learnt: Option<Learnt>,
}

/// Columns beside the scores in which less is better.
pub(super) const MORE: [&str; 4] = ["too_fast_steps_percent", "alarms", "alarm_s", "noticed_after_s"];

/// Columns of what the planner made of its craft: estimate, standard deviation, and what step tests found.
pub(super) const LEARNT: [[&str; 3]; 3] = [
    ["heading_lag_s", "heading_lag_sigma_s", "heading_lag_tested_s"],
    ["surge_lag_s", "surge_lag_sigma_s", "surge_lag_tested_s"],
    [
        "sway_per_yaw_rate_s",
        "sway_per_yaw_rate_sigma_s",
        "sway_per_yaw_rate_tested_s",
    ],
];

/// Rows by column, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    columns: Vec<Column>,
}

/// Why a table cannot be read or put together.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// Not Parquet.
    #[error("not Apache Parquet that this program wrote")]
    Parquet(#[from] ParquetError),
    /// Other columns.
    #[error("its columns are not those of the other tables of this campaign: {0}")]
    Columns(String),
}

impl Rows {
    /// Of runs that were flown in worlds with parameters of these names.
    pub(super) fn of(rows: &[Row], parameters: &[&str]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "runs and seeds are below 2⁵³")]
        fn count(value: u64) -> f64 {
            value as f64
        }
        let words = |name: &str, of: &dyn Fn(&Row) -> String| Column {
            name: name.to_owned(),
            values: Values::Words(rows.iter().map(|row| Cow::Owned(of(row))).collect()),
        };
        let numbers = |name: &str, of: &dyn Fn(&Row) -> Option<f64>| Column {
            name: name.to_owned(),
            values: Values::Numbers(rows.iter().map(of).collect()),
        };
        let outcome = |row: &Row| row.outcome.clone().ok();
        let score = |row: &Row, of: fn(&Score) -> Option<f64>| of(&row.outcome.as_ref().ok()?.score);
        let learnt = |row: &Row| outcome(row)?.learnt;
        let mut columns = vec![
            numbers("run", &|row| Some(count(row.run))),
            words("scenario", &|row| row.scenario.clone()),
            words("craft", &|row| row.craft.clone()),
            words("controller", &|row| row.controller.clone()),
            words("information", &|row| row.information.clone()),
            words("objectives", &|row| row.objectives.clone()),
            numbers("replicate", &|row| Some(count(row.replicate))),
            numbers("seed", &|row| Some(count(row.seed))),
            numbers("look_ahead_m", &|row| Some(row.tuning?.gains.look_ahead)),
            numbers("along_track_gain_per_s", &|row| {
                Some(row.tuning?.gains.along_track_gain)
            }),
            numbers("integral_gain_mps", &|row| Some(row.tuning?.integral_gain)),
        ];
        for (k, key) in parameters.iter().enumerate() {
            columns.push(numbers(&format!("{PARAMETER}{key}"), &|row| {
                row.parameters.get(k).copied()
            }));
        }
        for (name, of) in SCORES {
            columns.push(numbers(name, &|row| score(row, of)));
        }
        let [too_fast, alarms, alarm_s, noticed] = MORE;
        columns.push(numbers(too_fast, &|row| outcome(row)?.too_fast_steps_percent));
        #[expect(clippy::cast_precision_loss, reason = "an alarm a second at most")]
        columns.push(numbers(
            alarms,
            &|row| Some(learnt(row)?.alarms_at_s.len() as f64),
        ));
        columns.push(numbers(alarm_s, &|row| Some(learnt(row)?.alarm_s)));
        columns.push(numbers(noticed, &|row| {
            let broke = row.breaks_at_s?;
            let alarms = learnt(row)?.alarms_at_s.into_iter();
            alarms.map(|at| at - broke).find(|after| 0.0 <= *after)
        }));
        for (k, [value, sigma, tested]) in LEARNT.into_iter().enumerate() {
            columns.push(numbers(value, &|row| Some(learnt(row)?.estimates?[k].0)));
            columns.push(numbers(sigma, &|row| Some(learnt(row)?.estimates?[k].1)));
            columns.push(numbers(tested, &|row| Some(row.tested?[k])));
        }
        columns.push(numbers("bound_rms_m", &|row| row.bound_rms_m));
        columns.push(words("failure", &|row| {
            row.outcome.as_ref().err().cloned().unwrap_or_default()
        }));
        columns.push(numbers("solve_ms_p50", &|row| {
            score(row, |score| score.metrics.solve_ms_p50)
        }));
        columns.push(numbers("solve_ms_p99", &|row| {
            score(row, |score| score.metrics.solve_ms_p99)
        }));
        columns.push(numbers("run_s", &|row| Some(row.run_s)));
        Self { columns }
    }

    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |column| match &column.values {
            Values::Numbers(numbers) => numbers.len(),
            Values::Words(words) => words.len(),
        })
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Names of the columns.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// The numbers of a column; none where no column of numbers has that name.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<&[Option<f64>]> {
        self.columns
            .iter()
            .find(|column| column.name == name)
            .and_then(|column| match &column.values {
                Values::Numbers(numbers) => Some(numbers.as_slice()),
                Values::Words(_) => None,
            })
    }

    /// The words of a column; none where no column of words has that name.
    #[must_use]
    pub fn words(&self, name: &str) -> Option<&[Cow<'static, str>]> {
        self.columns
            .iter()
            .find(|column| column.name == name)
            .and_then(|column| match &column.values {
                Values::Words(words) => Some(words.as_slice()),
                Values::Numbers(_) => None,
            })
    }

    /// Puts `other` behind these.
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

    /// The row of the run of that number; none where it is not here.
    pub(super) fn only(&self, number: u64) -> Option<Self> {
        #[expect(clippy::cast_precision_loss, reason = "runs are below 2⁵³")]
        let wanted = Some(number as f64);
        let place = self.numbers("run")?.iter().position(|run| *run == wanted)?;
        Some(self.picked(&[place]))
    }

    /// The same in the order of the runs.
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

    /// SHA-256 of every cell but the measured ones, in the order of the runs: equal for equal results.
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

    /// Writes them as Parquet, with what they are of.
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
        // The same few names stand in thousands of rows.
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
