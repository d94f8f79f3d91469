//! Reads one sentence as measurements of the craft.
//!
//! Source of the fields: IEC 61162-1 (NMEA 0183), as listed in the manuals of Furuno's GP-170 and
//! RD-50 and in gpsd's "NMEA Revealed".

use std::ops::RangeInclusive;

use nalgebra::Vector2;
use planner::angle::{direction, wrap};

use super::fields::{BEARING_DEG, Fields};
use crate::{CraftMeasurement, Parsed, reject_if};

/// A knot, m/s: one international nautical mile, 1852 m, an hour.
pub(crate) const KNOT: f64 = 1852.0 / 3600.0;
/// A kilometre an hour, m/s.
const KILOMETRE_PER_HOUR: f64 = 1000.0 / 3600.0;
/// A degree a minute, rad/s.
const DEGREE_PER_MINUTE: f64 = std::f64::consts::PI / (180.0 * 60.0);
/// Speeds that a ship may report by AIS, knots (ITU-R M.1371: 102.2 means "or higher").
const SPEED_KN: RangeInclusive<f64> = 0.0..=102.2;
/// Speeds along an axis of the craft, knots, within the same bound.
const AXIS_SPEED_KN: RangeInclusive<f64> = -102.2..=102.2;
/// Rates of turn within the digits of ROT, degrees a minute (Furuno FMD-3100, appendix 3).
const TURN_DEG_PER_MIN: RangeInclusive<f64> = -9999.9..=9999.9;

const NO_CHECKSUM: &str = "no checksum";
const NO_RMC: &str = "RMC without position and speed";
/// The receiver reports that it has no fix.
const NO_FIX: &str = "no fix";
/// The sender reports that the value is not valid.
const NOT_VALID: &str = "not valid";
/// The sender reports that the value was entered by hand or simulated, or uses an unknown mode.
const NOT_MEASURED: &str = "not measured";

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Content {
    /// The first two letters of the address.
    pub(super) talker: [u8; 2],
    /// Time of the measurements, s after midnight UTC, if the sentence states it.
    pub(super) time_of_day: Option<f64>,
    pub(super) measured: Vec<CraftMeasurement>,
}

/// The content of `line`, from its `$` to the end of its checksum, or the reason for its rejection.
pub(super) fn read(line: &[u8]) -> Parsed<Content> {
    let fields = Fields::new(checked_payload(line)?);
    let (time_of_day, measured, empty) = match kind(fields.text(0)) {
        "GGA" => (fields.time_of_day(1), gga(&fields), "GGA without a position"),
        "GLL" => (fields.time_of_day(5), gll(&fields), "GLL without a position"),
        "RMC" => (fields.time_of_day(1), rmc(&fields), NO_RMC),
        "VTG" => (Ok(None), vtg(&fields), "VTG without a speed"),
        "HDT" => (Ok(None), hdt(&fields), "HDT without a heading"),
        "THS" => (Ok(None), ths(&fields), "THS without a heading"),
        "ROT" => (Ok(None), rot(&fields), "ROT without a rate"),
        "VHW" => (Ok(None), vhw(&fields), "VHW without true heading and speed"),
        "VBW" => (Ok(None), vbw(&fields), "VBW without a speed"),
        "HDG" | "HDM" => return Err("magnetic"),
        _ => return Err("unused sentence"),
    };
    // The status of the sentence comes first: its other fields may be empty or wrong then.
    let [first, second] = measured?;
    let measured: Vec<CraftMeasurement> = first.into_iter().chain(second).collect();
    if measured.is_empty() {
        return Err(empty);
    }
    let address = fields.text(0).as_bytes();
    Ok(Content {
        talker: address.first_chunk().copied().unwrap_or_default(),
        time_of_day: time_of_day?,
        measured,
    })
}

/// One or two measurements, if the fields are filled.
type Measured = Parsed<[Option<CraftMeasurement>; 2]>;

/// Exclusive or of all bytes between `$` and `*`.
pub(crate) fn checksum(payload: &[u8]) -> u8 {
    payload.iter().fold(0, |sum, byte| sum ^ byte)
}

/// The text between `$` and `*`, if the checksum after it is right.
///
/// The checksum must end the line: in an earlier one, a flipped bit could have made the `*`.
pub(super) fn checked_payload(line: &[u8]) -> Parsed<&str> {
    let [_, payload @ .., b'*', high, low] = line else {
        return Err(NO_CHECKSUM);
    };
    let given = hexadecimal(*high).zip(hexadecimal(*low)).ok_or(NO_CHECKSUM)?;
    let computed = checksum(payload);
    reject_if(given != (computed >> 4, computed & 0x0f), "wrong checksum")?;
    match std::str::from_utf8(payload) {
        Ok(text) if text.bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic()) => Ok(text),
        Ok(_) | Err(_) => Err("not text"),
    }
}

fn hexadecimal(digit: u8) -> Option<u8> {
    u8::try_from(char::from(digit).to_digit(16)?).ok()
}

/// The kind of sentence in an address such as GPGGA. Addresses that begin with P are vendors' own.
fn kind(address: &str) -> &str {
    match address.split_at_checked(2) {
        Some((talker, kind)) if !talker.starts_with('P') => kind,
        Some(_) | None => "",
    }
}

