//! Blueprint Subsea SeaTrac X150 USBL beacons.
//!
//! A response is `$`, the message as pairs of hexadecimal digits, and four digits of checksum, low
//! byte first: CRC-16 with the polynomial 0xA001, from 0, over the message's bytes. The message is
//! a command byte, `CID_PING_RESP` (0x42) or `CID_NAV_QUERY_RESP` (0x52), and an acoustic fix.
//! Numbers are little endian.
//!
//! ```text
//! ACOFIX_T  dest u8, src u8, flags u8, type u8, yaw pitch roll i16 0.1°, local depth u16 0.1 m,
//!           speed of sound u16 0.1 m/s, rssi i16
//! range     (flags bit 0)  count u32, time i32 100 ns, distance u16 0.1 m
//! usbl      (flags bit 1)  channels u8, rssi i16 × channels, azimuth elevation i16 0.1°, error i16
//! position  (flags bit 2)  easting i16, northing i16, depth i16, 0.1 m; depth from the surface
//! ```
//!
//! With flag bit 4 the beacon's own filter distrusts the position: the fix is rejected. The
//! beacon's compass (magnetic north) turns positions; azimuth and elevation are in its own axes,
//! here clockwise from forward and up. A response has no time: its signal arrives with its line. It
//! has no accuracy in metres.
//!
//! Sources: `BYU-FRoSt-Lab/seatrac_driver`, `include/seatrac_driver/SeatracTypes.h` and
//! `tests/src/checksum_test.cpp`, which quote the maker's developer guide.

use nalgebra::Vector3;

use super::observation::{
    ADDRESS, Axes, CHECKSUM, Location, NO_POSITION, OTHER, Observation, SignalTime, line_of_sight,
};
use super::settings::Frame;
use crate::{Parsed, imc::codec::checksum, reject_if};

const NOT_HEX: &str = "no hexadecimal digits";
const TOO_SHORT: &str = "message too short";
const DOUBTFUL: &str = "the modem doubts the position";

const CID_PING_RESP: u8 = 0x42;
const CID_NAV_QUERY_RESP: u8 = 0x52;

const RANGE_VALID: u8 = 1;
const USBL_VALID: u8 = 1 << 1;
const POSITION_VALID: u8 = 1 << 2;
const POSITION_FLT_ERROR: u8 = 1 << 4;

/// Beacons have the identities 1 to 15; 0 means all.
const BEACONS: std::ops::RangeInclusive<u8> = 1..=15;

/// Decimetres, tenths of a degree and tenths of a metre per second to their units.
const TENTH: f64 = 0.1;

const CRC_BYTES: usize = 2;

pub(super) fn read(line: &str, frame: Frame, received_s: f64) -> Parsed<Observation> {
    let message = message(line)?;
    let mut bytes = Bytes(&message);
    reject_if(![CID_PING_RESP, CID_NAV_QUERY_RESP].contains(&bytes.u8()?), OTHER)?;
    let fix = AcousticFix::read(&mut bytes)?;
    reject_if(fix.is_doubtful, DOUBTFUL)?;
    let (location, depth_m) = match frame {
        Frame::Body => {
            let distance = fix.distance.ok_or(NO_POSITION)?;
            let along = |(azimuth, elevation)| line_of_sight(azimuth, elevation) * distance;
            let vector = fix.angles.map(|angles| Location::vector(Axes::Transducer, along(angles)));
            (vector.unwrap_or(Location::Range(distance)), None)
        }
        Frame::Earth if fix.position.is_none() => (Location::Range(fix.distance.ok_or(NO_POSITION)?), None),
        Frame::Earth => {
            let mut vector = fix.position.ok_or(NO_POSITION)?;
            let depth = vector.z;
            vector.z -= fix.local_depth;
            (Location::vector(Axes::Magnetic, vector), Some(depth))
        }
    };
    let time = SignalTime::Arrived(received_s);
    Ok(Observation {
        travel_s: fix.distance.and_then(|distance| fix.travel(distance)),
        depth_m,
        transducer_depth_m: Some(fix.local_depth),
        ..Observation::new(fix.source.to_string(), time, location)
    })
}

/// The bytes between `$` and the checksum.
fn message(line: &str) -> Parsed<Vec<u8>> {
    let (_, digits) = line.rsplit_once('$').ok_or(OTHER)?;
    let mut bytes = hex::decode(digits.trim()).map_err(|_| NOT_HEX)?;
    let body = bytes.len().checked_sub(CRC_BYTES).ok_or(TOO_SHORT)?;
    let crc = bytes.split_off(body);
    reject_if(checksum(&bytes).to_le_bytes() != crc[..], CHECKSUM)?;
    Ok(bytes)
}

struct AcousticFix {
    source: u8,
    is_doubtful: bool,
    local_depth: f64,
    sound_speed: f64,
    distance: Option<f64>,
    /// Azimuth and elevation, rad.
    angles: Option<(f64, f64)>,
    /// North, east, depth from the surface, m.
    position: Option<Vector3<f64>>,
}

impl AcousticFix {
    /// One way, s: distance over speed of sound. Documents do not say so of the beacon's time.
    fn travel(&self, distance: f64) -> Option<f64> {
        (self.sound_speed > 0.0).then(|| distance / self.sound_speed)
    }

