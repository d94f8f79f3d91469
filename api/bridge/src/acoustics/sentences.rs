//! Sentences of ships, framed as NMEA 0183: Sonardyne Ranger `$PSONLLD`, Kongsberg APOS `$PSIMSSB`.
//!
//! ```text
//! $PSONLLD,hhmmss.ss,<name>,<A|V>,<lat °>,<lon °>,<depth>,<major>,<minor>,<dir>,<depth err>,…*hh
//! $PSIMSSB,hhmmss.ss,<id>,<A|V>,<e>,<C|P|U|R>,<H|N|E>,<M|F|P>,<x>,<y>,<z>,<σ>,<info>,<v1>,<v2>*hh
//! ```
//!
//! `$PSONLLD` is a position on Earth: the system has applied lever arm and heading. Its time is the
//! fix's. The error ellipse is of one standard deviation; its major half-axis is the accuracy.
//!
//! `$PSIMSSB` is used if Cartesian (C), m: x and y are starboard and ahead (H), north and east (N)
//! or east and north (E), in the horizontal plane. Its time is the signal's arrival. With the info
//! T the first value is the travel time, s. Predicted positions and error codes are rejected.
//!
//! Both have a time of day, of which the nearest to the arrival counts, and need their checksum.
//!
//! Sources: `GSO-soslab/whoi_ds`, `ds_sensors/src/ds_sensors/sonardyne_usbl.cpp` and
//! `jrenken/qgis-PosiView` (`$PSONLLD`); EIVA NaviPac, "The Kongsberg NMEA format $PSIMSSB", and
//! NavDP 4000 operator's manual, "Simrad SSBL" (`$PSIMSSB`).

use nalgebra::Vector3;

use super::observation::{
    Axes, CHECKSUM, FIELDS, Location, NO_POSITION, NUMBER, OTHER, Observation, SignalTime, address, number,
    optional,
};
use crate::{
    Parsed,
    nmea::{checksum, seconds_after_midnight},
    reject_if,
};

const OWN_SHIP: &str = "the ship itself";
const AXES: &str = "coordinates of another kind";
const ERROR_CODE: &str = "the modem reports an error";
const PREDICTED: &str = "predicted, not measured";

const DAY_S: f64 = 86_400.0;

pub(super) fn read(line: &str, received_s: f64) -> Parsed<Observation> {
    let sentence = checked(line)?;
    let mut fields = sentence.split(',');
    let message = fields.next().unwrap_or_default();
    let fields: Vec<&str> = fields.collect();
    match message {
        "PSONLLD" => ranger(&fields, received_s),
        "PSIMSSB" => apos(&fields, received_s),
        _ => Err(OTHER),
    }
}

/// The text between `$` and `*`.
fn checked(line: &str) -> Parsed<&str> {
    let (_, sentence) = line.rsplit_once('$').ok_or(OTHER)?;
    let (body, digits) = sentence.trim().rsplit_once('*').ok_or(CHECKSUM)?;
    let matches = digits.len() == 2 && u8::from_str_radix(digits, 16) == Ok(checksum(body.as_bytes()));
    if matches { Ok(body) } else { Err(CHECKSUM) }
}

fn ranger(fields: &[&str], received_s: f64) -> Parsed<Observation> {
    let [time, name, status, lat, lon, ref rest @ ..] = *fields else {
        return Err(FIELDS);
    };
    let at = |field: usize| optional(rest.get(field).copied().unwrap_or_default());
    reject_if(status != "A", NO_POSITION)?;
    // The system prints the ship among its beacons, as "Ship 1".
    let start = name.get(..4);
    let is_ship = start.is_some_and(|start| start.eq_ignore_ascii_case("ship"));
    reject_if(is_ship, OWN_SHIP)?;
    let location = Location::geographic(number(lat)?, number(lon)?)?;
    let (depth, major, minor) = (at(0)?, at(1)?, at(2)?);
    let time = SignalTime::Sent(time_near(time, received_s)?);
    Ok(Observation {
        sigma_m: major.map(|major| major.max(minor.unwrap_or(0.0))),
        depth_m: depth,
        ..Observation::new(address(name)?, time, location)
    })
}

