//! AIS: published messages with the content that pyais 3.3.1 reads, and damaged ones.

use planner::snapshot::VesselStatus;
use proptest::prelude::*;

use super::*;
use crate::{VesselFix, VesselMessage};

/// Types 1, 18, 19, both parts of 24, and 5 in two parts, from gpsd's "AIVDM/AIVDO protocol
/// decoding".
pub(super) const CLASS_A: &str = "!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C";
const CLASS_B: &str = "!AIVDM,1,1,,A,B5NJ;PP005l4ot5Isbl03wsUkP06,0*76";
pub(super) const EXTENDED: &str = "!AIVDM,1,1,,B,C5N3SRgPEnJGEBT>NhWAwwo862PaLELTBJ:V00000000S0D:R220,0*0B";
const NAMED: &str = "!AIVDM,1,1,,A,H42O55i18tMET00000000000000,2*6D";
const MEASURED: &str = "!AIVDM,1,1,,A,H42O55lt0000000D3nink000?0500,0*70";
const VOYAGE: [&str; 2] = [
    "!AIVDM,2,1,1,A,55?MbV02;H;s<HtKR20EHE:0@T4@Dn2222222216L961O5Gf0NSQEp6ClRp8,0*1C",
    "!AIVDM,2,2,1,A,88888888880,2*25",
];

fn heard(lines: &[&str]) -> (Vec<VesselMessage>, String) {
    let mut reader = NmeaReader::default();
    let wire = lines.join("\r\n") + "\r\n";
    let read = reader.push(wire.as_bytes(), RECEIVED_S).into_iter().map(|measurement| match measurement {
        Measurement::Vessel(message) => message,
        other => panic!("{other:?}"),
    });
    (read.collect(), reader.rejects().to_string())
}

fn message(line: &str) -> VesselMessage {
    let (heard, rejected) = heard(&[line]);
    assert_eq!((heard.len(), &*rejected), (1, ""), "{line}");
    heard[0].clone()
}

/// A sentence with this payload, whose checksum is right.
fn sentence(payload: &str) -> String {
    with_checksum(&format!("AIVDM,1,1,,A,{payload},0")).trim_end().replace('$', "!")
}

fn fix(lat: f64, lon: f64, motion: [Option<f64>; 3], status: VesselStatus) -> VesselFix {
    let [course, speed, heading] = motion;
    let position = on_earth(lat, lon).expect("is on Earth");
    VesselFix { age_s: 0.0, position, course, speed, heading, status }
}

fn assert_fix(found: Option<VesselFix>, expected: VesselFix) {
    let found = found.expect("has a position");
    let numbers = |fix: &VesselFix| {
        let numbers = [fix.course, fix.speed, fix.heading].map(|known| known.unwrap_or(-1.0));
        [numbers[0], numbers[1], numbers[2], fix.position.lat_deg, fix.position.lon_deg]
    };
    // pyais rounds positions to six digits.
    for (found, expected) in numbers(&found).into_iter().zip(numbers(&expected)) {
        assert!((found - expected).abs() < 5.1e-7, "{found} is not {expected}");
    }
    assert_eq!(found.status, expected.status);
}

#[test]
fn published_ais_messages_have_their_documented_content() {
    let degrees = |degrees: f64| Some(degrees.to_radians());
    let moored = message(CLASS_A);
    assert_eq!((moored.mmsi, moored.is_own, &moored.name), (477_553_000, false, &None));
    let motion = [degrees(51.0), Some(0.0), degrees(181.0)];
    assert_fix(moored.fix, fix(47.582_833, -122.345_833, motion, VesselStatus::Moored));

    let small = message(CLASS_B);
    let motion = [Some(0.0), Some(0.0), None];
    assert_eq!(small.mmsi, 367_430_530);
    assert_fix(small.fix, fix(37.785_035, -122.267_32, motion, VesselStatus::UnderWay));

    let extended = message(EXTENDED);
    assert_eq!((extended.mmsi, extended.name.as_deref()), (367_059_850, Some("CAPT.J.RIMES")));
    assert_eq!(extended.dimensions, Some([5.0, 21.0, 4.0, 4.0]));
    let motion = [degrees(335.9), Some(8.7 * 1852.0 / 3600.0), None];
    assert_fix(extended.fix, fix(29.543_695, -88.810_392, motion, VesselStatus::UnderWay));

    let named = message(NAMED);
    assert_eq!((named.mmsi, named.name.as_deref(), named.dimensions), (271_041_815, Some("PROGUY"), None));
    let measured = message(MEASURED);
    assert_eq!((measured.mmsi, measured.dimensions), (271_041_815, Some([0.0, 15.0, 0.0, 5.0])));

    let (voyage, rejected) = heard(&VOYAGE);
    assert_eq!((voyage.len(), &*rejected), (1, ""));
    assert_eq!((voyage[0].mmsi, voyage[0].name.as_deref()), (351_759_000, Some("EVER DIADEM")));
    assert_eq!((voyage[0].dimensions, voyage[0].fix), (Some([225.0, 70.0, 1.0, 31.0]), None));
}

#[test]
fn any_talker_and_a_tag_block_change_nothing_and_vdo_is_the_own_ship() {
    for address in ["BSVDM", "ABVDM", "AIVDO"] {
        let payload = CLASS_A[1..].replace("AIVDM", address);
        let payload = payload.split('*').next().expect("has a checksum");
        let line = with_checksum(payload).replace('$', "\\s:2573105,c:1696241893*00\\!");
        let own = VesselMessage { is_own: address == "AIVDO", ..message(CLASS_A) };
        assert_eq!(message(line.trim_end()), own, "{line}");
    }
}

