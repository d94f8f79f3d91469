//! Packets and messages on the wire of a MOOSDB, little endian.
//!
//! ```text
//! greeting  32 bytes, padded with zeros, once from the client
//! packet    i32 bytes in all, i32 messages, u8 compression, messages
//! message   i32 bytes in all, i32 number, u8 kind, u8 type of data, four texts, f64 time,
//!           f64 value, f64 second value, text
//! text      i32 bytes, bytes
//! ```
//!
//! The four texts are the source, its auxiliary, the community and the key.

use crate::{Parsed, Rejects, reject_if};

/// The protocol of all versions since 2010.
const GREETING: &[u8] = b"ELKS CAN'T DANCE 2/8/10";
const GREETING_BYTES: usize = 32;
/// Length and number of messages, and the compression.
const PACKET_HEAD: usize = 9;
/// Longest packet, bytes: the variables that a bridge registers are a few kB.
pub(super) const PACKET_MAX: usize = 1 << 20;

/// Kinds of messages: a new value of the variable `key`; the wish for one; data of the protocol,
/// such as the client's name; the database's welcome, and its refusal for the reason in `text`; a
/// sign of life.
pub(super) const NOTIFY: u8 = b'N';
pub(super) const REGISTER: u8 = b'R';
pub(super) const DATA: u8 = b'i';
pub(super) const WELCOME: u8 = b'W';
pub(super) const POISON: u8 = b'K';
pub(super) const TIMING: u8 = b'T';

/// A message. The wire has more members, which a client of variables does not need.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Message {
    pub(crate) kind: u8,
    /// The client that wrote it.
    pub(crate) source: String,
    /// The vehicle of the database.
    pub(crate) community: String,
    pub(crate) key: String,
    /// Time of writing, s of Unix time.
    pub(crate) t_s: f64,
    pub(crate) number: f64,
    /// Its text, if it has text instead of a number.
    pub(crate) text: Option<String>,
}

pub(crate) fn greeting() -> [u8; GREETING_BYTES] {
    let mut greeting = [0; GREETING_BYTES];
    greeting[..GREETING.len()].copy_from_slice(GREETING);
    greeting
}

/// What begins a connection of the client `name` at `t_s`, s of Unix time: the greeting, the name,
/// and the `variables` that it wants.
pub(crate) fn connection(name: &str, variables: &[&str], t_s: f64) -> Vec<u8> {
    let message = |kind, key: &str| Message {
        kind,
        source: name.to_owned(),
        key: key.to_owned(),
        t_s,
        ..Message::default()
    };
    let hello = Message { text: Some(name.to_owned()), ..message(DATA, "asynchronous") };
    let registers: Vec<_> = variables.iter().map(|key| message(REGISTER, key)).collect();
    [&greeting()[..], &packet(&[hello]), &packet(&registers)].concat()
}

pub(crate) fn packet(messages: &[Message]) -> Vec<u8> {
    let mut bytes = vec![0; PACKET_HEAD];
    for message in messages {
        let start = bytes.len();
        let data = if message.text.is_some() { b'S' } else { b'D' };
        bytes.extend([0; 4]);
        // The number of a message is of no use here.
        bytes.extend(0_i32.to_le_bytes());
        bytes.extend([message.kind, data]);
        for text in [&*message.source, "", &message.community, &message.key] {
            put_text(&mut bytes, text);
        }
        bytes.extend([message.t_s, message.number, 0.0].iter().flat_map(|value| value.to_le_bytes()));
        put_text(&mut bytes, message.text.as_deref().unwrap_or_default());
        put_length(&mut bytes, start);
    }
    put_length(&mut bytes, 0);
    bytes[4..8].copy_from_slice(&length(messages.len()));
    bytes
}

fn put_text(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend(length(text.len()));
    bytes.extend(text.as_bytes());
}

/// Writes at `start` how many bytes there are from there on.
fn put_length(bytes: &mut [u8], start: usize) {
    let whole = length(bytes.len() - start);
    bytes[start..start + 4].copy_from_slice(&whole);
}

