//! Packets there and back, in any pieces and between any bytes.

use proptest::prelude::*;

use super::*;

/// As imcpy 1.1.2 writes them, at 1.5 s from system 0x0801: a `Heartbeat` of entity 7 to 0x4F15,
/// and a `Reference` at 0.5, −0.25 rad with a speed of 1.25 m/s and without a depth, to all.
const PUBLISHED: [&str; 2] = [
    "54fe96000000000000000000f83f010807154fffacb1",
    "54fedf012200000000000000f83f0108ffffffff039201000000000000f43f00ffff000000000000e03f000000000000d0bf00000040c286",
];

fn published() -> [(Header, Message); 2] {
    let header = Header {
        time_s: 1.5,
        source: 0x0801,
        source_entity: 7,
        destination: 0x4F15,
        destination_entity: 0xFF,
    };
    let speed = Some(DesiredSpeed { value: 1.25, speed_units: 0 });
    let reference = Reference { flags: 3, speed, z: None, lat: 0.5, lon: -0.25, radius: 2.0 };
    let to_all = Header { source_entity: 0xFF, destination: 0xFFFF, ..header };
    [(header, Heartbeat {}.into()), (to_all, reference.into())]
}

/// All that is found in `pieces` of a stream.
fn found<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> (Vec<Packet>, Rejects) {
    let mut reader = PacketReader::default();
    let packets = pieces.into_iter().flat_map(|piece| reader.push(piece, false)).collect();
    (packets, reader.rejects)
}

#[test]
fn bytes_are_those_of_another_program() {
    // The published check value of CRC-16/ARC.
    assert_eq!(checksum(b"123456789"), 0xBB3D);
    for (bytes, (header, message)) in PUBLISHED.into_iter().zip(published()) {
        assert_eq!(hex::encode(packet(&header, &message, ByteOrder::Little)), bytes);
    }
}

/// DUNE's refusal to load a plan after one that it took, whose statistics it repeats.
const REFUSED: &str = "54fe2f02b20043a69f9d66c3da41f10c1c0140ff02024d0006006e6f626f647900003402090070696c6f746669736800024600546f74616c3d302e302c457865637574696f6e3d2d312e302c43616c6962726174696f6e3d312e302c4d616e657576657220466f6c6c6f775265666572656e63653d2d312e30000000003700546f74616c3d302e30302c486f74656c3d302e30302c5061796c6f61643d302e30302c4d6f74696f6e3d302e30302c494d553d302e30300e00756e646566696e656420706c616e2a52";

#[test]
fn a_reply_with_an_argument_of_another_kind_is_read_but_for_that() {
    let bytes = hex::decode(REFUSED).expect("is recorded");
    let refused = |bytes: &[u8]| match &found([bytes]).0[..] {
        [Packet { message: Some(Message::PlanControl(reply)), .. }] => Some(reply.clone()),
        _ => None,
    };
    let expected = PlanControl {
        kind: 2,
        op: 2,
        request_id: 77,
        plan_id: "nobody".to_owned(),
        info: "undefined plan".to_owned(),
        ..PlanControl::default()
    };
    assert_eq!(refused(&bytes), Some(expected.clone()));
    // Without the last text, its length included, there is none.
    for left_out in [14, 16] {
        let mut cut = bytes[..bytes.len() - FOOTER_BYTES - left_out].to_vec();
        let size = u16::try_from(cut.len() - HEADER_BYTES).expect("is short");
        cut[4..6].copy_from_slice(&size.to_le_bytes());
        let footer = checksum(&cut);
        cut.extend(footer.to_le_bytes());
        assert_ne!(refused(&cut), Some(expected.clone()));
    }
}

#[test]
fn both_orders_of_bytes_are_read_and_other_messages_pass_by() {
    for (header, message) in published() {
        for order in [ByteOrder::Little, ByteOrder::Big] {
            let (packets, rejects) = found([&*packet(&header, &message, order)]);
            assert_eq!(packets, [Packet { header, message: Some(message.clone()) }]);
            assert_eq!(rejects.total(), 0);
        }
    }
    // An `Abort`, message 550, has no fields.
    let [(header, message), _] = published();
    let mut other = packet(&header, &message, ByteOrder::Big);
    other[2..4].copy_from_slice(&550_u16.to_be_bytes());
    let end = other.len() - FOOTER_BYTES;
    let footer = checksum(&other[..end]).to_be_bytes();
    other[end..].copy_from_slice(&footer);
    let (packets, rejects) = found([&*other]);
    assert_eq!((&packets[..], rejects.total()), (&[Packet { header, message: None }][..], 0));
}

