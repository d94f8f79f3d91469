//! Ten million bytes of damaged MAVLink, NMEA 0183 and modem text: no adapter panics, nothing that is heard was not said, and what
//! was refused is counted by name.
//!
//! `cargo test -p pilotfish-bridge --test damaged -- --nocapture` lists what was refused. `PILOTFISH_DAMAGED_BYTES` is the length of each
//! kind's stream: a test run takes a tenth of what was run before release.

use std::{collections::BTreeMap, env};

use mavlink::{
    MAVLinkV2MessageRaw, MavHeader,
    dialects::ardupilotmega::{
        ATTITUDE_DATA, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot,
        MavMessage, MavModeFlag,
    },
};
use pilotfish_bridge::{
    AuvFix, CraftMeasurement, Geographic, Measurement, Refused,
    acoustics::{CraftPose, Modem, PoseHistory, Settings},
    mavlink::{Heard, MavlinkReader},
    nmea::NmeaReader,
};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// Bytes of each kind's stream, unless `PILOTFISH_DAMAGED_BYTES` says otherwise.
const BYTES: usize = 400_000;
/// One message in so many is left whole.
const WHOLE_ONE_OF: u32 = 4;
/// Unix time of all that is heard, s.
const NOW_S: f64 = 1.8e9;
/// Where the craft is, degrees.
const HERE: [f64; 2] = [38.41, -9.12];

fn bytes() -> usize {
    let given = env::var("PILOTFISH_DAMAGED_BYTES").ok();
    given.map_or(BYTES, |given| {
        given.parse().expect("PILOTFISH_DAMAGED_BYTES is a number")
    })
}

/// A stream of `messages`, most of them damaged: bits turned, bytes lost, doubled, invented, halves joined.
fn damaged(messages: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = vec![];
    while stream.len() < bytes() {
        let mut message = messages[rng.random_range(0..messages.len())].clone();
        if rng.random_range(0..WHOLE_ONE_OF) > 0 {
            for _ in 0..rng.random_range(1..4_u8) {
                damage(&mut message, rng);
            }
        }
        stream.append(&mut message);
    }
    stream
}

fn damage(message: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    if message.is_empty() {
        return;
    }
    let at = rng.random_range(0..message.len());
    match rng.random_range(0..6_u8) {
        0 => message[at] ^= 1 << rng.random_range(0..8_u8),
        1 => drop(message.remove(at)),
        2 => message.insert(at, message[at]),
        3 => message.insert(at, rng.random()),
        4 => message.truncate(at),
        _ => {
            let noise = rng.random_range(0..60_usize);
            message.extend((0..noise).map(|_| rng.random::<u8>()));
        }
    }
}

/// `stream` in pieces, as wires deliver it.
fn pieces<'a>(mut stream: &'a [u8], rng: &mut ChaCha8Rng) -> Vec<&'a [u8]> {
    let mut pieces = vec![];
    while !stream.is_empty() {
        let (piece, rest) = stream.split_at(rng.random_range(1..300_usize).min(stream.len()));
        pieces.push(piece);
        stream = rest;
    }
    pieces
}

fn is_on_earth(at: &Geographic) -> bool {
    at.lat_deg.abs() <= 90.0 && at.lon_deg.abs() <= 180.0
}

fn is_sound(measured: &CraftMeasurement) -> bool {
    match measured {
        CraftMeasurement::Position(at) => is_on_earth(at),
        CraftMeasurement::GroundVelocity(velocity) | CraftMeasurement::WaterVelocity(velocity) => {
            velocity.norm() < 1000.0
        }
        CraftMeasurement::Heading(heading) => heading.abs() <= 2.0 * std::f64::consts::PI,
        CraftMeasurement::YawRate(rate) => rate.abs() < 100.0,
    }
}

fn is_sound_fix(fix: &AuvFix) -> bool {
    let numbers = [
        Some(fix.t_s),
        fix.sigma_m,
        fix.depth_m,
        fix.ground_velocity.map(|velocity| velocity.norm()),
    ];
    is_on_earth(&fix.position) && numbers.into_iter().flatten().all(f64::is_finite)
}

