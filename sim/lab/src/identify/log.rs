//! A log of references and motion, checked.

use nalgebra::Vector2;
use planner::angle::wrap;

/// Shortest log, s: less than that shows no loop.
const DURATION_MIN: f64 = 60.0;
/// Most rows: four hours at 10 Hz and more.
const ROWS_MAX: usize = 200_000;
/// Longest time between two rows, s: in a longer one a heading cannot be followed round.
const INTERVAL_MAX: f64 = 5.0;
/// Half of the time over which positions are differenced where there is no velocity over ground, s.
const DIFFERENCE_HALF: f64 = 1.0;

/// One sample. The references are those in force from `time` until the next row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogRow {
    /// Time, s, on any clock.
    pub time: f64,
    /// Speed reference, m/s.
    pub speed_reference: f64,
    /// Heading (or course) reference, rad.
    pub heading_reference: f64,
    /// Measured heading, rad.
    pub heading: f64,
    /// Measured surge through the water, m/s.
    pub surge: Option<f64>,
    /// Measured sway through the water, m/s, positive to starboard.
    pub sway: Option<f64>,
    /// Measured velocity over ground (north, east), m/s.
    pub ground_velocity: Option<Vector2<f64>>,
    /// Measured position (north, east), m.
    pub position: Option<Vector2<f64>>,
    /// Power that propulsion draws, W.
    pub power: Option<f64>,
}

/// Why a log cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidLog {
    /// Fewer or more rows than can be used.
    #[error("{given} rows, and 2 to {ROWS_MAX} can be used")]
    Rows {
        /// How many there are.
        given: usize,
    },
    /// A time not after the one before it, or long after it.
    #[error("row {row}: {given} s does not come 0 to {INTERVAL_MAX} s after {before} s")]
    Time {
        /// The row, from 0 on.
        row: usize,
        /// Its time, s.
        given: f64,
        /// Time of the row before it, s.
        before: f64,
    },
    /// Too short a time.
    #[error("the log lasts {given} s, and {DURATION_MIN} s are the least that shows anything")]
    Short {
        /// How long it lasts, s.
        given: f64,
    },
    /// A number that is not finite.
    #[error("row {row}: a number that is not finite")]
    NotFinite {
        /// The row, from 0 on.
        row: usize,
    },
    /// No measurement of speed: neither through the water nor over ground nor positions.
    #[error("no speed: the log needs surge through the water, velocity over ground, or positions")]
    NoSpeed,
}

/// A log that can be used.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    rows: Vec<LogRow>,
    /// Measured headings without jumps, rad.
    headings: Vec<f64>,
}

impl Log {
    /// Checks `rows`. Where no row has a velocity over ground, it is differenced from the positions.
    pub fn new(mut rows: Vec<LogRow>) -> Result<Self, InvalidLog> {
        let given = rows.len();
        if !(2..=ROWS_MAX).contains(&given) {
            return Err(InvalidLog::Rows { given });
        }
        for (i, row) in rows.iter().enumerate() {
            let pair = |pair: Option<Vector2<f64>>| pair.is_none_or(|v| v.x.is_finite() && v.y.is_finite());
            let number = |number: Option<f64>| number.is_none_or(f64::is_finite);
            let needed = [row.time, row.speed_reference, row.heading_reference, row.heading];
            let finite = needed.iter().all(|number| number.is_finite())
                && [row.surge, row.sway, row.power].into_iter().all(number)
                && pair(row.ground_velocity)
                && pair(row.position);
            if !finite {
                return Err(InvalidLog::NotFinite { row: i });
            }
        }
        for (i, two) in rows.windows(2).enumerate() {
            let (before, given) = (two[0].time, two[1].time);
            if !(before < given && given - before <= INTERVAL_MAX) {
                return Err(InvalidLog::Time {
                    row: i + 1,
                    given,
                    before,
                });
            }
        }
        let given = rows[rows.len() - 1].time - rows[0].time;
        if given < DURATION_MIN {
            return Err(InvalidLog::Short { given });
        }
        if rows.iter().all(|row| row.ground_velocity.is_none()) {
            difference_positions(&mut rows);
        }
        if rows
            .iter()
            .all(|row| row.surge.is_none() && row.ground_velocity.is_none())
        {
            return Err(InvalidLog::NoSpeed);
        }
        let headings = continuous(rows.iter().map(|row| row.heading));
        Ok(Self { rows, headings })
    }

    /// The rows, in time.
    #[must_use]
    pub fn rows(&self) -> &[LogRow] {
        &self.rows
    }

    /// The measured headings without jumps, rad.
    #[must_use]
    pub fn headings(&self) -> &[f64] {
        &self.headings
    }
}

/// Angles without jumps: each within half a turn of the one before it.
pub(super) fn continuous(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last = None;
    angles
        .map(|angle| {
            let next = last.map_or(angle, |last: f64| last + wrap(angle - last));
            last = Some(next);
            next
        })
        .collect()
}

fn difference_positions(rows: &mut [LogRow]) {
    let fixes: Vec<_> = rows.iter().map(|row| (row.time, row.position)).collect();
    for row in rows {
        let before = fixes.partition_point(|(time, _)| *time < row.time - DIFFERENCE_HALF);
        let after = fixes.partition_point(|(time, _)| *time <= row.time + DIFFERENCE_HALF);
        let (Some((from, Some(begin))), Some((until, Some(end)))) =
            (fixes.get(before), after.checked_sub(1).and_then(|i| fixes.get(i)))
        else {
            continue;
        };
        if *from < *until {
            row.ground_velocity = Some((end - begin) / (until - from));
        }
    }
}
