//! A checked log of references and motion.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use planner::angle::wrap;

/// Shortest log, s: less shows no loop.
const DURATION_MIN: f64 = 60.0;
/// Most rows: four hours at 10 Hz and more.
const ROWS_MAX: usize = 200_000;
/// Longest time between two rows, s: beyond it, turns of a heading are ambiguous.
const INTERVAL_MAX: f64 = 5.0;
/// Fastest turn of a surface craft, rad/s. A heading in degrees seems to turn faster.
const TURN_RATE_MAX: f64 = 3.0;
/// Largest difference of two headings by noise, rad.
const HEADING_NOISE_MAX: f64 = 0.5;
/// Half of the time over which positions are differenced if there is no velocity over ground, s.
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

/// The reason why a log cannot be used, in words.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct InvalidLog(String);

/// A checked log.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    rows: Vec<LogRow>,
    /// Measured headings without jumps, rad.
    headings: Vec<f64>,
    /// Time of the given rows that is left out, s.
    left_out: f64,
}

impl Log {
    /// Checks `rows`. Rows of one time are spread evenly until the next (loggers cut times to whole
    /// seconds); repeated rows count once. Positions replace a missing velocity over ground. The
    /// longest part without a gap is used.
    pub fn new(mut rows: Vec<LogRow>) -> Result<Self, InvalidLog> {
        let given = rows.len();
        if !(2..=ROWS_MAX).contains(&given) {
            return Err(InvalidLog(format!("{given} rows: a log has 2 to {ROWS_MAX}")));
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
                return Err(InvalidLog(format!("row {i}: a number that is not finite")));
            }
        }
        rows.dedup();
        spread_equal_times(&mut rows);
        for (i, two) in rows.windows(2).enumerate() {
            let (before, given) = (two[0].time, two[1].time);
            if given <= before {
                let row = i + 1;
                let must = "a row must be later than the one before it";
                return Err(InvalidLog(format!("row {row}: {given} s follows {before} s; {must}")));
            }
        }
        reject_degrees(&rows)?;
        let whole = duration(&rows);
        let parts = rows.chunk_by(|one, next| next.time - one.time <= INTERVAL_MAX);
        let longest = parts.max_by(|a, b| duration(a).total_cmp(&duration(b)));
        let mut rows = longest.map_or_else(Vec::new, <[LogRow]>::to_vec);
        let given = duration(&rows);
        if given < DURATION_MIN {
            return Err(InvalidLog(format!(
                "the log lasts {given} s without a gap of more than {INTERVAL_MAX} s: it must last at least \
                 {DURATION_MIN} s"
            )));
        }
        if rows.iter().all(|row| row.ground_velocity.is_none()) {
            difference_positions(&mut rows);
        }
        let has_no_speed = |row: &LogRow| row.surge.is_none() && row.ground_velocity.is_none();
        if rows.iter().all(has_no_speed) {
            let says = "no speed: the log needs surge through the water, velocity over ground, or positions";
            return Err(InvalidLog(says.to_owned()));
        }
        let headings = continuous(rows.iter().map(|row| row.heading));
        Ok(Self { rows, headings, left_out: whole - given })
    }

    /// Time before and after gaps that is left out, s.
    pub fn left_out(&self) -> f64 {
        self.left_out
    }

    /// The rows, in time.
    pub fn rows(&self) -> &[LogRow] {
        &self.rows
    }

    /// The measured headings without jumps, rad.
    pub fn headings(&self) -> &[f64] {
        &self.headings
    }
}

/// Time from the first row to the last, s.
fn duration(rows: &[LogRow]) -> f64 {
    rows.first().zip(rows.last()).map_or(0.0, |(first, last)| last.time - first.time)
}

/// Angles without jumps: each within half a turn of its predecessor.
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

