//! From one line to what it tells of the craft.
//!
//! Source of the fields: IEC 61162-1 (NMEA 0183), as its sentences are listed in the manuals of Furuno's GP-170 and
//! RD-50 and in gpsd's "NMEA Revealed".

use std::ops::RangeInclusive;

use nalgebra::Vector2;

use super::{
    fields::{BEARING_DEG, Fields},
    refusal::Refusal,
};
use crate::{CraftMeasurement, reference::wrapped};

/// A knot, m/s: one international nautical mile, 1852 m, an hour.
const KNOT: f64 = 1852.0 / 3600.0;
/// A kilometre an hour, m/s.
const KILOMETRE_PER_HOUR: f64 = 1000.0 / 3600.0;
/// A degree a minute, rad/s.
const DEGREE_PER_MINUTE: f64 = std::f64::consts::PI / (180.0 * 60.0);
/// Speeds that a ship may report by AIS, knots (ITU-R M.1371: 102.2 means "or higher").
const SPEED_KN: RangeInclusive<f64> = 0.0..=102.2;
/// Speeds along an axis of the craft, knots, within the same bound.
const AXIS_SPEED_KN: RangeInclusive<f64> = -102.2..=102.2;
/// Rates of turn that ROT has digits for, degrees a minute (Furuno FMD-3100, appendix 3).
const TURN_DEG_PER_MIN: RangeInclusive<f64> = -9999.9..=9999.9;

/// What a sentence tells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reported {
    /// When it was so, s after midnight UTC, where the sentence says it.
    pub(super) time_of_day: Option<f64>,
    /// What was measured then.
    pub(super) measured: Vec<CraftMeasurement>,
}

impl Reported {
    fn now(measured: impl IntoIterator<Item = CraftMeasurement>) -> Self {
        Self {
            time_of_day: None,
            measured: measured.into_iter().collect(),
        }
    }
}

/// What `line`, from its `$` to the end of its checksum, tells.
pub(super) fn reported_by(line: &[u8]) -> Result<Reported, Refusal> {
    let fields = Fields::new(checked_payload(line)?);
    let told = match kind(fields.text(0)) {
        "GGA" => gga(&fields),
        "RMC" => rmc(&fields),
        "VTG" => vtg(&fields),
        "HDT" => hdt(&fields),
        "THS" => ths(&fields),
        "ROT" => rot(&fields),
        "VHW" => vhw(&fields),
        "VBW" => vbw(&fields),
        "HDG" | "HDM" => Err(Refusal::Magnetic),
        _ => Err(Refusal::UnusedSentence),
    }?;
    if told.measured.is_empty() {
        Err(Refusal::Empty)
    } else {
        Ok(told)
    }
}

/// Exclusive or of all bytes between `$` and `*`.
pub(super) fn checksum(payload: &[u8]) -> u8 {
    payload.iter().fold(0, |sum, byte| sum ^ byte)
}

/// What lies between `$` and `*`, if the checksum after it is right.
///
/// The checksum must be the last thing on the line: one that ends earlier could be a digit that a flipped bit turned
/// into `*`.
fn checked_payload(line: &[u8]) -> Result<&str, Refusal> {
    let [_, payload @ .., b'*', high, low] = line else {
        return Err(Refusal::NoChecksum);
    };
    let given = hexadecimal(*high)
        .zip(hexadecimal(*low))
        .ok_or(Refusal::NoChecksum)?;
    let computed = checksum(payload);
    if given != (computed >> 4, computed & 0x0f) {
        return Err(Refusal::WrongChecksum);
    }
    match std::str::from_utf8(payload) {
        Ok(text) if text.bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic()) => Ok(text),
        Ok(_) | Err(_) => Err(Refusal::NotText),
    }
}

fn hexadecimal(digit: u8) -> Option<u8> {
    let value = char::from(digit).to_digit(16)?;
    u8::try_from(value).ok()
}

/// The kind of sentence in an address such as GPGGA. Addresses that begin with P are vendors' own.
fn kind(address: &str) -> &str {
    match address.split_at_checked(2) {
        Some((talker, kind)) if !talker.starts_with('P') => kind,
        Some(_) | None => "",
    }
}

fn gga(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    match fields.text(6) {
        // Alone, differential, precise, real-time kinematic fixed and float, dead reckoning.
        "1" | "2" | "3" | "4" | "5" | "6" => {}
        "" | "0" => return Err(Refusal::NoFix),
        _ => return Err(Refusal::NotMeasured),
    }
    Ok(Reported {
        time_of_day: fields.time_of_day(1)?,
        measured: fields
            .position(2)?
            .map(CraftMeasurement::Position)
            .into_iter()
            .collect(),
    })
}

