//! Messages of IMC 5.4 as bytes, and packets found in any bytes.
//!
//! ```text
//! header   sync 0xFE54, number u16, size u16, time f64, source u16, its entity u8, destination u16,
//!          its entity u8
//! payload  size bytes: the fields in order; a text is its length u16 and bytes, a message within
//!          another its number u16 (0xFFFF: none) and fields
//! footer   CRC-16-IBM of header and payload
//! ```
//! The order of the sync number's bytes is that of all numbers of the packet. Source: IMC 5.4.31,
//! `IMC.xml`.

use serde::{Deserialize, Serialize};

use crate::Rejects;

const SYNC: u16 = 0xFE54;
const HEADER_BYTES: usize = 20;
const FOOTER_BYTES: usize = 2;
/// Largest payload that is looked for, bytes: the messages below have less. A damaged size holds up
/// a stream for as many.
const PAYLOAD_MAX: usize = 2048;
/// Longest text that is written, bytes: five of them fit in a message.
const TEXT_MAX: usize = 8192;
/// Number of a message that is left out of another.
const NO_MESSAGE: u16 = 0xFFFF;

/// Addresses of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Time of its dispatch by the sender's clock, s of Unix time.
    pub time_s: f64,
    /// Number of the sending system.
    pub source: u16,
    /// Entity within it.
    pub source_entity: u8,
    /// Number of the system that it is for; 0xFFFF means all.
    pub destination: u16,
    /// Entity within it; 0xFF means all.
    pub destination_entity: u8,
}

/// All entities of a system.
pub(super) const ALL_ENTITIES: u8 = 0xFF;

impl Header {
    /// From one system as a whole to another.
    pub(super) fn new(time_s: f64, source: u16, destination: u16) -> Self {
        let (source_entity, destination_entity) = (ALL_ENTITIES, ALL_ENTITIES);
        Self { time_s, source, source_entity, destination, destination_entity }
    }
}

/// A whole packet; `None` is a message that is not in the table below.
#[derive(Clone, Debug, PartialEq)]
pub struct Packet {
    /// Its addresses.
    pub header: Header,
    /// Its message.
    pub message: Option<Message>,
}

macro_rules! fields {
    ($name:ident { $($field:ident),* }) => {
        impl Field for $name {
            fn read(_bytes: &mut Unread<'_>) -> Option<Self> {
                Some(Self { $($field: Field::read(_bytes)?),* })
            }

            fn write(&self, _into: &mut Written) {
                $(self.$field.write(_into);)*
            }
        }
    };
}

fields! { Header { time_s, source, source_entity, destination, destination_entity } }

/// Defines the messages, each with its number and fields in their order.
macro_rules! messages {
    ($($name:ident = $number:literal { $($field:ident: $kind:ty),* })*) => {
        $(
            #[doc = concat!("IMC `", stringify!($name), "`, message ", stringify!($number), ".")]
            #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
            #[allow(missing_docs, clippy::allow_attributes, reason = "fields are IMC's, if there are any")]
            pub struct $name { $(pub $field: $kind),* }

            fields! { $name { $($field),* } }

            impl Numbered for $name {
                const NUMBER: u16 = $number;
            }

            impl From<$name> for Message {
                fn from(message: $name) -> Self {
                    Self::$name(message)
                }
            }
        )*

        /// A message that the bridge reads or writes.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[expect(missing_docs, reason = "names are IMC's")]
        pub enum Message { $($name($name)),* }

        impl Message {
            /// The message `number`; `None` if it is another one, or its fields are others.
            fn read(number: u16, bytes: &mut Unread<'_>) -> Option<Self> {
                match number {
                    $($number => Field::read(bytes).map(Self::$name),)*
                    _ => None,
                }
            }

            fn is_known(number: u16) -> bool {
                matches!(number, $($number)|*)
            }

            pub(crate) fn number(&self) -> u16 {
                match self { $(Self::$name(_) => $number),* }
            }

            fn write(&self, into: &mut Written) {
                match self { $(Self::$name(message) => message.write(into)),* }
            }
        }
    };
}