fn apos(fields: &[&str], received_s: f64) -> Parsed<Observation> {
    let (&[time, name, status, error, system], rest) = fields.split_first_chunk().ok_or(FIELDS)?;
    let (&[orientation, filter, x, y, depth, accuracy], more) = rest.split_first_chunk().ok_or(FIELDS)?;
    reject_if(status != "A", NO_POSITION)?;
    reject_if(!error.is_empty(), ERROR_CODE)?;
    reject_if(filter != "M" && filter != "F", PREDICTED)?;
    let (x, y, depth) = (number(x)?, number(y)?, optional(depth)?);
    let z = depth.unwrap_or(0.0);
    let (axes, vector) = match (system, orientation) {
        ("C", "H") => (Axes::HeadUp, Vector3::new(y, x, z)),
        ("C", "N") => (Axes::North, Vector3::new(x, y, z)),
        ("C", "E") => (Axes::North, Vector3::new(y, x, z)),
        _ => return Err(AXES),
    };
    let travel = match more {
        ["T", travel, ..] => optional(travel)?,
        _ => None,
    };
    reject_if(travel.is_some_and(|travel| travel < 0.0), NUMBER)?;
    let time = SignalTime::Arrived(time_near(time, received_s)?);
    let location = Location::Vector { axes, vector, has_depth: depth.is_some() };
    Ok(Observation {
        travel_s: travel,
        sigma_m: optional(accuracy)?,
        ..Observation::new(address(name)?, time, location)
    })
}

/// The time `hhmmss.ss` nearest to `received_s`, s of Unix time; an empty field is that time.
fn time_near(text: &str, received_s: f64) -> Parsed<f64> {
    if text.is_empty() {
        return Ok(received_s);
    }
    let of_day = seconds_after_midnight(text.trim_end()).ok_or(NUMBER)?;
    Ok(((received_s - of_day) / DAY_S).round() * DAY_S + of_day)
}