fn length(bytes: usize) -> [u8; 4] {
    i32::try_from(bytes).expect("the bridge writes a few kB").to_le_bytes()
}

/// Reads packets in pieces of any size. Memory is bounded by `PACKET_MAX`.
#[derive(Debug, Default)]
pub(crate) struct PacketReader {
    bytes: Vec<u8>,
    /// `true` after bytes that are no packet: what follows on this connection has no meaning.
    pub(crate) is_lost: bool,
    pub(crate) rejects: Rejects,
}

impl PacketReader {
    /// Forgets an earlier connection.
    pub(crate) fn restart(&mut self) {
        self.bytes.clear();
        self.is_lost = false;
    }

    /// The messages that `bytes` complete.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Vec<Message> {
        let mut messages = vec![];
        let mut done = 0;
        self.bytes.extend(bytes);
        while let (false, Some(head)) = (self.is_lost, self.bytes[done..].first_chunk()) {
            match length_of(*head).filter(|whole| (PACKET_HEAD..=PACKET_MAX).contains(whole)) {
                None => {
                    self.rejects.count("no packet");
                    self.is_lost = true;
                }
                Some(whole) if self.bytes.len() < done + whole => break,
                Some(whole) => {
                    let packet = &self.bytes[done..done + whole];
                    if let Err(reason) = read_packet(packet, &mut messages, &mut self.rejects) {
                        self.rejects.count(reason);
                    }
                    done += whole;
                }
            }
        }
        self.bytes.drain(..if self.is_lost { self.bytes.len() } else { done });
        messages
    }
}

/// A length, unless it is negative.
fn length_of(bytes: [u8; 4]) -> Option<usize> {
    i32::from_le_bytes(bytes).try_into().ok()
}

/// Adds the messages of `packet`; counts those that cannot be read.
fn read_packet(packet: &[u8], messages: &mut Vec<Message>, rejects: &mut Rejects) -> Parsed<()> {
    let mut rest = Bytes(packet);
    let [_, count] = [rest.int()?, rest.int()?];
    reject_if(rest.byte()? != 0, "compressed packet")?;
    for _ in 0..count {
        let whole = rest.0.first_chunk().and_then(|head| length_of(*head)).filter(|whole| 0 < *whole);
        let message = whole.and_then(|whole| rest.0.split_at_checked(whole));
        let (message, after) = message.ok_or("message")?;
        match read_message(Bytes(message)) {
            Ok(message) => messages.push(message),
            Err(reason) => rejects.count(reason),
        }
        rest = Bytes(after);
    }
    Ok(())
}

fn read_message(mut bytes: Bytes) -> Parsed<Message> {
    let [_, _] = [bytes.int()?, bytes.int()?];
    let [kind, data] = [bytes.byte()?, bytes.byte()?];
    let [source, _, community, key] = [bytes.text()?, bytes.text()?, bytes.text()?, bytes.text()?];
    let [t_s, number, _] = [bytes.double()?, bytes.double()?, bytes.double()?];
    let text = bytes.text()?;
    reject_if(!t_s.is_finite() || !number.is_finite(), "number")?;
    let text = (data != b'D').then_some(text);
    Ok(Message { kind, source, community, key, t_s, number, text })
}

/// What is left to read.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk().ok_or("message")?;
        self.0 = rest;
        Ok(*taken)
    }

    fn byte(&mut self) -> Parsed<u8> {
        self.take().map(|[byte]| byte)
    }

    fn int(&mut self) -> Parsed<i32> {
        self.take().map(i32::from_le_bytes)
    }

    fn double(&mut self) -> Parsed<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn text(&mut self) -> Parsed<String> {
        let bytes = length_of(self.take()?).and_then(|bytes| self.0.split_at_checked(bytes));
        let (text, rest) = bytes.ok_or("message")?;
        self.0 = rest;
        Ok(String::from_utf8_lossy(text).into_owned())
    }
}
