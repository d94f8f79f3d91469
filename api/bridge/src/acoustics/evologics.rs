//! Evologics S2C modems with USBL.
//!
//! ```text
//! USBLLONG,<current time>,<measurement time>,<remote address>,<X>,<Y>,<Z>,<E>,<N>,<U>,
//!     <roll>,<pitch>,<yaw>,<propagation time>,<rssi>,<integrity>,<accuracy>
//! USBLANGLES,<current time>,<measurement time>,<remote address>,<local bearing>,<local elevation>,
//!     <bearing>,<elevation>,<roll>,<pitch>,<yaw>,<rssi>,<integrity>,<accuracy>
//! ```
//!
//! Times are s of the modem's own clock; only their difference, the age of the fix, is used.
//! Propagation time is µs, one way. Angles are rad, distances and the accuracy of `USBLLONG` m; the
//! accuracy of `USBLANGLES` is rad, negative without a direction. Data mode wraps a line as
//! `+++AT:<length>:<line>`, and the length is checked; command mode prints it bare.
//!
//! Axes, as the published lines in the tests show: (E, N, U) = Rz(yaw) Ry(pitch) Rx(roll) (X, Y,
//! Z), so a level modem's Z is up; bearings are counter-clockwise from X or east, elevations up.
//! With X forward, Y is to port. North is the compass's.
//!
//! Sources: `EvoLogics/evins`, `src/role_at.erl` (fields, −1: no direction); `EvoLogics/dmac`,
//! `src/parser.h` (atan2(Y, X), atan2(N, E), atan2(Z, ‖X, Y‖), range = time · 1e-6 · 1500 m/s);
//! `LSTS/dune`, `src/Transports/Evologics/Driver.hpp` (fields, declination).

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::observation::{
    ADDRESS, Axes, FIELDS, Location, NO_POSITION, OTHER, Observation, SignalTime, line_of_sight, number,
    optional,
};
use super::settings::Frame;
use crate::{Parsed, reject_if};

const LENGTH: &str = "length does not match";
const BACKWARDS: &str = "measured after it was printed";

const S_PER_US: f64 = 1e-6;

/// Prefix of notifications in data mode.
const WRAPPER: &str = "+++AT:";

/// Highest address (`AT!AM`). Source: LSTS/dune, `src/Transports/Evologics/Task.cpp`.
const ADDRESS_MAX: u16 = 254;

pub(super) fn read(line: &str, frame: Frame, received_s: f64) -> Parsed<Observation> {
    let (message, fields) = unwrapped(line)?.split_once(',').ok_or(OTHER)?;
    let n_fields = match message {
        "USBLLONG" => 16,
        "USBLANGLES" => 13,
        _ => return Err(OTHER),
    };
    let fields: Vec<&str> = fields.split(',').collect();
    reject_if(fields.len() != n_fields, FIELDS)?;
    // Both messages begin with times and address, and end with the accuracy.
    let value = |field: usize| number(fields[field]);
    let age = value(0)? - value(1)?;
    let sigma = optional(fields[n_fields - 1])?;
    reject_if(age < 0.0, BACKWARDS)?;
    reject_if(sigma.is_some_and(|sigma| sigma < 0.0), NO_POSITION)?;
    let (address, time) = (address(fields[2])?, SignalTime::Arrived(received_s - age));
    if message == "USBLANGLES" {
        let (axes, unit) = match frame {
            Frame::Body => (Axes::Transducer, line_of_sight(-value(3)?, value(4)?)),
            Frame::Earth => (Axes::Magnetic, line_of_sight(FRAC_PI_2 - value(5)?, value(6)?)),
        };
        let location = Location::Direction { axes, unit, sigma_rad: sigma.ok_or(NO_POSITION)? };
        return Ok(Observation::new(address, time, location));
    }
    let travel = optional(fields[12])?.map(|time| time * S_PER_US);
    reject_if(travel.is_some_and(|travel| travel < 0.0), NO_POSITION)?;
    let (axes, vector) = match frame {
        Frame::Body => (Axes::Transducer, Vector3::new(value(3)?, -value(4)?, -value(5)?)),
        Frame::Earth => (Axes::Magnetic, Vector3::new(value(7)?, value(6)?, -value(8)?)),
    };
    Ok(Observation {
        travel_s: travel,
        sigma_m: sigma,
        ..Observation::new(address, time, Location::vector(axes, vector))
    })
}

/// The notification itself. Data of a burst may stand before the wrapper on the same line.
fn unwrapped(line: &str) -> Parsed<&str> {
    let Some(start) = line.rfind(WRAPPER) else {
        return Ok(line.trim());
    };
    let (length, body) = line[start + WRAPPER.len()..].split_once(':').ok_or(LENGTH)?;
    reject_if(length.parse() != Ok(body.len()), LENGTH)?;
    Ok(body)
}

