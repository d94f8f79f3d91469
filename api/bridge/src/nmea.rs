//! NMEA 0183: what navigation sensors tell, and what autopilots are told.
//!
//! [`NmeaReader`] takes the bytes of a wire, from any talker: GGA, RMC, VTG, HDT, THS, ROT, VHW and VBW become
//! [`Measurement`]s, everything else is counted. [`heading_and_speed_sentences`] writes a reference for an autopilot.
//!
//! The sentences are parsed here. The crate `nmea-parser` 0.10 lacks THS and ROT; it takes a sentence without a checksum
//! and a number "nan", and ignores fractions of a second, units and mode indicators; it panics at text that is not ASCII,
//! and an AIS sentence of which the second half never comes stays in its memory.
//!
//! ArduPilot's NMEA output (`AP_NMEA_Output.cpp`, for one at commit 09d745a3) computes the course of RMC as
//! `atan2(north, east)`, which is 90° less the course: in velocities from it north and east are exchanged.

mod fields;
mod output;
mod refusal;
mod sentence;
#[cfg(test)]
mod tests;

pub use self::output::heading_and_speed_sentences;

use self::{refusal::Refusal, sentence::Reported};
use crate::{Measurement, Refused};

/// Longest line that is taken, bytes without the line end. NMEA 0183 allows 82 with the line end; receivers with many
/// decimals exceed that by some.
const LINE_MAX: usize = 128;
/// Most by which the clock of a receiver may differ from ours, s: a fix comes a second after its time, over a slow radio
/// a few seconds; beyond that one of the clocks is wrong.
const CLOCK_DIFFERENCE_MAX_S: f64 = 5.0;
const SECONDS_PER_DAY: f64 = 86_400.0;

/// Reads NMEA 0183 from any wire, in pieces of any size.
///
/// Memory is bounded: one line of at most 128 bytes is kept between two calls.
#[derive(Clone, Debug, Default)]
pub struct NmeaReader {
    line: Vec<u8>,
    place: Place,
    refused: Refused,
}

/// Where in the stream the next byte lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Place {
    /// After a line end.
    #[default]
    Between,
    /// After the `$` or `!` of a sentence.
    Sentence,
    /// In a line that is no sentence, or no longer one.
    Garbage,
}

impl NmeaReader {
    /// What `bytes`, received at `received_s` s of Unix time, complete.
    ///
    /// A sentence ends at its line end or at the start of the next one. Where datagrams carry no line ends, the caller
    /// pushes one after each. GGA and RMC tell a time of day: where it lies within 5 s of `received_s` it dates the
    /// measurements; otherwise `received_s` does.
    pub fn push(&mut self, bytes: &[u8], received_s: f64) -> Vec<Measurement> {
        debug_assert!(received_s.is_finite(), "the caller's clock tells a number");
        let mut measurements = Vec::new();
        for &byte in bytes {
            match (byte, self.place) {
                (b'$' | b'!', _) => {
                    self.finish_line(received_s, &mut measurements);
                    self.line.push(byte);
                    self.place = Place::Sentence;
                }
                (b'\r' | b'\n', _) => {
                    self.finish_line(received_s, &mut measurements);
                    self.place = Place::Between;
                }
                (_, Place::Sentence) if self.line.len() < LINE_MAX => self.line.push(byte),
                (_, Place::Sentence) => self.skip_line(Refusal::TooLong),
                (_, Place::Between) => self.skip_line(Refusal::NoSentence),
                (_, Place::Garbage) => {}
            }
        }
        measurements
    }

    /// What was not taken, by reason. Sentences of other kinds count as "unused sentence".
    #[must_use]
    pub fn refused(&self) -> &Refused {
        &self.refused
    }

    fn skip_line(&mut self, refusal: Refusal) {
        self.refused.count(refusal.reason());
        self.line.clear();
        self.place = Place::Garbage;
    }

    fn finish_line(&mut self, received_s: f64, measurements: &mut Vec<Measurement>) {
        if self.place == Place::Sentence {
            match sentence::reported_by(&self.line) {
                Ok(Reported {
                    time_of_day,
                    measured,
                }) => {
                    let t_s = self.measured_at(time_of_day, received_s);
                    let craft = |measured| Measurement::Craft { t_s, measured };
                    measurements.extend(measured.into_iter().map(craft));
                }
                Err(refusal) => self.refused.count(refusal.reason()),
            }
        }
        self.line.clear();
    }

    /// The instant nearest to `received_s` at which it is `time_of_day`, if that is near enough.
    fn measured_at(&mut self, time_of_day: Option<f64>, received_s: f64) -> f64 {
        let Some(time_of_day) = time_of_day else {
            return received_s;
        };
        let today = (received_s / SECONDS_PER_DAY).floor() * SECONDS_PER_DAY + time_of_day;
        let days_later = ((received_s - today) / SECONDS_PER_DAY).round();
        let nearest = today + days_later * SECONDS_PER_DAY;
        if (nearest - received_s).abs() <= CLOCK_DIFFERENCE_MAX_S {
            nearest
        } else {
            self.refused.count(Refusal::Clock.reason());
            received_s
        }
    }
}
