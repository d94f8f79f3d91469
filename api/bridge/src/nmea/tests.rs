//! Published sentences, and properties for any bytes.

mod any_bytes;
mod vessels;
mod written;

use nalgebra::Vector2;

use super::*;
use crate::{
    CraftMeasurement::{self, GroundSpeed, GroundVelocity, Heading, Position, WaterVelocity, YawRate},
    on_earth,
};

/// 2026-03-14 00:00:00 UTC, s of Unix time.
const MIDNIGHT_S: f64 = 1_773_446_400.0;
/// 12:35:20 on that day: a second after the examples of gpsinformation.org were measured.
const RECEIVED_S: f64 = MIDNIGHT_S + 45_320.0;
/// Tolerance of values that another program computed to 16 digits.
const TOLERANCE: f64 = 1e-12;

// Sources: gpsinformation.org/dale/nmea.htm (GGA, RMC, VTG), pynmea2 (the southern GGA), gpsd's
// "NMEA Revealed" (HDT), SignalK (VHW), go-nmea (THS, ROT, VBW), converted to SI by Python.
const GGA: &str = "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47";
const RMC: &str = "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A";
const VTG: &str = "$GPVTG,054.7,T,034.4,M,005.5,N,010.2,K*48";
const HDT: &str = "$HEHDT,341.8,T*21";
const THS: &str = "$INTHS,123.456,A*20";
const ROT: &str = "$HEROT,-11.23,A*07";
const VHW: &str = "$IIVHW,201.1,T,209.2,M,6.5,N,12.0,K*6E";
const VBW: &str = "$VMVBW,-7.1,0.1,A,,,V,,V,,V*65";
const PUBLISHED: [&str; 10] = [GGA, RMC, VTG, HDT, THS, ROT, VHW, VBW, vessels::CLASS_A, vessels::EXTENDED];

/// The measurements in `text`, received at `received_s`, and the reasons of rejections.
fn read_at(text: &str, received_s: f64) -> (Vec<(f64, CraftMeasurement)>, Vec<&'static str>) {
    let mut reader = NmeaReader::default();
    let mut read = Vec::new();
    for measurement in reader.push(text.as_bytes(), received_s) {
        match measurement {
            Measurement::Craft { t_s, measured, .. } => read.push((t_s, measured)),
            other => panic!("no measurement of the craft: {other:?}"),
        }
    }
    (read, reader.rejects().iter().map(|(reason, _)| reason).collect())
}

fn measured_in(sentence: &str) -> Vec<CraftMeasurement> {
    let (read, rejected) = read_at(&format!("{sentence}\r\n"), RECEIVED_S);
    assert_eq!(rejected, Vec::<&str>::new(), "{sentence}");
    read.into_iter().map(|(_, measured)| measured).collect()
}

/// The only reason that a sentence with the right checksum is rejected.
fn rejection_of(payload: &str) -> &'static str {
    let (read, rejected) = read_at(&with_checksum(payload), RECEIVED_S);
    assert_eq!(read, [], "{payload}");
    assert_eq!(rejected.len(), 1, "{payload}: {rejected:?}");
    rejected[0]
}

fn with_checksum(payload: &str) -> String {
    format!("${payload}*{:02X}\r\n", sentence::checksum(payload.as_bytes()))
}

fn assert_near(measured: &[CraftMeasurement], expected: &[CraftMeasurement]) {
    let is_near = |(found, wanted): (&CraftMeasurement, &CraftMeasurement)| {
        let ((first, second), (wanted_first, wanted_second)) = (numbers_of(found), numbers_of(wanted));
        std::mem::discriminant(found) == std::mem::discriminant(wanted)
            && (first - wanted_first).abs() < TOLERANCE
            && (second - wanted_second).abs() < TOLERANCE
    };
    let is_same = measured.len() == expected.len() && measured.iter().zip(expected).all(is_near);
    assert!(is_same, "{measured:?} is not {expected:?}");
}

fn numbers_of(measured: &CraftMeasurement) -> (f64, f64) {
    match *measured {
        Position(place) => (place.lat_deg, place.lon_deg),
        GroundVelocity(velocity) | WaterVelocity(velocity) => (velocity.x, velocity.y),
        Heading(number) | YawRate(number) | GroundSpeed(number) => (number, 0.0),
    }
}

fn place(lat_deg: f64, lon_deg: f64) -> CraftMeasurement {
    Position(on_earth(lat_deg, lon_deg).expect("is on Earth"))
}