/// Prints what was refused of `kind`, and fails if nothing was.
fn list(kind: &str, heard: usize, invented: usize, refused: &Refused) {
    println!(
        "{kind}: {} bytes, {heard} heard, {invented} with a right checksum by chance; refused: {refused}",
        bytes()
    );
    assert!(heard > 0, "{kind}: whole messages are heard among damaged ones");
}

fn frame(system_id: u32, message: &MavMessage) -> Vec<u8> {
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(
        MavHeader {
            system_id,
            component_id: 1,
            sequence: 0,
        },
        message,
    );
    raw.raw_bytes().to_vec()
}

#[test]
fn damaged_mavlink_is_refused() {
    let place = GLOBAL_POSITION_INT_DATA {
        lat: 384_100_000,
        lon: -91_200_000,
        vx: 100,
        vy: 50,
        hdg: 9_000,
        ..GLOBAL_POSITION_INT_DATA::DEFAULT
    };
    let target = FOLLOW_TARGET_DATA {
        lat: 384_100_000,
        lon: -91_200_000,
        est_capabilities: 1,
        ..FOLLOW_TARGET_DATA::DEFAULT
    };
    let beat = HEARTBEAT_DATA {
        custom_mode: 15,
        autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        ..HEARTBEAT_DATA::DEFAULT
    };
    let messages = [
        frame(1, &MavMessage::HEARTBEAT(beat)),
        frame(1, &MavMessage::GLOBAL_POSITION_INT(place)),
        frame(
            1,
            &MavMessage::ATTITUDE(ATTITUDE_DATA {
                yaw: 1.5,
                yawspeed: 0.25,
                ..ATTITUDE_DATA::DEFAULT
            }),
        ),
        frame(7, &MavMessage::FOLLOW_TARGET(target)),
    ];
    let mut whole = MavlinkReader::new(Some(1), BTreeMap::from([(7, "auv-1".to_owned())]));
    let said: Vec<Heard> = messages
        .iter()
        .flat_map(|message| whole.push(message, NOW_S))
        .collect();

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let stream = damaged(&messages, &mut rng);
    let mut reader = MavlinkReader::new(Some(1), BTreeMap::from([(7, "auv-1".to_owned())]));
    let (mut heard, mut invented) = (0, 0);
    for piece in pieces(&stream, &mut rng) {
        for one in reader.push(piece, NOW_S) {
            heard += 1;
            invented += usize::from(!said.contains(&one));
            match &one {
                Heard::Measured(Measurement::Craft { measured, .. }) => {
                    assert!(is_sound(measured), "{one:?}");
                }
                Heard::Measured(Measurement::Auv(fix)) => assert!(is_sound_fix(fix), "{one:?}"),
                _ => {}
            }
        }
    }
    // A damaged frame passes a checksum of 16 bits one time in 65,536; a frame has some 40 bytes and 3 measurements.
    let expected = stream.len() / 40 / 65_536;
    assert!(
        invented <= 6 + 9 * expected,
        "{invented} were never said, of {heard}"
    );
    list("MAVLink", heard, invented, reader.refused());
}

/// The sentence `body` between `$` and `*`, with its checksum.
fn sentence(body: &str) -> Vec<u8> {
    let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${body}*{sum:02X}\r\n").into_bytes()
}

/// Whether a line of `stream` says `what` has a right checksum: found by another route than the reader's.
fn checked_bodies(stream: &[u8]) -> usize {
    let is_checked = |start: usize| {
        let rest = &stream[start + 1..];
        let Some(star) = rest.iter().take(130).position(|byte| *byte == b'*') else {
            return false;
        };
        let sum = rest[..star].iter().fold(0, |sum, byte| sum ^ byte);
        let digits = rest
            .get(star + 1..star + 3)
            .and_then(|digits| std::str::from_utf8(digits).ok());
        digits.and_then(|digits| u8::from_str_radix(digits, 16).ok()) == Some(sum)
    };
    let starts = stream.iter().enumerate().filter(|(_, byte)| **byte == b'$');
    starts.filter(|(start, _)| is_checked(*start)).count()
}

