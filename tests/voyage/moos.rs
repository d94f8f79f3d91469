//! The boat on the wire of a MOOSDB: its messages as variables, and the bridge's as messages.
//!
//! A helm is in DRIVE while the boat is guided and armed. The stand-in has its own reading and
//! writing of packets.

use mavlink::dialects::ardupilotmega::{
    HEARTBEAT_DATA, MavMessage, PositionTargetTypemask, SET_POSITION_TARGET_LOCAL_NED_DATA, STATUSTEXT_DATA,
};
use mavlink::types::CharArray;

use crate::autopilot::{Boat, GUIDED};

const GREETING: usize = 32;
const WHOLE_TURN: f64 = 360.0;

/// A variable's number or text.
enum Value {
    Number(f64),
    Text(String),
}
use Value::{Number, Text};

/// The packet of `messages`, of a boat and its AUV, written at `unix_s`, s.
pub(super) fn written(boat: &Boat, messages: &[MavMessage], unix_s: f64) -> Vec<u8> {
    let variables = messages.iter().flat_map(|message| match message {
        MavMessage::GLOBAL_POSITION_INT(place) if boat.has_position => {
            let [lat, lon] = [place.lat, place.lon].map(|degrees| f64::from(degrees) * 1e-7);
            let [north, east] = [place.vx, place.vy].map(|speed| f64::from(speed) * 0.01);
            vec![
                ("NAV_LAT", Number(lat)),
                ("NAV_LONG", Number(lon)),
                ("NAV_SPEED_OVER_GROUND", Number(north.hypot(east))),
                ("NAV_HEADING_OVER_GROUND", Number(east.atan2(north).to_degrees().rem_euclid(WHOLE_TURN))),
            ]
        }
        MavMessage::ATTITUDE(attitude) => {
            vec![("NAV_HEADING", Number(f64::from(attitude.yaw).to_degrees().rem_euclid(WHOLE_TURN)))]
        }
        MavMessage::HEARTBEAT(_) => {
            let drives = boat.mode == GUIDED && boat.is_armed;
            vec![("IVPHELM_STATE", Text(if drives { "DRIVE" } else { "PARK" }.to_owned()))]
        }
        _ => vec![],
    });
    packet(variables, unix_s)
}

/// The packet with the node report of an AUV at the place in `message`.
pub(super) fn node_report(auv: &str, message: &MavMessage, unix_s: f64) -> Vec<u8> {
    let MavMessage::GLOBAL_POSITION_INT(place) = message else { unreachable!("is a place") };
    let [lat, lon] = [place.lat, place.lon].map(|degrees| f64::from(degrees) * 1e-7);
    let [north, east] = [place.vx, place.vy].map(|speed| f64::from(speed) * 0.01);
    let (speed, course) = (north.hypot(east), east.atan2(north).to_degrees().rem_euclid(WHOLE_TURN));
    let report = format!(
        "NAME={auv},TYPE=UUV,LAT={lat:.8},LON={lon:.8},SPD={speed:.2},HDG={course:.2},TIME={unix_s:.2}"
    );
    packet([("NODE_REPORT", Text(report))], unix_s)
}

fn packet(variables: impl IntoIterator<Item = (&'static str, Value)>, unix_s: f64) -> Vec<u8> {
    let (mut all, mut count) = (vec![], 0_i32);
    for (key, value) in variables {
        let (kind, number, text) = match &value {
            Number(number) => (b'D', *number, ""),
            Text(text) => (b'S', 0.0, text.as_str()),
        };
        let mut body = 7_i32.to_le_bytes().to_vec();
        body.extend([b'N', kind]);
        for part in ["pBoat", "", "craft", key] {
            body.extend(counted(part));
        }
        body.extend([unix_s, number, -1.0].map(f64::to_le_bytes).concat());
        body.extend(counted(text));
        all.extend(length(body.len() + 4));
        all.extend(body);
        count += 1;
    }
    if count == 0 { vec![] } else { [&length(all.len() + 9)[..], &count.to_le_bytes(), &[0], &all].concat() }
}

fn counted(text: &str) -> Vec<u8> {
    [&length(text.len())[..], text.as_bytes()].concat()
}

fn length(bytes: usize) -> [u8; 4] {
    u32::try_from(bytes).expect("is short").to_le_bytes()
}

/// Time without updates after which the shipped behaviours end, s: the longest.
pub(super) fn watchdog_s() -> f64 {
    let behaviours = include_str!("../../examples/moos/craft.bhv").lines();
    let durations =
        behaviours.filter_map(|line| line.trim().strip_prefix("duration ")?.trim().strip_prefix('='));
    durations.map(|text| text.trim().parse().expect("is a number")).fold(0.0, f64::max)
}

/// What the bridge means by `bytes`, whole packets after a greeting or not.
pub(super) fn messages(bytes: &[u8]) -> Vec<MavMessage> {
    let mut rest = if bytes.starts_with(b"ELKS") { &bytes[GREETING..] } else { bytes };
    let (mut all, mut heading) = (vec![MavMessage::HEARTBEAT(HEARTBEAT_DATA::DEFAULT)], None);
    while !rest.is_empty() {
        let [whole, count] = [number(rest), number(&rest[4..])];
        let mut message = &rest[9..whole];
        rest = &rest[whole..];
        for _ in 0..count {
            let whole = number(message);
            let (this, next) = message.split_at(whole);
            message = next;
            let mut at = 10;
            let mut part = || {
                let start = at + 4;
                at = start + number(&this[at..]);
                std::str::from_utf8(&this[start..at]).expect("is text")
            };
            let [_, _, _, key] = [(); 4].map(|()| part());
            at += 24;
            let start = at + 4;
            let text = std::str::from_utf8(&this[start..]).expect("is text");
            let value = text.split_once('=').and_then(|(_, value)| value.parse::<f64>().ok());
            match key {
                "PILOTFISH_HEADING" => heading = value,
                "PILOTFISH_SPEED" => all.extend(
                    heading.zip(value).map(|(heading, speed)| reference((heading.to_radians(), speed))),
                ),
                "PILOTFISH_STATE" => all.push(said(&format!("Pilotfish {text}"))),
                _ => {}
            }
        }
    }
    all
}

/// A reference of a heading, rad, and a speed, m/s.
#[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
pub(super) fn reference((heading, speed): (f64, f64)) -> MavMessage {
    MavMessage::SET_POSITION_TARGET_LOCAL_NED(SET_POSITION_TARGET_LOCAL_NED_DATA {
        vx: speed as f32,
        yaw: heading as f32,
        type_mask: PositionTargetTypemask::from_bits_retain(0x9C7),
        ..SET_POSITION_TARGET_LOCAL_NED_DATA::DEFAULT
    })
}

/// A text to a ground station.
pub(super) fn said(text: &str) -> MavMessage {
    let mut bytes = [0; 50];
    let kept = text.floor_char_boundary(bytes.len());
    bytes[..kept].copy_from_slice(&text.as_bytes()[..kept]);
    MavMessage::STATUSTEXT(STATUSTEXT_DATA { text: CharArray::new(bytes), ..STATUSTEXT_DATA::DEFAULT })
}

fn number(bytes: &[u8]) -> usize {
    let bytes = bytes[..4].try_into().expect("has four");
    u32::from_le_bytes(bytes) as usize
}