#[test]
fn published_sentences_have_their_documented_content() {
    let munich = place(48.1173, 11.516_666_666_666_667);
    let velocity = GroundVelocity(Vector2::new(1.124_501_966_646_767_3, 11.468_558_234_101_74));
    assert_near(&measured_in(GGA), &[munich]);
    assert_near(&measured_in(RMC), &[munich, velocity]);
    let velocity = GroundVelocity(Vector2::new(1.635_016_044_991_773_9, 2.309_215_970_154_586_5));
    assert_near(&measured_in(VTG), &[velocity]);
    assert_near(&measured_in(HDT), &[Heading(-0.317_649_923_862_967_7)]);
    assert_near(&measured_in(THS), &[Heading(2.154_713_681_342_119_7)]);
    assert_near(&measured_in(ROT), &[YawRate(-0.003_266_674_583_316_053_7)]);
    let through_water = WaterVelocity(Vector2::new(3.343_888_888_888_889, 0.0));
    assert_near(&measured_in(VHW), &[Heading(-2.773_328_181_418_99), through_water]);
    // -7.1 and 0.1 knots.
    let through_water = WaterVelocity(Vector2::new(-3.652_555_555_555_555_5, 0.051_444_444_444_444_445));
    assert_near(&measured_in(VBW), &[through_water]);
    let southern = "$GPGGA,184353.07,1929.045,S,02410.506,E,1,04,2.6,100.00,M,-33.9,M,,0000*6D\n";
    let (read, _) = read_at(southern, MIDNIGHT_S + 67_433.07);
    assert_near(&[read[0].1], &[place(-19.484_083_333_333_333, 24.1751)]);
}

#[test]
fn a_time_of_day_belongs_to_the_day_nearest_to_the_arrival() {
    let gga = |time: &str| with_checksum(&format!("GPGGA,{time},4807.038,N,01131.000,W,4,08,0.9,,M,,M,,"));
    for (time, received_s, t_s) in [
        ("123519", RECEIVED_S, RECEIVED_S - 1.0),
        ("123519.250", RECEIVED_S, RECEIVED_S - 0.75),
        ("235959.5", MIDNIGHT_S + 0.5, MIDNIGHT_S - 0.5),
        ("000000.5", MIDNIGHT_S - 0.5, MIDNIGHT_S + 0.5),
        ("000001.4", MIDNIGHT_S, MIDNIGHT_S + 1.4),
        // A leap second, and a writer that rounds 59.9996.
        ("235960.000", MIDNIGHT_S, MIDNIGHT_S),
    ] {
        let (read, rejected) = read_at(&gga(time), received_s);
        assert_eq!((read[0].0, rejected), (t_s, vec![]), "{time}");
    }
    for time in ["000001.6", "120000", "235958.4"] {
        let (read, rejected) = read_at(&gga(time), MIDNIGHT_S);
        assert_eq!((read[0].0, rejected), (MIDNIGHT_S, vec!["clock"]), "{time}");
    }
    let (read, rejected) = read_at(&gga(""), MIDNIGHT_S);
    assert_eq!((read[0].0, rejected), (MIDNIGHT_S, vec![]));
}

/// Claims that each payload of a table, `payload | reason`, is rejected for that reason.
fn assert_rejected(table: &str) {
    for row in table.trim().lines() {
        let (payload, reason) = row.trim_start().split_once("| ").expect(row);
        assert_eq!(rejection_of(payload.trim_end()), reason, "{row}");
    }
}

#[test]
fn unmeasured_values_are_rejected_by_name() {
    assert_rejected(
        "
        GPGGA,123519,4807.038,N,01131.000,E,0,00,,,M,,M,,          | no fix
        GPGGA,,,,,,0,00,99.99,,,,,,                                | no fix
        GNRMC,123519,V,4807.038,N,01131.000,E,1.0,2.0,140326,,,N   | no fix
        GNRMC,123519,A,4807.038,N,01131.000,E,1.0,2.0,140326,,,N   | no fix
        GNVTG,,T,,M,,N,,K,N                                        | no fix
        GPGLL,4807.038,N,01131.000,E,123519,V,N                    | no fix
        GPGGA,123519,4807.038,N,01131.000,E,8,08,,,M,,M,,          | not measured
        GNRMC,123519,A,4807.038,N,01131.000,E,1.0,2.0,140326,,,S   | not measured
        INTHS,123.456,S                                            | not measured
        INTHS,,V                                                   | not valid
        TIROT,3.0,V                                                | not valid
        VDVBW,1.0,0.0,V,1.0,0.0,A                                  | not valid
        HCHDG,101.1,,,7.1,W                                        | magnetic
        HCHDM,101.1,M                                              | magnetic
        IIVDR,10.1,T,12.3,M,1.2,N                                  | unused sentence
        PXHDT,1.0,T                                                | unused sentence
        GP                                                         | unused sentence
        | unused sentence
        GNVTG,054.7,T,,M,,N,,K,A                                   | VTG without a speed
        GPGLL,,,,,123519,A,A                                       | GLL without a position
        GPRMC,123519,A,,,,,,,140326,,,A                            | RMC without position and speed
        HEHDT,,T                                                   | HDT without a heading
        TIROT,,A                                                   | ROT without a rate
        VDVBW,,0.5,A,1.0,0.0,A                                     | VBW without a speed
        VWVHW,,T,,M,,N,,K                                          | VHW without true heading and speed
        ",
    );
}