#[test]
fn a_message_with_other_fields_and_a_wrong_checksum_are_rejected_by_name() {
    let [_, (header, reference)] = published();
    let mut longer = packet(&header, &reference, ByteOrder::Little);
    let end = longer.len() - FOOTER_BYTES;
    longer.truncate(end);
    longer.push(0);
    longer[4] += 1;
    longer.extend(checksum(&longer).to_le_bytes());
    let mut wrong = packet(&header, &reference, ByteOrder::Little);
    wrong[30] ^= 1;
    let (packets, rejects) = found([&*longer, &wrong, &[0; 60]]);
    let reasons: Vec<_> = rejects.iter().map(|(reason, _)| reason).collect();
    assert_eq!(packets, []);
    assert_eq!(reasons, ["byte of no whole packet", "checksum does not match", "message with other fields"]);
}

#[test]
fn a_datagram_that_ends_early_costs_nothing_of_the_next_one() {
    let [(header, message), _] = published();
    let whole = packet(&header, &message, ByteOrder::Little);
    let mut reader = PacketReader::default();
    assert_eq!(reader.push(&whole[..15], true), []);
    assert_eq!(reader.push(&whole.repeat(2), true).len(), 2);
    assert_eq!(reader.rejects.to_string(), "byte of no whole packet: 15");
}

/// A message with any numbers and texts: `None` in its kinds of fields included.
fn any_message() -> impl Strategy<Value = Message> {
    let (text, number) = ("\\PC{0,40}", -1e6_f64..1e6);
    let single = -1e6_f32..1e6;
    (0..5, text, number, single, any::<u16>(), any::<bool>()).prop_map(
        |(kind, text, value, single, number, has)| {
            let byte = number.to_be_bytes()[0];
            let speed = has.then_some(DesiredSpeed { value, speed_units: byte });
            let z = (!has).then_some(DesiredZ { value: single, z_units: byte });
            let reference = Reference { flags: byte, speed, z, lat: value, lon: -value, radius: single };
            match kind {
                0 => reference.into(),
                1 => FollowRefState {
                    control_src: number,
                    control_ent: byte,
                    reference: has.then_some(reference),
                    state: byte,
                    proximity: 0,
                }
                .into(),
                2 => PlanControl {
                    request_id: number,
                    plan_id: text.clone(),
                    arg: has.then(FollowReference::default),
                    info: text,
                    ..PlanControl::default()
                }
                .into(),
                3 => UsblFixExtended { target: text, lat: value, z: single, ..UsblFixExtended::default() }
                    .into(),
                _ => VehicleState {
                    error_ents: text,
                    maneuver_stime: value,
                    control_loops: number.into(),
                    ..VehicleState::default()
                }
                .into(),
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn splitting_joining_and_junk_between_change_nothing(
        messages in prop::collection::vec((any_message(), any::<bool>(), prop::collection::vec(0..0x54_u8, 0..9)), 1..6),
        cuts in prop::collection::vec(1..60_usize, 1..40),
    ) {
        let [(header, _), _] = published();
        let mut stream = vec![];
        for (message, is_big, junk) in &messages {
            stream.extend(junk);
            let order = if *is_big { ByteOrder::Big } else { ByteOrder::Little };
            stream.extend(packet(&header, message, order));
        }
        let (mut pieces, mut rest) = (vec![], &*stream);
        for cut in cuts.into_iter().cycle() {
            let (piece, left) = rest.split_at(cut.min(rest.len()));
            (rest, pieces) = (left, [pieces, vec![piece]].concat());
            if rest.is_empty() {
                break;
            }
        }
        let (packets, rejects) = found(pieces);
        let junk: usize = messages.iter().map(|(_, _, junk)| junk.len()).sum();
        prop_assert_eq!(rejects.total(), junk as u64);
        let sent = messages.into_iter().map(|(message, ..)| Packet { header, message: Some(message) });
        prop_assert_eq!(packets, sent.collect::<Vec<_>>());
    }

    #[test]
    fn any_bytes_are_read_without_a_panic_and_never_kept_beyond_a_packet(
        pieces in prop::collection::vec(prop::collection::vec(prop_oneof![Just(0xFE), Just(0x54), any::<u8>()], 0..400), 0..9),
        is_datagram in any::<bool>(),
    ) {
        let mut reader = PacketReader::default();
        for piece in pieces {
            reader.push(&piece, is_datagram);
            prop_assert!(reader.bytes.len() <= HEADER_BYTES + PAYLOAD_MAX + FOOTER_BYTES);
            prop_assert!(!is_datagram || reader.bytes.is_empty());
        }
    }

    #[test]
    fn damaged_messages_are_read_without_a_panic(
        message in any_message(),
        changes in prop::collection::vec((20..90_usize, any::<u8>()), 1..6),
    ) {
        let [(header, _), _] = published();
        let mut bytes = packet(&header, &message, ByteOrder::Little);
        let end = bytes.len() - FOOTER_BYTES;
        for (at, byte) in changes {
            bytes[..end].get_mut(at).map(|changed| *changed = byte).unwrap_or_default();
        }
        let footer = checksum(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&footer);
        let (packets, rejects) = found([&*bytes]);
        prop_assert_eq!(packets.len() as u64 + rejects.total(), 1);
    }
}