messages! {
    LogBookEntry = 103 { kind: u8, htime: f64, context: String, text: String }
    Heartbeat = 150 {}
    Announce = 151 {
        sys_name: String, sys_type: u8, owner: u16, lat: f64, lon: f64, height: f32, services: String
    }
    LblRange = 200 { id: u8, range: f32 }
    EstimatedState = 350 {
        lat: f64, lon: f64, height: f32, x: f32, y: f32, z: f32, phi: f32, theta: f32, psi: f32, u: f32, v: f32,
        w: f32, vx: f32, vy: f32, vz: f32, p: f32, q: f32, r: f32, depth: f32, alt: f32
    }
    NavigationUncertainty = 354 {
        x: f32, y: f32, z: f32, phi: f32, theta: f32, psi: f32, p: f32, q: f32, r: f32, u: f32, v: f32, w: f32,
        bias_psi: f32, bias_r: f32
    }
    DesiredHeading = 400 { value: f64 }
    DesiredZ = 401 { value: f32, z_units: u8 }
    DesiredSpeed = 402 { value: f64, speed_units: u8 }
    FollowReference = 478 {
        control_src: u16, control_ent: u8, timeout: f32, loiter_radius: f32, altitude_interval: f32
    }
    Reference = 479 {
        flags: u8, speed: Option<DesiredSpeed>, z: Option<DesiredZ>, lat: f64, lon: f64, radius: f32
    }
    FollowRefState = 480 {
        control_src: u16, control_ent: u8, reference: Option<Reference>, state: u8, proximity: u8
    }
    VehicleState = 500 {
        op_mode: u8, error_count: u8, error_ents: String, maneuver_type: u16, maneuver_stime: f64,
        maneuver_eta: u16, control_loops: u32, flags: u8, last_error: String, last_error_time: f64
    }
    PlanControl = 559 {
        kind: u8, op: u8, request_id: u16, plan_id: String, flags: u16, arg: Option<FollowReference>, info: String
    }
    PlanControlState = 560 {
        state: u8, plan_id: String, plan_eta: i32, plan_progress: f32, man_id: String, man_type: u16, man_eta: i32,
        last_outcome: u8
    }
    RemoteSensorInfo = 601 {
        id: String, sensor_class: String, lat: f64, lon: f64, alt: f32, heading: f32, data: String
    }
    UamRxRange = 817 { seq: u16, sys: String, value: f32 }
    UsblPositionExtended = 899 {
        target: String, x: f32, y: f32, z: f32, n: f32, e: f32, d: f32, phi: f32, theta: f32, psi: f32,
        accuracy: f32
    }
    UsblFixExtended = 900 { target: String, lat: f64, lon: f64, z_units: u8, z: f32, accuracy: f32 }
    AisInfo = 912 {
        msg_type: String, sensor_class: String, mmsi: String, callsign: String, name: String, nav_status: u8,
        type_and_cargo: u8, lat: f64, lon: f64, course: f32, speed: f32, dist: f32, a: f32, b: f32, c: f32, d: f32,
        draught: f32
    }
}

/// The order of the bytes of a packet's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// The least significant byte first, as DUNE's computers write.
    Little,
    /// The most significant byte first.
    Big,
}

/// The rest of a packet's bytes.
struct Unread<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
}

/// The bytes of a packet so far.
struct Written {
    bytes: Vec<u8>,
    order: ByteOrder,
}

trait Field: Sized {
    fn read(bytes: &mut Unread<'_>) -> Option<Self>;
    fn write(&self, into: &mut Written);
}

/// A message with its number, which may be in another.
trait Numbered: Field {
    const NUMBER: u16;
}

macro_rules! number {
    ($($kind:ty)*) => {
        $(impl Field for $kind {
            fn read(bytes: &mut Unread<'_>) -> Option<Self> {
                let (first, rest) = bytes.bytes.split_first_chunk()?;
                bytes.bytes = rest;
                Some(match bytes.order {
                    ByteOrder::Little => Self::from_le_bytes(*first),
                    ByteOrder::Big => Self::from_be_bytes(*first),
                })
            }

            fn write(&self, into: &mut Written) {
                match into.order {
                    ByteOrder::Little => into.bytes.extend(self.to_le_bytes()),
                    ByteOrder::Big => into.bytes.extend(self.to_be_bytes()),
                }
            }
        })*
    };
}

number! { u8 u16 u32 i32 f32 f64 }

impl Field for String {
    fn read(bytes: &mut Unread<'_>) -> Option<Self> {
        let length: u16 = Field::read(bytes)?;
        let (text, rest) = bytes.bytes.split_at_checked(length.into())?;
        bytes.bytes = rest;
        Some(Self::from_utf8_lossy(text).into_owned())
    }

    fn write(&self, into: &mut Written) {
        let kept = self.floor_char_boundary(TEXT_MAX);
        u16::try_from(kept).expect("is at most TEXT_MAX").write(into);
        into.bytes.extend(&self.as_bytes()[..kept]);
    }
}

impl<M: Numbered> Field for Option<M> {
    fn read(bytes: &mut Unread<'_>) -> Option<Self> {
        match u16::read(bytes)? {
            NO_MESSAGE => Some(None),
            number if number == M::NUMBER => M::read(bytes).map(Some),
            _ => None,
        }
    }