#[test]
fn a_missing_field_does_not_affect_other_fields() {
    let munich = place(48.1173, 11.516_666_666_666_667);
    let one_knot = 0.514_444_444_444_444_5;
    let east = GroundVelocity(Vector2::new(0.0, one_knot));
    let ahead = WaterVelocity(Vector2::new(one_knot, 0.0));
    let slow = GroundSpeed(one_knot);
    for (payload, expected) in [
        // RMC without course, speed, both, date, time, mode, variation.
        ("GPRMC,123519,A,4807.038,N,01131.000,E,1.0,,140326,,,A", &[munich, slow][..]),
        ("GPRMC,123519,A,4807.038,N,01131.000,E,,90.0,140326,,,A", &[munich]),
        ("GPRMC,123519,A,4807.038,N,01131.000,E,,,140326,,,A", &[munich]),
        ("GPRMC,123519,A,4807.038,N,01131.000,E,1.0,90.0,,,,A", &[munich, east]),
        ("GPRMC,,A,4807.038,N,01131.000,E,1.0,90.0,140326,,,A", &[munich, east]),
        ("GPRMC,123519,A,4807.038,N,01131.000,E,1.0,90.0", &[munich, east]),
        ("GPRMC,123519,A,,,,,1.0,90.0,140326,3.1,W,A", &[east]),
        // GGA with quality and position only; GLL without time, status and mode.
        ("GPGGA,,4807.038,N,01131.000,E,1", &[munich]),
        ("GPGLL,4807.038,N,01131.000,E,123519,A,A", &[munich]),
        ("GPGLL,4807.038,N,01131.000,E", &[munich]),
        // VTG at rest, and with one of its speeds.
        ("GNVTG,,T,,M,0.00,N,0.00,K,A", &[GroundSpeed(0.0)]),
        ("GNVTG,90.0,T,,M,,N,1.852,K,A", &[east]),
        ("VDVBW,1.0,,A,1.0,0.0,A", &[ahead]),
        ("VWVHW,,T,,M,1.0,N,,K", &[ahead]),
        ("VWVHW,0.0,T,,M,,N,,K", &[Heading(0.0)]),
    ] {
        let (read, rejected) = read_at(&with_checksum(payload), RECEIVED_S);
        let read: Vec<_> = read.into_iter().map(|(_, measured)| measured).collect();
        assert_eq!(rejected, Vec::<&str>::new(), "{payload}");
        assert_near(&read, expected);
    }
}

#[test]
fn a_sentence_with_the_time_and_content_of_an_earlier_one_is_rejected() {
    let gga = |time: &str, minutes: &str| {
        with_checksum(&format!("GPGGA,{time},48{minutes},N,01131.000,E,1,08,0.9,,M,,M,,"))
    };
    let stands = gga("123519", "07.038").repeat(5) + HDT + "\r\n" + HDT + "\r\n";
    let (read, rejected) = read_at(&stands, RECEIVED_S);
    assert_eq!((read.len(), rejected), (3, vec!["repeated sentence"]), "headings state no time");
    // At rest, and with a slow clock.
    for goes_on in [
        gga("123519", "07.038") + &gga("123520", "07.038"),
        gga("123519", "07.038") + &gga("123519", "07.039"),
    ] {
        let (read, rejected) = read_at(&goes_on, RECEIVED_S);
        assert_eq!((read.len(), rejected), (2, vec![]), "{goes_on}");
    }
}