#[test]
fn damaged_nmea_is_refused() {
    let messages: Vec<Vec<u8>> = [
        "GPGGA,080000.00,3824.6000,N,00907.2000,W,1,08,1.0,0.0,M,0.0,M,,",
        "GPVTG,90.0,T,,M,2.0,N,3.7,K,A",
        "HEHDT,123.4,T",
        "HETHS,123.4,A",
        "TIROT,12.0,A",
        "VWVHW,123.4,T,,M,2.0,N,3.7,K",
        "VDVBW,2.0,0.1,A,2.1,0.2,A",
    ]
    .map(sentence)
    .to_vec();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let stream = damaged(&messages, &mut rng);
    let mut whole = NmeaReader::default();
    let said: Vec<Measurement> = messages
        .iter()
        .flat_map(|message| whole.push(message, NOW_S))
        .collect();
    let mut reader = NmeaReader::default();
    let (mut heard, mut invented) = (0, 0);
    for piece in pieces(&stream, &mut rng) {
        for one in reader.push(piece, NOW_S) {
            heard += 1;
            invented += usize::from(!said.contains(&one));
            let Measurement::Craft { measured, .. } = &one else {
                panic!("{one:?}")
            };
            assert!(is_sound(measured), "{one:?}");
        }
    }
    // Every sentence has at most two measurements, and every one that is taken has a checksum that is right.
    assert!(heard <= 2 * checked_bodies(&stream));
    // A checksum of 8 bits lets one damaged sentence in 256 pass.
    let sentences = stream.len() / 45;
    assert!(
        invented <= 20 + sentences / 64,
        "{invented} of {heard} were never said"
    );
    list("NMEA 0183", heard, invented, reader.refused());
}

#[test]
fn damaged_modem_text_is_refused() {
    let settings = |modem: serde_json::Value| -> Settings {
        let settings = json!({ "modem": modem, "names": { "2": "auv-1" }, "sound_speed_mps": 1500.0, "sigma_m": 1.0,
            "mounting": { "forward_m": 0.0, "starboard_m": 0.0, "down_m": 1.0, "heading_offset_rad": 0.0, "depth_m": 1.0 } });
        serde_json::from_value(settings).expect("has the shape")
    };
    let usbl = "USBLLONG,1800000000.20,1800000000.00,2,10.0,20.0,-30.0,20.0,10.0,-30.0,0.0,0.0,0.0,25000,-40,120,0.5\r\n";
    let simrad = "PSIMSSB,080000.00,B01,A,,C,H,M,10.0,20.0,30.0,0.5,A,,";
    let kinds = [
        (
            "Evologics",
            json!({ "evologics": { "frame": "earth" } }),
            usbl.as_bytes().to_vec(),
        ),
        ("PSIMSSB", json!("sentences"), sentence(simrad)),
    ];
    let mut poses = PoseHistory::default();
    let [lat_deg, lon_deg] = HERE;
    for tenth in 0..100_u8 {
        let t_s = NOW_S - 5.0 + 0.1 * f64::from(tenth);
        let position = Geographic { lat_deg, lon_deg };
        poses.push(
            t_s,
            CraftPose {
                position,
                heading: 0.3,
                roll: 0.0,
                pitch: 0.0,
            },
        );
    }
    for (kind, modem, message) in kinds {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let stream = damaged(&[message], &mut rng);
        let mut modem = Modem::new(&settings(modem)).expect("can be used");
        let mut heard = 0;
        for piece in pieces(&stream, &mut rng) {
            for fix in modem.push(piece, NOW_S, &poses) {
                heard += 1;
                assert!(is_sound_fix(&fix), "{fix:?}");
            }
        }
        list(kind, heard, 0, modem.refused());
    }
}