/// The line of a sentence, for generated samples.
#[cfg(test)]
pub(super) fn line(body: &str) -> String {
    format!("${body}*{:02X}\r\n", checksum(body.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::{super::observation::NOT_ON_EARTH, *};

    /// 2026-05-23 00:00:00 UTC.
    const MIDNIGHT_S: f64 = 1_779_494_400.0;

    fn at(hours: f64, minutes: f64, seconds: f64) -> f64 {
        MIDNIGHT_S + hours * 3600.0 + minutes * 60.0 + seconds
    }

    #[test]
    fn published_ranger_sentences_are_read() {
        // jrenken/udp4all, src/ranger2gapsprocessor.cpp, and GSO-soslab/whoi_ds.
        let beacon = "$PSONLLD,133707.52,2401,A,51.3315406,-0.83563975,999.916,5.33,5.33,0.00,0.62,,,,*2A";
        let found = read(beacon, at(13.0, 37.0, 8.5)).expect("is published");
        assert_eq!((&*found.address, found.sigma_m, found.depth_m), ("2401", Some(5.33), Some(999.916)));
        let SignalTime::Sent(sent_s) = found.time else { panic!("says when") };
        assert!((sent_s - at(13.0, 37.0, 7.52)).abs() < 1e-6);
        assert_eq!(Ok(found.location), Location::geographic(51.331_540_6, -0.835_639_75));

        let alvin =
            "$PSONLLD,170004.53,ALVIN 914,A,28.8114807,-87.80925696,1951.156,13.96,13.96,0.00,2.62,,,,*6F";
        let found = read(alvin, at(17.0, 0.0, 5.0)).expect("is published");
        assert_eq!(found.address, "ALVIN 914");
        let bare = "$PSONLLD,153005.253,24,A,50.02495,8.873323,425.3,,,,,,,,*3e";
        let found = read(bare, at(15.0, 30.0, 6.0)).expect("is published");
        assert_eq!(found.sigma_m, None);
        let ship = "$PSONLLD,133707.59,Ship 1,A,51.3306281,-0.83499295,0.000,0.08,0.08,0.00,0.01,,,,*1D";
        assert_eq!(read(ship, at(13.0, 37.0, 8.0)), Err(OWN_SHIP));
    }

    #[test]
    fn published_apos_sentences_are_read() {
        // lbe19/qgis-udp-nav, tests: derived from a HiPAP's log.
        let tracking = "$PSIMSSB,083733.386,M17,A,,C,N,F,46.649,1.632,24.829,1.414,T,0.033681,*54";
        let found = read(tracking, at(8.0, 37.0, 34.0)).expect("is published");
        let vector = Vector3::new(46.649, 1.632, 24.829);
        assert_eq!(found.location, Location::vector(Axes::North, vector));
        assert_eq!((found.sigma_m, found.travel_s), (Some(1.414), Some(0.033_681)));
        let reply = "$PSIMSSB,083733.036,M17,A,NRy,C,N,F,0.000,0.000,0.000,20.000,T,0.003731,*08";
        assert_eq!(read(reply, at(8.0, 37.0, 34.0)), Err(ERROR_CODE));

        // NavDP 4000 operator's manual, "Simrad SSBL". It prints the checksum 20; 0C is right.
        let body = "PSIMSSB,085405.61,B42,A,,C,H,M,134.5,114.5,120.0,,,,";
        let found = read(&line(body), at(8.0, 54.0, 6.0)).expect("is published");
        let vector = Vector3::new(114.5, 134.5, 120.0);
        assert_eq!(found.location, Location::vector(Axes::HeadUp, vector));
        assert_eq!(read(&format!("${body}*20"), at(8.0, 54.0, 6.0)), Err(CHECKSUM));
    }

    #[test]
    fn a_time_of_day_belongs_to_the_nearest_day() {
        for (text, received, after_s) in [
            ("235959.5", 0.25, -0.5),
            ("000000.25", -0.25, 0.25),
            ("110000", 0.0, 39_600.0),
            ("130000", 0.0, -39_600.0),
            ("130000 ", 0.0, -39_600.0),
            ("", 0.0, 0.0),
        ] {
            assert_eq!(time_near(text, MIDNIGHT_S + received), Ok(MIDNIGHT_S + after_s), "{text}");
        }
        for text in ["1200", "12345", "1.2000", "24000000", "126000.0", "12-100", "1200é0", "120000.x"] {
            assert_eq!(time_near(text, MIDNIGHT_S), Err(NUMBER), "{text}");
        }
    }

    #[test]
    fn a_missing_field_does_not_affect_other_fields() {
        let ranger = read(&line("PSONLLD,,24,A,50.0,8.5"), MIDNIGHT_S).expect("has a position");
        let time = SignalTime::Sent(MIDNIGHT_S);
        assert_eq!((ranger.time, ranger.depth_m, ranger.sigma_m), (time, None, None));
        let apos = read(&line("PSIMSSB,,B01,A,,C,N,M,1,2,,,,,"), MIDNIGHT_S).expect("has a position");
        let location =
            Location::Vector { axes: Axes::North, vector: Vector3::new(1.0, 2.0, 0.0), has_depth: false };
        assert_eq!((apos.time, apos.location), (SignalTime::Arrived(MIDNIGHT_S), location));
    }

    #[test]
    fn sentences_of_other_kinds_are_rejected_by_name() {
        for (body, reason) in [
            ("PSIMSSB,000000,B01,V,,C,H,M,1,2,3,,,,", NO_POSITION),
            ("PSIMSSB,000000,B01,A,,C,H,P,1,2,3,,,,", PREDICTED),
            ("PSIMSSB,000000,B01,A,,P,H,M,1,2,3,,,,", AXES),
            ("PSIMSSB,000000,B01,A,,U,N,M,1,2,3,,,,", AXES),
            ("PSIMSSB,000000,B01,A,,C,H,M,,2,3,,,,", NUMBER),
            ("PSIMSSB,000000,B01,A,,C,H", FIELDS),
            ("PSONLLD,000000,1,V,1,2,3,,,,,,,,", NO_POSITION),
            ("PSONLLD,000000,1,A,91,2,3,,,,,,,,", NOT_ON_EARTH),
            ("PSONLLD,000000,1,A,nan,2,3,,,,,,,,", NUMBER),
            ("PSONDEP,1,2", OTHER),
        ] {
            assert_eq!(read(&line(body), MIDNIGHT_S), Err(reason), "{body}");
        }
        let without = "$PSONLLD,000000,1,A,1,2,3,,,,,,,,";
        assert_eq!(read(without, MIDNIGHT_S), Err(CHECKSUM));
    }
}