fn rmc(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    if fields.text(2) != "A" {
        return Err(Refusal::NoFix);
    }
    check_mode(fields.text(12))?;
    let position = fields.position(3)?.map(CraftMeasurement::Position);
    let speed = fields.number(7, &SPEED_KN)?.map(|knots| knots * KNOT);
    let velocity = ground_velocity(speed, fields.number(8, &BEARING_DEG)?);
    Ok(Reported {
        time_of_day: fields.time_of_day(1)?,
        measured: position.into_iter().chain(velocity).collect(),
    })
}

fn vtg(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    check_mode(fields.text(9))?;
    let course_deg = fields.number_in("T", 1, &BEARING_DEG)?;
    Ok(Reported::now(ground_velocity(
        speed(fields, &SPEED_KN)?,
        course_deg,
    )))
}

fn hdt(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    Ok(Reported::now(
        fields.number_in("T", 1, &BEARING_DEG)?.map(heading),
    ))
}

fn ths(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    match fields.text(2) {
        // Autonomous, estimated.
        "A" | "E" => Ok(Reported::now(fields.number(1, &BEARING_DEG)?.map(heading))),
        "V" => Err(Refusal::NotValid),
        _ => Err(Refusal::NotMeasured),
    }
}

fn rot(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    if fields.text(2) != "A" {
        return Err(Refusal::NotValid);
    }
    let rate = fields
        .number(1, &TURN_DEG_PER_MIN)?
        .map(|rate| rate * DEGREE_PER_MINUTE);
    Ok(Reported::now(rate.map(CraftMeasurement::YawRate)))
}

/// Heading and speed of the water log: one axis, so that the sway through the water is taken as 0.
fn vhw(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    let heading = fields.number_in("T", 1, &BEARING_DEG)?.map(heading);
    let surge = speed(fields, &AXIS_SPEED_KN)?;
    let velocity = surge.map(|surge| CraftMeasurement::WaterVelocity(Vector2::new(surge, 0.0)));
    Ok(Reported::now(heading.into_iter().chain(velocity)))
}

/// Velocity through the water, of both axes. That over ground is left: it needs the heading at the same instant.
fn vbw(fields: &Fields<'_>) -> Result<Reported, Refusal> {
    if fields.text(3) != "A" {
        return Err(Refusal::NotValid);
    }
    let surge = fields.number(1, &AXIS_SPEED_KN)?;
    let sway = fields.number(2, &AXIS_SPEED_KN)?;
    let velocity = surge
        .zip(sway)
        .map(|(surge, sway)| Vector2::new(surge, sway) * KNOT);
    Ok(Reported::now(velocity.map(CraftMeasurement::WaterVelocity)))
}

/// The mode indicator of RMC and VTG. Writers before NMEA 0183 2.3, and ArduPilot, leave it out.
fn check_mode(mode: &str) -> Result<(), Refusal> {
    match mode {
        // Autonomous, differential, estimated, precise, real-time kinematic fixed and float.
        "" | "A" | "D" | "E" | "P" | "R" | "F" => Ok(()),
        "N" => Err(Refusal::NoFix),
        _ => Err(Refusal::NotMeasured),
    }
}

/// The speed of VTG and VHW, m/s: in field 5 in knots, in field 7 in km/h.
fn speed(fields: &Fields<'_>, range_kn: &RangeInclusive<f64>) -> Result<Option<f64>, Refusal> {
    if let Some(knots) = fields.number_in("N", 5, range_kn)? {
        return Ok(Some(knots * KNOT));
    }
    let in_kmph = KNOT / KILOMETRE_PER_HOUR;
    let range_kmph = range_kn.start() * in_kmph..=range_kn.end() * in_kmph;
    let kmph = fields.number_in("K", 7, &range_kmph)?;
    Ok(kmph.map(|kmph| kmph * KILOMETRE_PER_HOUR))
}

fn heading(degrees: f64) -> CraftMeasurement {
    CraftMeasurement::Heading(wrapped(degrees.to_radians()))
}

fn ground_velocity(speed: Option<f64>, course_deg: Option<f64>) -> Option<CraftMeasurement> {
    let velocity = |(speed, course_deg): (f64, f64)| geodesy::direction(course_deg.to_radians()) * speed;
    speed
        .zip(course_deg)
        .map(velocity)
        .map(CraftMeasurement::GroundVelocity)
}
