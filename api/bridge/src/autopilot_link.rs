//! The wire to the autopilot: references out, measurements and its state in.

use std::collections::BTreeMap;

use crate::mavlink::{
    Autopilot, AutopilotEvent, Control, HEARTBEAT_AGE_MAX_S, Heartbeat, MavlinkReader, MavlinkWriter,
    Parameters,
};
use crate::nmea::{NmeaReader, heading_and_speed_sentences};
use crate::reference::Reference;
use crate::wire::{Endpoint, Output, Received};
use crate::{Measurement, Rejects};

/// The autopilot, which follows references.
#[derive(Debug)]
pub enum AutopilotSettings {
    /// An autopilot that speaks MAVLink.
    Mavlink {
        /// Its wire.
        connect: Endpoint,
        /// Its system number, if the wire carries several autopilots.
        system: Option<u8>,
        /// AUVs that speak MAVLink too, by system number.
        auvs: BTreeMap<u8, String>,
    },
    /// An autopilot that speaks NMEA 0183.
    Nmea {
        /// Its wire, both ways.
        connect: Endpoint,
    },
}

pub(crate) enum AutopilotLink {
    Mavlink {
        send: Output,
        reader: MavlinkReader,
        writer: MavlinkWriter,
        /// The newest heartbeat and the time of its arrival.
        heartbeat: Option<(Heartbeat, f64)>,
        /// The newest heartbeat that withdrew the permission to steer, and the time of its arrival.
        refused: Option<(Heartbeat, f64)>,
    },
    Nmea {
        send: Output,
        reader: NmeaReader,
    },
}

/// System number of most autopilots, used until the first heartbeat.
const SYSTEM: u8 = 1;

impl AutopilotLink {
    pub(crate) fn open(settings: AutopilotSettings, open: impl FnOnce(&Endpoint) -> Output) -> Self {
        match settings {
            AutopilotSettings::Mavlink { connect, system, auvs } => Self::Mavlink {
                send: open(&connect),
                reader: MavlinkReader::new(system, auvs),
                writer: MavlinkWriter::new(system.unwrap_or(SYSTEM)),
                heartbeat: None,
                refused: None,
            },
            AutopilotSettings::Nmea { connect } => {
                Self::Nmea { send: open(&connect), reader: NmeaReader::default() }
            }
        }
    }

    /// The events in `piece`, which arrived at `t_s` of the bridge's clock and `unix_s`, s.
    pub(crate) fn push(&mut self, piece: &Received, t_s: f64, unix_s: f64) -> Vec<AutopilotEvent> {
        match self {
            Self::Mavlink { reader, writer, heartbeat, refused, .. } => {
                let events = reader.push(&piece.bytes, unix_s);
                for event in &events {
                    if let (AutopilotEvent::Heartbeat(newest), Some(system)) = (event, reader.craft) {
                        if heartbeat.is_none() {
                            tracing::info!(system, "autopilot found");
                            *writer = MavlinkWriter::new(system);
                        }
                        let was_ours = heartbeat.is_some_and(|(before, _)| before.may_be_steered());
                        if was_ours && !newest.may_be_steered() {
                            *refused = Some((*newest, t_s));
                        }
                        *heartbeat = Some((*newest, t_s));
                    }
                }
                events
            }
            Self::Nmea { reader, .. } => {
                let measurements = read_nmea(reader, piece, unix_s);
                measurements.into_iter().map(AutopilotEvent::Measured).collect()
            }
        }
    }

    /// The control of the craft at `now` of the bridge's clock, s. If heartbeats contradict each
    /// other, as from two senders with one number, those that forbid references count.
    pub(crate) fn control(&self, now: f64) -> Control {
        match self {
            Self::Mavlink { heartbeat, refused, .. } => {
                let refused = refused.filter(|(_, at)| now - at <= HEARTBEAT_AGE_MAX_S);
                Control::Reported(heartbeat.map(|(newest, at)| {
                    let counts = refused.map_or(newest, |(refused, _)| refused);
                    (counts, now - at)
                }))
            }
            Self::Nmea { .. } => Control::Unreported,
        }
    }

    pub(crate) fn rejects(&self) -> &Rejects {
        match self {
            Self::Mavlink { reader, .. } => &reader.rejects,
            Self::Nmea { reader, .. } => reader.rejects(),
        }
    }

    pub(crate) fn send(&mut self, reference: &Reference, now: f64) {
        match self {
            Self::Nmea { send, .. } => send(heading_and_speed_sentences(reference).as_bytes()),
            Self::Mavlink { .. } => self.send_frames(|writer, heartbeat| {
                writer.reference(heartbeat.autopilot, reference, boot_ms(now))
            }),
        }
    }

    /// Sends the bridge's heartbeat, even before the autopilot's: some wires wait for it.
    pub(crate) fn send_heartbeat(&mut self) {
        if let Self::Mavlink { send, writer, .. } = self {
            send(&writer.heartbeat());
        }
    }

    /// Requests the messages that the bridge needs, and the parameters that are missing.
    pub(crate) fn request(&mut self, known: &Parameters) {
        self.send_frames(|writer, heartbeat| {
            let mut frames = writer.streams();
            if heartbeat.autopilot == Autopilot::ArduPilot {
                frames.extend(known.missing().flat_map(|name| writer.read_parameter(name)));
            }
            frames
        });
    }

    /// Sends frames to an autopilot that has been heard. NMEA 0183 has none.
    pub(crate) fn send_frames(&mut self, frames: impl FnOnce(&mut MavlinkWriter, Heartbeat) -> Vec<u8>) {
        if let Self::Mavlink { send, writer, heartbeat: Some((heartbeat, _)), .. } = self {
            send(&frames(writer, *heartbeat));
        }
    }
}

/// The measurements that `piece` completes. A datagram ends a sentence, with or without a line end.
pub(crate) fn read_nmea(reader: &mut NmeaReader, piece: &Received, unix_s: f64) -> Vec<Measurement> {
    let mut measurements = reader.push(&piece.bytes, unix_s);
    if piece.is_datagram {
        measurements.extend(reader.push(b"\r\n", unix_s));
    }
    measurements
}

/// Milliseconds since the start, as the message has it: it wraps after 49 days.
#[expect(clippy::cast_possible_truncation, reason = "it is meant to wrap")]
fn boot_ms(now: f64) -> u32 {
    (now * 1e3) as u64 as u32
}
