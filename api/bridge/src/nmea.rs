//! NMEA 0183: measurements from navigation sensors, references to autopilots.
//!
//! [`NmeaReader`] reads GGA, GLL, RMC, VTG, HDT, THS, ROT, VHW, VBW and AIS (VDM, VDO) of any
//! talker as [`Measurement`]s and counts the rest. [`heading_and_speed_sentences`] writes
//! references.
//!
//! The sentences are parsed here: the crate `nmea-parser` 0.10 lacks THS and ROT, accepts a missing
//! checksum and "nan", ignores units and modes, and panics at text that is not ASCII.
//!
//! ArduPilot's NMEA output (`AP_NMEA_Output.cpp`, commit 09d745a3) writes 90° minus the course into
//! RMC, which exchanges north and east of its velocities.

mod ais;
mod fields;
mod output;
mod sentence;
#[cfg(test)]
mod tests;

pub(crate) use self::ais::vessel_status;
pub use self::output::heading_and_speed_sentences;
pub(crate) use self::{
    fields::seconds_after_midnight,
    sentence::{KNOT, checksum},
};

use std::collections::VecDeque;

use self::ais::AisReader;
use self::sentence::Content;
use crate::{Measurement, Parsed, Rejects, reject_if};

/// Longest line, bytes without the line end. NMEA 0183 allows 82 with it; receivers with many
/// decimals slightly exceed that.
const LINE_MAX: usize = 128;
/// Greatest difference of a receiver's clock, s: a fix comes a second after its time. Beyond that
/// it is dated by its arrival, as headings are: a state of the craft needs both within 2 s.
const CLOCK_DIFFERENCE_MAX_S: f64 = 1.5;
/// Sentences with a time of day that are remembered: those of one second, of a few receivers.
const TIMED_MAX: usize = 16;
const SECONDS_PER_DAY: f64 = 86_400.0;

/// Reads NMEA 0183 from any wire, in pieces of any size.
///
/// Memory is bounded: one line of at most 128 bytes is kept between two calls.
#[derive(Debug, Default)]
pub struct NmeaReader {
    line: Vec<u8>,
    state: LineState,
    /// The newest sentences with a time of day, by talker.
    timed: VecDeque<Content>,
    ais: AisReader,
    rejects: Rejects,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum LineState {
    /// After a line end.
    #[default]
    Empty,
    Sentence,
    /// No sentence, or too long.
    Skipped,
}

impl NmeaReader {
    /// The measurements that `bytes` complete, received at `received_s`, s of Unix time.
    ///
    /// A sentence ends at its line end or at the start of the next one. The caller pushes a line
    /// end after each datagram. A time of day within 5 s of `received_s` is the time of the
    /// measurements, otherwise `received_s` is. Repeated sentences with a time are rejected.
    pub fn push(&mut self, bytes: &[u8], received_s: f64) -> Vec<Measurement> {
        debug_assert!(received_s.is_finite(), "the caller's clock works");
        let mut measurements = Vec::new();
        for &byte in bytes {
            match (byte, self.state) {
                (b'$' | b'!', _) => {
                    self.finish_line(received_s, &mut measurements);
                    self.line.push(byte);
                    self.state = LineState::Sentence;
                }
                (b'\r' | b'\n', _) => {
                    self.finish_line(received_s, &mut measurements);
                    self.state = LineState::Empty;
                }
                // A tag block of NMEA 4 before a sentence.
                (b'\\', LineState::Empty) => self.state = LineState::Skipped,
                (_, LineState::Sentence) if self.line.len() < LINE_MAX => self.line.push(byte),
                (_, LineState::Sentence) => self.skip_line("too long"),
                (_, LineState::Empty) => self.skip_line("no sentence"),
                (_, LineState::Skipped) => {}
            }
        }
        measurements
    }

    /// Rejected lines by reason. Sentences of other kinds count as "unused sentence".
    pub fn rejects(&self) -> &Rejects {
        &self.rejects
    }

    fn skip_line(&mut self, reason: &'static str) {
        self.rejects.count(reason);
        self.line.clear();
        self.state = LineState::Skipped;
    }

    fn finish_line(&mut self, received_s: f64, measurements: &mut Vec<Measurement>) {
        if self.state == LineState::Sentence
            && let Err(reason) = self.read_line(received_s, measurements)
        {
            self.rejects.count(reason);
        }
        self.line.clear();
    }

    fn read_line(&mut self, received_s: f64, measurements: &mut Vec<Measurement>) -> Parsed<()> {
        if matches!(self.line.get(3..6), Some(b"VDM" | b"VDO")) {
            measurements.extend(self.ais.read(&self.line, received_s)?.map(Measurement::Vessel));
            return Ok(());
        }
        let content = sentence::read(&self.line)?;
        reject_if(self.is_repeated(&content), "repeated sentence")?;
        let t_s = self.measured_at(content.time_of_day, received_s);
        let craft = |measured| Measurement::Craft { t_s, talker: content.talker, measured };
        measurements.extend(content.measured.into_iter().map(craft));
        Ok(())
    }

    /// `true` for a recent sentence's time and content: a stopped clock, or a wire that repeats.
    fn is_repeated(&mut self, content: &Content) -> bool {
        let is_repeated = self.timed.contains(content);
        if content.time_of_day.is_some() && !is_repeated {
            self.timed.push_back(content.clone());
            if self.timed.len() > TIMED_MAX {
                self.timed.pop_front();
            }
        }
        is_repeated
    }

    /// The instant of `time_of_day` nearest to `received_s`, if near enough.
    fn measured_at(&mut self, time_of_day: Option<f64>, received_s: f64) -> f64 {
        let Some(time_of_day) = time_of_day else {
            return received_s;
        };
        let today = (received_s / SECONDS_PER_DAY).floor() * SECONDS_PER_DAY + time_of_day;
        let days_later = ((received_s - today) / SECONDS_PER_DAY).round();
        let nearest = today + days_later * SECONDS_PER_DAY;
        if (nearest - received_s).abs() <= CLOCK_DIFFERENCE_MAX_S {
            return nearest;
        }
        self.rejects.count("clock");
        received_s
    }
}
