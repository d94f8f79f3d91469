//! The fields of one sentence: numbers, units, positions, times. Empty fields are `None`, never 0.

use std::ops::RangeInclusive;

use crate::{Origin, Parsed, on_earth, reject_if};

/// Angles from north, degrees. Both ends are north.
pub(super) const BEARING_DEG: RangeInclusive<f64> = 0.0..=360.0;

/// Minutes of arc in a degree. Up to 60.0 is accepted: writers round 59.99999.
const MINUTES_PER_DEGREE: f64 = 60.0;
const SECONDS_PER_MINUTE: f64 = 60.0;
const SECONDS_PER_HOUR: f64 = 3_600.0;
const HOUR_MAX: f64 = 23.0;
const MINUTE_MAX: f64 = 59.0;
/// End of a minute with a leap second, s.
const MINUTE_END_S: f64 = 61.0;
/// Digits of whole minutes in a position, and of each part of a time of day.
const PAIR: usize = 2;

/// Fields by their number in the standard; field 0 is the address.
#[derive(Debug)]
pub(super) struct Fields<'a>(Vec<&'a str>);

impl<'a> Fields<'a> {
    /// The fields of the text between `$` and `*`; `payload` is ASCII.
    pub(super) fn new(payload: &'a str) -> Self {
        Self(payload.split(',').collect())
    }

    /// The field as written; empty beyond the sentence's end.
    pub(super) fn text(&self, field: usize) -> &'a str {
        self.0.get(field).copied().unwrap_or_default()
    }

    pub(super) fn number(&self, field: usize, range: &RangeInclusive<f64>) -> Parsed<Option<f64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        let number = decimal(text).ok_or("number")?;
        range.contains(&number).then_some(Some(number)).ok_or("range")
    }

    /// A number in `range` whose unit, in the next field, is `unit`.
    pub(super) fn number_in(
        &self,
        unit: &str,
        field: usize,
        range: &RangeInclusive<f64>,
    ) -> Parsed<Option<f64>> {
        let number = self.number(field, range)?;
        reject_if(number.is_some() && self.text(field + 1) != unit, "unit")?;
        Ok(number)
    }

    /// A position in four fields from `field` on: latitude, N or S, longitude, E or W.
    pub(super) fn position(&self, field: usize) -> Parsed<Option<Origin>> {
        let [latitude, north, longitude, east] = [0, 1, 2, 3].map(|next| self.text(field + next));
        if latitude.is_empty() || longitude.is_empty() {
            return Ok(None);
        }
        let lat_deg = signed_degrees(latitude, north, ["N", "S"]);
        let lon_deg = signed_degrees(longitude, east, ["E", "W"]);
        let both = lat_deg.zip(lon_deg);
        let on_earth = both.and_then(|(lat_deg, lon_deg)| on_earth(lat_deg, lon_deg));
        on_earth.map(Some).ok_or("position")
    }

    /// UTC as hhmmss.sss, s after midnight.
    pub(super) fn time_of_day(&self, field: usize) -> Parsed<Option<f64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        seconds_after_midnight(text).map(Some).ok_or("time")
    }
}

/// Digits with at most one point, and a sign. Rust's parser would accept "nan", "inf" and "1e9".
fn decimal(text: &str) -> Option<f64> {
    unsigned(text.strip_prefix(['+', '-']).unwrap_or(text)).and_then(|_| text.parse().ok())
}

fn unsigned(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    if plain { text.parse().ok() } else { None }
}

/// (d)ddmm.mmm in degrees, negative in the second of the two hemispheres.
fn signed_degrees(text: &str, hemisphere: &str, hemispheres: [&str; 2]) -> Option<f64> {
    let point = text.find('.').unwrap_or(text.len());
    let (degrees, minutes) = text.split_at_checked(point.checked_sub(PAIR)?)?;
    let minutes = unsigned(minutes).filter(|minutes| *minutes <= MINUTES_PER_DEGREE)?;
    let magnitude = unsigned(degrees)? + minutes / MINUTES_PER_DEGREE;
    let side = hemispheres.iter().position(|side| *side == hemisphere)?;
    Some([magnitude, -magnitude][side])
}

/// Seconds after midnight of hhmmss.sss.
pub(crate) fn seconds_after_midnight(text: &str) -> Option<f64> {
    let (hours, rest) = text.split_at_checked(PAIR)?;
    let (minutes, seconds) = rest.split_at_checked(PAIR)?;
    // A truncated time must not become another one.
    let whole = |text: &str| text.bytes().take(PAIR).filter(u8::is_ascii_digit).count() == PAIR;
    if ![hours, minutes, seconds].into_iter().all(whole) {
        return None;
    }
    let hours = unsigned(hours).filter(|hours| *hours <= HOUR_MAX)?;
    let minutes = unsigned(minutes).filter(|minutes| *minutes <= MINUTE_MAX)?;
    let seconds = unsigned(seconds).filter(|seconds| *seconds < MINUTE_END_S)?;
    Some(hours * SECONDS_PER_HOUR + minutes * SECONDS_PER_MINUTE + seconds)
}