#[test]
fn impossible_values_are_rejected_by_name() {
    assert_rejected(
        "
        HEHDT,nan,T                       | number
        HEHDT,inf,T                       | number
        HEHDT,1e1,T                       | number
        HEHDT,1.2.3,T                     | number
        HEHDT,--1,T                       | number
        HEHDT,.,T                         | number
        HEHDT, 1,T                        | number
        HEHDT,360.1,T                     | range
        HEHDT,-1.0,T                      | range
        TIROT,10000,A                     | range
        GPVTG,054.7,T,034.4,M,102.3,N,,K  | range
        GPVTG,054.7,T,034.4,M,,N,189.3,K  | range
        GPVTG,054.7,T,034.4,M,-5.5,N,010.2,K   | range
        HEHDT,101.1,M                     | unit
        HEHDT,101.1                       | unit
        GPVTG,054.7,034.4,005.5,010.2     | unit
        GPVTG,054.7,T,034.4,M,005.5,K,010.2,K  | unit
        GPGGA,123519,9000.001,N,01131.000,E,1,,,,,,,,  | position
        GPGGA,123519,4807.038,N,18000.001,E,1,,,,,,,,  | position
        GPGGA,123519,0000.000,N,00000.000,E,1,,,,,,,,  | position
        GPGGA,123519,4861.000,N,01131.000,E,1,,,,,,,,  | position
        GPGGA,123519,4807.038,E,01131.000,N,1,,,,,,,,  | position
        GPGGA,123519,4807.038,,01131.000,E,1,,,,,,,,   | position
        GPGGA,123519,-807.038,N,01131.000,E,1,,,,,,,,  | position
        GPGGA,123519,07.038,N,01131.000,E,1,,,,,,,,    | position
        GPGGA,240000,4807.038,N,01131.000,E,1,,,,,,,,  | time
        GPGGA,126019,4807.038,N,01131.000,E,1,,,,,,,,  | time
        GPGGA,1235,4807.038,N,01131.000,E,1,,,,,,,,    | time
        GPGGA,12+519,4807.038,N,01131.000,E,1,,,,,,,,  | time
        HEHDT,1\u{e9},T                   | not text
        HEHDT,1\u{0},T                    | not text
        ",
    );
}

#[test]
fn lines_that_are_no_sentences_are_rejected_by_name() {
    let long = format!("${}*00\r\n", "x".repeat(LINE_MAX));
    for (line, reason) in [
        ("$HEHDT,341.8,T\r\n", "no checksum"),
        ("$HEHDT,341.8,T*\r\n", "no checksum"),
        ("$HEHDT,341.8,T*2\r\n", "no checksum"),
        ("$HEHDT,341.8,T*2G\r\n", "no checksum"),
        ("$HEHDT,341.8,T*210\r\n", "no checksum"),
        ("$HEHDT,341.8,T*21 \r\n", "no checksum"),
        ("$\r\n", "no checksum"),
        ("$HEHDT,341.8,T*22\r\n", "wrong checksum"),
        ("HEHDT,341.8,T*21\r\n", "no sentence"),
        (&long, "too long"),
    ] {
        assert_eq!(read_at(line, RECEIVED_S), (vec![], vec![reason]), "{line}");
    }
}

#[test]
fn a_sentence_is_read_after_garbage_without_a_line_end_and_with_a_small_checksum() {
    let heading = measured_in(HDT)[0];
    let garbage = format!("\\s:GPS*00\\$GPGG{HDT}{HDT}\u{0}\n{}{HDT}\r", "x".repeat(1_000));
    let (read, rejected) = read_at(&garbage, RECEIVED_S);
    assert_eq!(read, [(RECEIVED_S, heading); 2]);
    // The second was followed by a byte that does not belong to it.
    assert_eq!(rejected, ["no checksum", "no sentence"]);
    let (read, rejected) = read_at("$HEHDT,74.0,T*1c\n", RECEIVED_S);
    assert_eq!((read.len(), rejected), (1, vec![]));
}

#[test]
fn sentences_of_ardupilot_are_read() {
    // 35.363262° S, 149.165237° E by AP_NMEA_Output.cpp: no mode in RMC, minutes to 5 digits.
    let gga = with_checksum("GPGGA,123519.400,3521.79572,S,14909.91422,E,1,10,01.2,0584.09,M,0.0,M,,");
    let rmc = with_checksum("GPRMC,123519.400,A,3521.79572,S,14909.91422,E,2.92,45.00,140326,,");
    let (read, rejected) = read_at(&format!("{gga}{rmc}"), RECEIVED_S);
    assert_eq!(rejected, Vec::<&str>::new());
    let canberra = place(-35.363_262, 149.165_237);
    // 2.92 knots to the north-east.
    let velocity = GroundVelocity(Vector2::repeat(2.92 * 0.514_444_444_444_444_5 * 0.5_f64.sqrt()));
    assert_near(
        &read.iter().map(|(_, measured)| *measured).collect::<Vec<_>>(),
        &[canberra, canberra, velocity],
    );
    assert!(read.iter().all(|(t_s, _)| *t_s == MIDNIGHT_S + 45_319.4));
}