    fn read(bytes: &mut Bytes<'_>) -> Parsed<Self> {
        let (_destination, source, flags, _kind) = (bytes.u8()?, bytes.u8()?, bytes.u8()?, bytes.u8()?);
        reject_if(!BEACONS.contains(&source), ADDRESS)?;
        let _attitude = [bytes.i16()?, bytes.i16()?, bytes.i16()?];
        let [local_depth, sound_speed] = [bytes.u16()?, bytes.u16()?].map(|tenths| f64::from(tenths) * TENTH);
        let _rssi = bytes.i16()?;
        let mut fix = Self {
            source,
            is_doubtful: flags & POSITION_FLT_ERROR != 0,
            local_depth,
            sound_speed,
            distance: None,
            angles: None,
            position: None,
        };
        if flags & RANGE_VALID != 0 {
            let _count_and_time = [bytes.u16()?, bytes.u16()?, bytes.u16()?, bytes.u16()?];
            fix.distance = Some(f64::from(bytes.u16()?) * TENTH);
        }
        if flags & USBL_VALID != 0 {
            for _channel in 0..bytes.u8()? {
                bytes.i16()?;
            }
            let mut angle = || bytes.i16().map(|tenths| (f64::from(tenths) * TENTH).to_radians());
            fix.angles = Some((angle()?, angle()?));
            let _fit_error = bytes.i16()?;
        }
        if flags & POSITION_VALID != 0 {
            let mut decimetres = || bytes.i16().map(|value| f64::from(value) * TENTH);
            let (east, north, depth) = (decimetres()?, decimetres()?, decimetres()?);
            fix.position = Some(Vector3::new(north, east, depth));
        }
        Ok(fix)
    }
}

/// Reads numbers off the front.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>().ok_or(TOO_SHORT)?;
        self.0 = rest;
        Ok(*first)
    }

    fn u8(&mut self) -> Parsed<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Parsed<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn i16(&mut self) -> Parsed<i16> {
        self.take().map(i16::from_le_bytes)
    }
}

/// The line of a message, for generated samples.
#[cfg(test)]
pub(super) fn line(message: &[u8]) -> String {
    let crc = checksum(message).to_le_bytes();
    let digits = message.iter().chain(&crc).map(|byte| format!("{byte:02X}"));
    format!("${}\r\n", digits.collect::<Vec<_>>().concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines published in `tidewise/drivers-orogen-usbl_seatrac`, `test/task_test.rb`.
    const PING: &str = "$42020F07020101010101010101010101010101010101010101010101010101010101010101010101010101010101010101B0";
    const STATUS: &str = "$103FA4E50F0000000000285D09010D00000001000000133C2406EDFFF9F80EFF090100005EF9FE1AFFE1FEC400F3005301EDFF0200EA009B0551FDC8FB16000000040070C8B6C018E2D24055687443A410BA4487451DC41C019CC40000B04100000000000080408C00";

    #[test]
    fn the_published_response_is_read() {
        // Each byte after the flags is 1: 257 decimetres, over 25.7 m/s, which takes one second.
        let (sin, cos) = 25.7_f64.to_radians().sin_cos();
        for (frame, expected) in [
            (Frame::Earth, Vector3::new(25.7, 25.7, 0.0)),
            (Frame::Body, Vector3::new(cos * cos, cos * sin, -sin) * 25.7),
        ] {
            let observation = read(PING, frame, 1000.0).expect("is published");
            let (address, time) = (observation.address.as_str(), observation.time);
            assert_eq!((address, time), ("15", SignalTime::Arrived(1000.0)));
            let travel = observation.travel_s.expect("has a range");
            assert!((travel - 1.0).abs() < 1e-12, "{travel}");
            let depth_m = (frame == Frame::Earth).then_some(25.7);
            let depth = observation.depth_m.map(|depth| (depth * 10.0).round() / 10.0);
            assert_eq!(depth, depth_m);
            let Location::Vector { vector, .. } = observation.location else { panic!("is a vector") };
            assert!((vector - expected).norm() < 1e-9, "{vector}");
        }
    }

    #[test]
    fn other_published_messages_have_a_valid_checksum_and_no_observation() {
        for line in [STATUS, "$4000028015", "$43340266D5", "$12000CA0"] {
            assert_eq!(read(line, Frame::Earth, 0.0), Err(OTHER), "{line}");
        }
    }

    #[test]
    fn incomplete_messages_are_rejected_by_name() {
        let mut message = vec![CID_PING_RESP, 1, 2, 0, 0];
        message.resize(17, 0);
        let mut with_flags = |flags: u8, bytes: usize| {
            message[3] = flags;
            message.resize(bytes, 0);
            read(&line(&message), Frame::Earth, 0.0)
        };
        let ranged = with_flags(RANGE_VALID, 27).map(|observation| observation.location);
        assert_eq!(ranged, Ok(Location::Range(0.0)));
        assert_eq!(with_flags(0, 17), Err(NO_POSITION));
        assert_eq!(with_flags(POSITION_VALID | POSITION_FLT_ERROR, 23), Err(DOUBTFUL));
        assert_eq!(with_flags(POSITION_VALID, 22), Err(TOO_SHORT));
        assert!(with_flags(POSITION_VALID, 23).is_ok());
        message[2] = 0;
        assert_eq!(read(&line(&message), Frame::Earth, 0.0), Err(ADDRESS));
        for (text, reason) in [("$", TOO_SHORT), ("$4", NOT_HEX), ("$4x", NOT_HEX), ("#42", OTHER)] {
            assert_eq!(read(text, Frame::Earth, 0.0), Err(reason), "{text}");
        }
    }
}