#[test]
fn parts_of_several_messages_may_mix_and_a_lost_part_joins_no_other_message() {
    let other = VOYAGE.map(|part| {
        let part = part[1..].split('*').next().expect("has a checksum").replacen(",1,A", ",2,B", 1);
        with_checksum(&part).trim_end().replace('$', "!")
    });
    let (mixed, rejected) = heard(&[VOYAGE[0], &other[0], CLASS_A, VOYAGE[1], &other[1]]);
    assert_eq!((mixed.len(), &*rejected), (3, ""));
    assert_eq!(mixed[1], mixed[2]);
    for lost in [&VOYAGE[1..], &[VOYAGE[1], VOYAGE[0]][..], &[VOYAGE[0], VOYAGE[1], VOYAGE[1]]] {
        let (_, rejected) = heard(lost);
        assert_eq!(rejected, "part of an AIS message: 1", "{lost:?}");
    }
    let mut late = NmeaReader::default();
    late.push(format!("{}\r\n", VOYAGE[0]).as_bytes(), RECEIVED_S);
    assert_eq!(late.push(format!("{}\r\n", VOYAGE[1]).as_bytes(), RECEIVED_S + 6.0), []);
}

#[test]
fn unknown_values_are_left_out_and_stations_are_no_vessels() {
    // 102.3 kn, 181°, 91°, 360°, 511°: the defaults of a transponder without a receiver.
    let mut buffer = [0; 128];
    let silent = aivdm::decode_payload(b"177KQJ5000G?tO`K>RA1wUbN0TKH", 0).expect("is published");
    let aivdm::AisMessage::PositionReportClassA(mut silent) = silent else { panic!("{silent:?}") };
    let mut payload = |message: aivdm::message::PositionReportClassA| {
        let message = aivdm::AisMessage::PositionReportClassA(message);
        let (payload, _) = aivdm::encode_payload(&message, &mut buffer).expect("fits");
        String::from_utf8(payload.to_vec()).expect("is text")
    };
    silent.sog = aivdm::Sog::from_raw(1023);
    silent.cog = aivdm::Cog::from_raw(3600);
    silent.heading = aivdm::Heading::from_raw(511);
    let known = message(&sentence(&payload(silent))).fix.expect("has a position");
    assert_eq!((known.speed, known.course, known.heading), (None, None, None));
    silent.latitude = aivdm::Latitude::from_raw(91 * 600_000);
    silent.longitude = aivdm::Longitude::from_raw(181 * 600_000);
    assert_eq!(message(&sentence(&payload(silent))).fix, None);
    // A base station (type 4) and an aid to navigation (type 21), from the same page.
    for payload in ["403OviQuMGCqWrRO9>E6fE700@GO", "E>kb9O9aS@7PUh10dh19@;0Tah2cWrfP:l?M`00003vP100"] {
        assert_eq!(heard(&[&sentence(payload)]), (vec![], "unused sentence: 1".to_owned()));
    }
}

/// Messages whose bits or length were changed, with right checksums, alone and in parts.
fn any_message() -> impl Strategy<Value = String> {
    let published = [CLASS_A, CLASS_B, EXTENDED, NAMED, MEASURED, VOYAGE[0], VOYAGE[1]];
    let changed = (prop::sample::select(published.to_vec()), 0..80_usize, "[0-W`-w]{1,3}", 0..80_usize);
    let changed = changed.prop_map(|(line, at, with, length)| {
        let mut payload = line.split(',').nth(5).expect("has a payload").to_owned();
        let at = at.min(payload.len());
        payload.replace_range(at..(at + with.len()).min(payload.len()), &with);
        payload.truncate(length.max(1));
        payload
    });
    let payload = prop_oneof![3 => changed, 1 => "[0-W`-w]{0,90}", 1 => "[ -~&&[^*$!]]{0,20}"];
    (payload, 0..4_u8, 0..4_u8, prop_oneof![Just(String::new()), "[0-9]{1,3}"], 0..7_u8).prop_map(
        |(payload, count, number, sequence, fill)| {
            let line = with_checksum(&format!("AIVDM,{count},{number},{sequence},A,{payload},{fill}"));
            line.replace('$', "!")
        },
    )
}

fn is_sound(measurement: &Measurement) -> bool {
    let Measurement::Vessel(VesselMessage { fix, name, dimensions, .. }) = measurement else {
        return false;
    };
    let direction = |known: Option<f64>| known.is_none_or(|at| (0.0..std::f64::consts::TAU).contains(&at));
    name.as_ref().is_none_or(|name| (1..=20).contains(&name.len()))
        && dimensions.is_none_or(|[bow, stern, ..]| (1.0..=1022.0).contains(&(bow + stern)))
        && fix.is_none_or(|fix| {
            direction(fix.course) && direction(fix.heading) && fix.speed.is_none_or(|speed| speed < 52.6)
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn damaged_ais_messages_are_read_without_a_panic_and_within_their_ranges(
        wire in prop::collection::vec(any_message(), 1..8),
    ) {
        let mut reader = NmeaReader::default();
        let read = reader.push(wire.concat().as_bytes(), RECEIVED_S);
        prop_assert!(read.iter().all(is_sound), "{read:?}");
    }
}
