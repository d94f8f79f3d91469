//! Packets, beside a decoder of its own that reads every member, and bytes of real programs.

use std::io::Read as _;

use proptest::prelude::*;

use crate::moos::packet::{Message, NOTIFY, PACKET_MAX, PacketReader, greeting, packet};

/// Every member of a message on the wire, in order.
#[derive(Clone, Debug, PartialEq)]
struct Decoded {
    kind: u8,
    data: u8,
    texts: [String; 4],
    numbers: [f64; 3],
    text: String,
}

/// The messages of whole packets; panics at anything else.
fn decoded(mut bytes: &[u8]) -> Vec<Decoded> {
    fn exactly<const N: usize>(from: &mut &[u8]) -> [u8; N] {
        let mut taken = [0; N];
        from.read_exact(&mut taken).expect("the packet has them");
        taken
    }
    fn text(from: &mut &[u8]) -> String {
        let length = u64::from(u32::from_le_bytes(exactly(from)));
        let mut text = vec![];
        assert_eq!(from.take(length).read_to_end(&mut text).expect("is there") as u64, length);
        String::from_utf8(text).expect("is text")
    }
    let mut messages = vec![];
    while !bytes.is_empty() {
        let all = bytes.len();
        let length = u32::from_le_bytes(exactly(&mut bytes)) as usize;
        let count = u32::from_le_bytes(exactly(&mut bytes));
        assert_eq!(exactly(&mut bytes), [0], "is not compressed");
        for _ in 0..count {
            let before = bytes.len();
            let length = u32::from_le_bytes(exactly(&mut bytes)) as usize;
            exactly::<4>(&mut bytes);
            let [kind, data] = exactly(&mut bytes);
            let texts = [(); 4].map(|()| text(&mut bytes));
            let numbers = [(); 3].map(|()| f64::from_le_bytes(exactly(&mut bytes)));
            messages.push(Decoded { kind, data, texts, numbers, text: text(&mut bytes) });
            assert_eq!(before - bytes.len(), length);
        }
        assert_eq!(all - bytes.len(), length);
    }
    messages
}

/// The messages of `bytes` in pieces of this many bytes.
fn read(bytes: &[u8], piece: usize) -> Vec<Message> {
    let mut reader = PacketReader::default();
    let read = bytes.chunks(piece).flat_map(|piece| reader.push(piece)).collect();
    assert_eq!(reader.rejects.total(), 0, "{}", reader.rejects);
    read
}

fn notice(key: &str, number: f64, text: Option<&str>) -> Message {
    Message {
        kind: NOTIFY,
        source: "pPilotfish".to_owned(),
        community: "craft".to_owned(),
        key: key.to_owned(),
        t_s: 1.7e9,
        number,
        text: text.map(str::to_owned),
    }
}

/// The same in our terms; a source's auxiliary, a second value and numbers beside a text are
/// dropped.
fn ours(decoded: &Decoded) -> Message {
    let [source, _, community, key] = decoded.texts.clone();
    let [t_s, number, _] = decoded.numbers;
    let text = (decoded.data != b'D').then(|| decoded.text.clone());
    Message { kind: decoded.kind, source, community, key, t_s, number, text }
}

#[test]
fn a_greeting_has_32_bytes() {
    assert_eq!(greeting(), *b"ELKS CAN'T DANCE 2/8/10\0\0\0\0\0\0\0\0\0");
}

/// A connection of `umm` with a MOOSDB (MOOS of July 2024), with the numbers of messages.
const SESSION: [(&str, usize, &[u8]); 2] = [
    ("from the database", 132, include_bytes!("from_database.bin")),
    ("to the database", 18, include_bytes!("to_database.bin")),
];

#[test]
fn bytes_of_real_programs_are_read_as_by_another_decoder() {
    for (name, count, bytes) in SESSION {
        let packets = bytes.strip_prefix(&greeting()).unwrap_or(bytes);
        let expected: Vec<Message> = decoded(packets).iter().map(ours).collect();
        assert_eq!(expected.len(), count, "{name}");
        for piece in [1, 7, 1000, usize::MAX] {
            assert_eq!(read(packets, piece), expected, "{name}");
        }
    }
}

#[test]
fn what_is_no_packet_ends_the_connection_and_a_damaged_or_strange_packet_is_skipped() {
    let good = packet(&[notice("NAV_X", 1.5, None)]);
    let mut reader = PacketReader::default();
    for length in [8, -1, i32::try_from(PACKET_MAX + 1).expect("is a length")] {
        assert_eq!(reader.push(&i32::to_le_bytes(length)), []);
        assert!(reader.is_lost && reader.push(&good).is_empty());
        reader.restart();
    }
    let mut compressed = good.clone();
    compressed[8] = 1;
    // A text that claims to be longer than its message.
    let mut damaged = packet(&[notice("NAV_X", f64::NAN, None), notice("NAV_Y", 2.0, None)]);
    damaged.extend(packet(&[notice("NAV_X", 1.0, None)]));
    let at = damaged.len() - 4;
    damaged[at] = 200;
    let bytes = [compressed, damaged, good].concat();
    let read = reader.push(&bytes);
    assert_eq!(read, [notice("NAV_Y", 2.0, None), notice("NAV_X", 1.5, None)]);
    let reasons: Vec<_> = reader.rejects.iter().collect();
    assert_eq!(reasons, [("compressed packet", 1), ("message", 1), ("no packet", 3), ("number", 1)]);
}

fn any_message() -> impl Strategy<Value = Message> {
    let text = prop::option::of("\\PC{0,40}");
    (any::<u8>(), "\\PC{0,9}", "\\PC{0,9}", "[A-Z_]{0,20}", -1e12..1e12_f64, -1e12..1e12_f64, text).prop_map(
        |(kind, source, community, key, t_s, number, text)| Message {
            kind,
            source,
            community,
            key,
            t_s,
            number,
            text,
        },
    )
}

proptest! {
    #[test]
    fn messages_come_back_from_either_decoder_in_pieces_of_any_size(
        packets in prop::collection::vec(prop::collection::vec(any_message(), 0..5), 0..5),
        piece in 1..300_usize,
    ) {
        let bytes: Vec<u8> = packets.iter().flat_map(|messages| packet(messages)).collect();
        let sent: Vec<Message> = packets.concat();
        prop_assert_eq!(&read(&bytes, piece), &sent);
        prop_assert_eq!(decoded(&bytes).iter().map(ours).collect::<Vec<_>>(), sent);
    }

    #[test]
    fn any_bytes_in_any_pieces_give_the_same_finite_messages(
        messages in prop::collection::vec(any_message(), 1..5),
        damages in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        tail in prop::collection::vec(any::<u8>(), 0..60),
        piece in 1..80_usize,
    ) {
        let mut bytes = [packet(&messages), tail].concat();
        for (at, byte) in damages {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let in_pieces = |piece| {
            let mut reader = PacketReader::default();
            let read: Vec<_> = bytes.chunks(piece).flat_map(|piece| reader.push(piece)).collect();
            (read, reader.is_lost, reader.rejects)
        };
        let (read, is_lost, rejects) = in_pieces(piece);
        prop_assert!(read.iter().all(|message| message.t_s.is_finite() && message.number.is_finite()));
        prop_assert_eq!(in_pieces(bytes.len()), (read, is_lost, rejects));
    }
}