fn gga(fields: &Fields<'_>) -> Measured {
    match fields.text(6) {
        // Alone, differential, precise, real-time kinematic fixed and float, dead reckoning.
        "1" | "2" | "3" | "4" | "5" | "6" => {}
        "" | "0" => return Err(NO_FIX),
        _ => return Err(NOT_MEASURED),
    }
    Ok([fields.position(2)?.map(CraftMeasurement::Position), None])
}

fn gll(fields: &Fields<'_>) -> Measured {
    // Writers before NMEA 0183 2.0 omit the status.
    reject_if(!matches!(fields.text(6), "A" | ""), NO_FIX)?;
    check_mode(fields.text(7))?;
    Ok([fields.position(1)?.map(CraftMeasurement::Position), None])
}

fn rmc(fields: &Fields<'_>) -> Measured {
    reject_if(fields.text(2) != "A", NO_FIX)?;
    check_mode(fields.text(12))?;
    let position = fields.position(3)?.map(CraftMeasurement::Position);
    let speed = fields.number(7, &SPEED_KN)?.map(|knots| knots * KNOT);
    Ok([position, ground_velocity(speed, fields.number(8, &BEARING_DEG)?)])
}

fn vtg(fields: &Fields<'_>) -> Measured {
    check_mode(fields.text(9))?;
    let course_deg = fields.number_in("T", 1, &BEARING_DEG)?;
    Ok([ground_velocity(speed(fields, &SPEED_KN)?, course_deg), None])
}

fn hdt(fields: &Fields<'_>) -> Measured {
    Ok([fields.number_in("T", 1, &BEARING_DEG)?.map(heading), None])
}

fn ths(fields: &Fields<'_>) -> Measured {
    match fields.text(2) {
        // Autonomous, estimated.
        "A" | "E" => Ok([fields.number(1, &BEARING_DEG)?.map(heading), None]),
        "V" => Err(NOT_VALID),
        _ => Err(NOT_MEASURED),
    }
}

fn rot(fields: &Fields<'_>) -> Measured {
    reject_if(fields.text(2) != "A", NOT_VALID)?;
    let rate = fields.number(1, &TURN_DEG_PER_MIN)?;
    let rate = rate.map(|rate| CraftMeasurement::YawRate(rate * DEGREE_PER_MINUTE));
    Ok([rate, None])
}

/// Heading and speed log. The log has one axis: the sway through the water is taken as 0.
fn vhw(fields: &Fields<'_>) -> Measured {
    let heading = fields.number_in("T", 1, &BEARING_DEG)?.map(heading);
    let surge = speed(fields, &AXIS_SPEED_KN)?;
    let velocity = surge.map(|surge| CraftMeasurement::WaterVelocity(Vector2::new(surge, 0.0)));
    Ok([heading, velocity])
}

/// Velocity through the water; a missing sway is 0. That over ground needs a heading.
fn vbw(fields: &Fields<'_>) -> Measured {
    reject_if(fields.text(3) != "A", NOT_VALID)?;
    let surge = fields.number(1, &AXIS_SPEED_KN)?;
    let sway = fields.number(2, &AXIS_SPEED_KN)?.unwrap_or(0.0);
    let velocity = surge.map(|surge| Vector2::new(surge, sway) * KNOT);
    Ok([velocity.map(CraftMeasurement::WaterVelocity), None])
}

/// The mode indicator of RMC and VTG. Writers before NMEA 0183 2.3, and ArduPilot, omit it.
fn check_mode(mode: &str) -> Parsed<()> {
    match mode {
        // Autonomous, differential, estimated, precise, real-time kinematic fixed and float.
        "" | "A" | "D" | "E" | "P" | "R" | "F" => Ok(()),
        "N" => Err(NO_FIX),
        _ => Err(NOT_MEASURED),
    }
}

/// The speed of VTG and VHW, m/s: in field 5 in knots, in field 7 in km/h.
fn speed(fields: &Fields<'_>, range_kn: &RangeInclusive<f64>) -> Parsed<Option<f64>> {
    if let Some(knots) = fields.number_in("N", 5, range_kn)? {
        return Ok(Some(knots * KNOT));
    }
    let in_kmph = KNOT / KILOMETRE_PER_HOUR;
    let range_kmph = range_kn.start() * in_kmph..=range_kn.end() * in_kmph;
    let kmph = fields.number_in("K", 7, &range_kmph)?;
    Ok(kmph.map(|kmph| kmph * KILOMETRE_PER_HOUR))
}

fn heading(degrees: f64) -> CraftMeasurement {
    CraftMeasurement::Heading(wrap(degrees.to_radians()))
}

/// Receivers omit the course of a craft at rest.
fn ground_velocity(speed: Option<f64>, course_deg: Option<f64>) -> Option<CraftMeasurement> {
    let speed = speed?;
    Some(match course_deg {
        Some(course_deg) => CraftMeasurement::GroundVelocity(direction(course_deg.to_radians()) * speed),
        None => CraftMeasurement::GroundSpeed(speed),
    })
}