fn address(text: &str) -> Parsed<String> {
    let address = text.trim().parse::<u16>().ok();
    let assigned = address.filter(|address| (1..=ADDRESS_MAX).contains(address));
    Ok(assigned.ok_or(ADDRESS)?.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::mounting::attitude;
    use super::super::observation::NUMBER;
    use super::*;

    /// Lines of real modems, published in `Brazilian-Institute-of-Robotics/drivers-usbl_evologics`
    /// (`test/test_UsblParser.cpp`) and in public ground-station programs that quote their logs.
    const LONG: [&str; 4] = [
        "USBLLONG,1464207778.381274,1464207778.075953,2,13.6015,3.1369,1.7311,13.6015,3.1369,1.7311,0.0000,-0.0000,0.0000,9377,-54,106,0.1698",
        "+++AT:124:USBLLONG,10446.991981,10446.534643,3,-0.0604,-1.0888,-0.5851,-0.4233,-1.0020,-0.5901,0.0063,0.0269,-0.3295,825,-36,77,1.2375",
        "+++AT:123:USBLLONG,144.369001,144.132576,3,-0.0649,-3.3087,-0.9908,-3.0506,-0.5748,-1.5156,0.1632,-0.0799,-1.4027,2303,-58,142,0.0586",
        "+++AT:132:USBLLONG,1325384364.662679,1325384364.401149,2,0.0234,0.3407,-0.1417,-0.3286,0.0800,-0.1494,-0.0178,0.1164,1.3498,247,-16,388,0.0116",
    ];
    const ANGLES: &str = "+++AT:116:USBLANGLES,1325377475.019626,1325377474.170448,2,-2.2959,-0.4586,-1.7643,-0.4293,0.0307,0.0766,0.5695,-16,296,0.0114";

    /// Turns the printed axes by roll, pitch and yaw, from the field `first` on.
    fn turned(line: &str, first: usize, xyz: Vector3<f64>) -> Vector3<f64> {
        let fields = line.split(',').skip(1 + first).take(3);
        let angles: Vec<f64> = fields.map(|field| field.parse().expect("is a number")).collect();
        attitude(angles[0], angles[1], angles[2]) * xyz
    }

    /// The observations in both frames, with X, Y to port, Z up, and with east, north, up.
    fn both(line: &str) -> [(Observation, Vector3<f64>); 2] {
        [Frame::Body, Frame::Earth].map(|frame| {
            let observation = read(line, frame, 1000.0).expect("is published");
            let (Location::Vector { vector: v, .. } | Location::Direction { unit: v, .. }) =
                observation.location
            else {
                panic!("is not on Earth")
            };
            let is_body = frame == Frame::Body;
            let (x, y) = if is_body { (v.x, -v.y) } else { (v.y, v.x) };
            (observation, Vector3::new(x, y, -v.z))
        })
    }

    #[test]
    fn published_positions_agree_in_both_frames_and_with_their_one_way_propagation_times() {
        for line in LONG {
            let [(observation, xyz), (_, enu)] = both(line);
            let turned = turned(line, 9, xyz);
            // Four printed decimals in positions and angles, at up to 4 m.
            assert!((turned - enu).norm() < 3e-4, "{turned} and {enu}");
            let speed = xyz.norm() / observation.travel_s.expect("is measured");
            // The shortest range is 0.4 m, and the time is printed in whole µs: half a percent.
            assert!((speed - 1500.0).abs() < 8.0, "{speed}");
        }
    }

    #[test]
    fn published_angles_agree_in_both_frames() {
        let [(observation, local), (_, enu)] = both(ANGLES);
        let turned = turned(ANGLES, 7, local);
        // Four printed decimals of each angle.
        assert!((turned - enu).norm() < 2e-4, "{turned} and {enu}");
        let Location::Direction { sigma_rad, .. } = observation.location else { panic!("is a direction") };
        assert!((sigma_rad - 0.0114).abs() < 1e-12);
    }

    #[test]
    fn damaged_lines_are_rejected_by_name() {
        let long = LONG[1];
        let no_number = long.replace("-0.0604", "00000NaN").replace(":124:", ":125:");
        let no_accuracy = ANGLES.replace("116", "117").replace("0.0114", "-1.0000");
        for (line, reason) in [
            (long.replace("124", "125"), LENGTH),
            (long.replace("0.0269", "0.026"), LENGTH),
            (long.replace("+++AT:124:", "").replace(",77,", ","), FIELDS),
            (long.replace("-0.0604", "-0.06x4"), NUMBER),
            (no_number, NUMBER),
            (long.replace("10446.534643", "10447.534643"), BACKWARDS),
            (long.replace(",3,-", ",0,-"), ADDRESS),
            (no_accuracy, NO_POSITION),
            ("+++AT:13:DELIVEREDIM,3".to_owned(), OTHER),
            ("+++AT".to_owned(), OTHER),
            ("+++AT:".to_owned(), LENGTH),
        ] {
            assert_eq!(read(&line, Frame::Body, 0.0), Err(reason), "{line}");
        }
        assert!(read(&format!("burst data {long}"), Frame::Body, 0.0).is_ok());
    }
}