/// Fails if headings look like degrees: neither wrapped rad nor rad counted on without jumps.
fn reject_degrees(rows: &[LogRow]) -> Result<(), InvalidLog> {
    let is_wrapped = |heading: f64| heading.abs() <= TAU;
    let jumps = |two: &[LogRow]| {
        let most = TURN_RATE_MAX * (two[1].time - two[0].time) + HEADING_NOISE_MAX;
        most < (two[1].heading - two[0].heading).abs()
    };
    let far = |two: &&[LogRow]| !(is_wrapped(two[0].heading) && is_wrapped(two[1].heading)) && jumps(two);
    let first = [rows[0].heading, rows[0].heading_reference];
    let mut suspects = first.into_iter().filter(|&heading| !is_wrapped(heading));
    let jump = || rows.windows(2).find(far).map(|two| two[1].heading);
    suspects.next().or_else(jump).map_or(Ok(()), |heading| {
        Err(InvalidLog(format!(
            "a heading of {heading} rad: name the columns heading_deg and reference_heading_deg if they are in degrees"
        )))
    })
}

fn spread_equal_times(rows: &mut [LogRow]) {
    let (mut first, mut spacing) = (0, 0.0);
    while let Some(time) = rows.get(first).map(|row| row.time) {
        let equal = rows[first..].iter().take_while(|row| row.time == time).count();
        if let Some(next) = rows.get(first + equal) {
            spacing = (next.time - time) / equal as f64;
        }
        for (k, row) in rows[first..first + equal].iter_mut().enumerate() {
            row.time = time + spacing * k as f64;
        }
        first += equal;
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two minutes at 5 Hz with a turn of a whole circle and more.
    fn rows() -> Vec<LogRow> {
        let row = |k: u32| {
            let time = 0.2 * f64::from(k);
            LogRow {
                time,
                speed_reference: 1.0,
                heading_reference: 0.1,
                heading: 0.1 + 0.08 * time,
                surge: Some(1.0),
                sway: None,
                ground_velocity: None,
                position: None,
                power: None,
            }
        };
        (0..600).map(row).collect()
    }

    #[test]
    fn headings_in_degrees_are_refused_and_unwrapped_headings_are_read() {
        let counted_on = rows();
        assert!(TAU < counted_on[599].heading);
        let in_degrees = |wrap: bool| {
            let mut rows = rows();
            for row in &mut rows {
                row.heading = row.heading.to_degrees();
                if wrap {
                    row.heading %= 360.0;
                }
            }
            rows
        };
        Log::new(counted_on).expect("is in rad");
        // It begins at 5.7°, which may be rad.
        let error = Log::new(in_degrees(true)).expect_err("jumps by 360");
        assert!(error.0.contains("heading_deg"), "{error}");
        let later = in_degrees(false).split_off(100);
        let error = Log::new(later).expect_err("begins at 97");
        assert!(error.0.contains("97."), "{error}");
    }

    #[test]
    fn of_a_log_with_a_gap_the_longest_part_is_used() {
        let mut halved = rows();
        for row in &mut halved[400..] {
            row.time += 24.0;
        }
        let log = Log::new(halved.clone()).expect("its first part lasts 80 s");
        assert_eq!(log.rows(), &rows()[..400]);
        // A fifth of a second belongs to the gap.
        assert!((log.left_out() - (24.0 + 40.0)).abs() < 1e-9, "{}", log.left_out());
        let error = Log::new(halved.split_off(200)).expect_err("both parts last 40 s");
        assert!(error.0.contains("without a gap of more than 5 s"), "{error}");
    }

    #[test]
    fn times_cut_to_whole_seconds_are_spread_and_a_repeated_row_counts_once() {
        let mut cut = rows();
        for row in &mut cut {
            row.time = row.time.floor();
        }
        let spread = Log::new(cut).expect("is read");
        let shift = |(a, b): (&LogRow, &LogRow)| (a.time - b.time).abs();
        let worst = spread.rows().iter().zip(&rows()).map(shift).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
        let mut twice = rows();
        twice.insert(300, twice[300]);
        assert_eq!(Log::new(twice).expect("is read").rows(), &rows()[..]);
    }
}