    fn write(&self, into: &mut Written) {
        self.as_ref().map_or(NO_MESSAGE, |_| M::NUMBER).write(into);
        if let Some(message) = self {
            message.write(into);
        }
    }
}

impl PlanControl {
    /// A reply of DUNE with another message than a manoeuvre, whose length is not known; after it
    /// there is the last field, a text. Two letters are a greater number than the text's length.
    fn with_another_argument(bytes: &mut Unread<'_>) -> Option<Self> {
        let reply = Self {
            kind: Field::read(bytes)?,
            op: Field::read(bytes)?,
            request_id: Field::read(bytes)?,
            plan_id: Field::read(bytes)?,
            flags: Field::read(bytes)?,
            ..Self::default()
        };
        let _number: u16 = Field::read(bytes)?;
        let info = (0..bytes.bytes.len()).rev().find_map(|start| {
            let mut last = Unread { bytes: &bytes.bytes[start..], order: bytes.order };
            let length: u16 = Field::read(&mut last)?;
            (last.bytes.len() == usize::from(length))
                .then(|| String::from_utf8_lossy(last.bytes).into_owned())
        });
        Some(Self { info: info?, ..reply })
    }
}

/// The packet of `message`.
pub fn packet(header: &Header, message: &Message, order: ByteOrder) -> Vec<u8> {
    let mut payload = Written { bytes: vec![], order };
    message.write(&mut payload);
    let mut packet = Written { bytes: vec![], order };
    SYNC.write(&mut packet);
    message.number().write(&mut packet);
    u16::try_from(payload.bytes.len()).expect("texts are short").write(&mut packet);
    header.write(&mut packet);
    packet.bytes.extend(payload.bytes);
    checksum(&packet.bytes).write(&mut packet);
    packet.bytes
}

/// Finds packets in bytes that come in pieces of any size.
#[derive(Debug, Default)]
pub struct PacketReader {
    bytes: Vec<u8>,
    /// Counts of bytes that were no packet, and of packets that were no message of IMC 5.4.
    pub rejects: Rejects,
}

impl PacketReader {
    /// The packets that `bytes` complete. None begins in one datagram and ends in another.
    pub fn push(&mut self, bytes: &[u8], is_datagram: bool) -> Vec<Packet> {
        self.bytes.extend(bytes);
        let (mut packets, mut at, mut strays) = (vec![], 0, 0);
        while at < self.bytes.len() {
            match Found::at_begin_of(&self.bytes[at..], &mut self.rejects) {
                Found::Packet(length, packet) => {
                    at += length;
                    packets.extend(packet);
                }
                Found::Unfinished if !is_datagram => break,
                Found::Unfinished | Found::Stray => (at, strays) = (at + 1, strays + 1),
            }
        }
        self.bytes.drain(..at);
        self.rejects.add("byte of no whole packet", strays);
        packets
    }
}

enum Found {
    /// A packet of so many bytes; `None` if its fields are others than those of its message.
    Packet(usize, Option<Packet>),
    /// The first byte begins no packet.
    Stray,
    /// More bytes may make it one.
    Unfinished,
}

impl Found {
    fn at_begin_of(bytes: &[u8], rejects: &mut Rejects) -> Self {
        let Some((sync, rest)) = bytes.split_first_chunk() else { return Self::Unfinished };
        let order = match u16::from_be_bytes(*sync) {
            SYNC => ByteOrder::Big,
            other if other.swap_bytes() == SYNC => ByteOrder::Little,
            _ => return Self::Stray,
        };
        let mut unread = Unread { bytes: rest, order };
        let read = |unread: &mut _| Some((u16::read(unread)?, u16::read(unread)?, Header::read(unread)?));
        let Some((number, size, header)) = read(&mut unread) else { return Self::Unfinished };
        let size = usize::from(size);
        if size > PAYLOAD_MAX {
            return Self::Stray;
        }
        let Some((mut payload, mut footer)) = unread
            .bytes
            .split_at_checked(size)
            .map(|(payload, footer)| (Unread { bytes: payload, order }, Unread { bytes: footer, order }))
        else {
            return Self::Unfinished;
        };
        let Some(stated) = u16::read(&mut footer) else { return Self::Unfinished };
        if stated != checksum(&bytes[..HEADER_BYTES + size]) {
            rejects.count("checksum does not match");
            return Self::Stray;
        }
        let all = payload.bytes;
        let message = Message::read(number, &mut payload).filter(|_| payload.bytes.is_empty());
        let message = message.or_else(|| {
            let reply = || PlanControl::with_another_argument(&mut Unread { bytes: all, order });
            (number == PlanControl::NUMBER).then(reply)?.map(Message::from)
        });
        let is_other = message.is_none() && Message::is_known(number);
        if is_other {
            rejects.count("message with other fields");
        }
        let packet = (!is_other).then_some(Packet { header, message });
        Self::Packet(HEADER_BYTES + size + FOOTER_BYTES, packet)
    }
}

/// CRC-16-IBM: polynomial 0x8005, reflected, from 0.
pub(crate) fn checksum(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc, byte| (crc >> 8) ^ CRC[usize::from((crc & 0xFF) ^ u16::from(*byte))])
}

/// The checksum's change by each byte.
const CRC: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0_u16;
    while byte < 256 {
        let (mut crc, mut bit) = (byte, 0);
        while bit < 8 {
            crc = (crc >> 1) ^ (if crc & 1 == 1 { 0xA001 } else { 0 });
            bit += 1;
        }
        table[byte as usize] = crc;
        byte += 1;
    }
    table
};

#[cfg(test)]
mod tests;
