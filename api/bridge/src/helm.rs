//! What steers the craft: the wire that takes references, and what it says of the craft.

use std::{collections::BTreeMap, sync::mpsc::SyncSender};

#[cfg(feature = "ros2")]
use crate::ros2::Ros2Wire;
use crate::{
    Measurement, Refused,
    mavlink::{Autopilot, Control, Heard, Heartbeat, MavlinkReader, MavlinkWriter, Parameters},
    nmea::{NmeaReader, heading_and_speed_sentences},
    reference::{PlannedReference, Reference},
    wire::{Endpoint, Received, Wire},
};

/// How the craft takes references.
#[derive(Debug)]
pub enum HelmSettings {
    /// An autopilot that speaks MAVLink.
    Mavlink {
        /// Its wire.
        connect: Endpoint,
        /// Its system number, where several autopilots speak on the wire.
        system: Option<u8>,
        /// AUVs that speak MAVLink too, by the numbers of their systems.
        auvs: BTreeMap<u8, String>,
    },
    /// An autopilot that speaks NMEA 0183.
    Nmea {
        /// Its wire, both ways.
        connect: Endpoint,
    },
    /// A node that follows ROS 2 topics.
    #[cfg(feature = "ros2")]
    Ros2(Box<Ros2Wire>),
}

/// An open helm.
pub(crate) enum Helm {
    Mavlink {
        wire: Wire,
        reader: MavlinkReader,
        /// Once the autopilot is heard.
        writer: Option<MavlinkWriter>,
        heartbeat: Option<(Heartbeat, f64)>,
    },
    Nmea {
        wire: Wire,
        reader: NmeaReader,
    },
    #[cfg(feature = "ros2")]
    Ros2(Box<Ros2Wire>),
}

/// The system of an autopilot that was not heard yet: most have it.
const UNHEARD: u8 = 1;

impl Helm {
    /// Opens it; what comes on its wire is number 0.
    pub(crate) fn open(settings: HelmSettings, received: &SyncSender<Received>) -> Self {
        let open = |connect: Endpoint| Wire::open(connect, 0, received.clone());
        match settings {
            HelmSettings::Mavlink {
                connect,
                system,
                auvs,
            } => Self::Mavlink {
                wire: open(connect),
                reader: MavlinkReader::new(system, auvs),
                writer: None,
                heartbeat: None,
            },
            HelmSettings::Nmea { connect } => Self::Nmea {
                wire: open(connect),
                reader: NmeaReader::default(),
            },
            #[cfg(feature = "ros2")]
            HelmSettings::Ros2(wire) => Self::Ros2(wire),
        }
    }

    /// What `piece` of its wire says, which came at `t_s` of the bridge's clock and `unix_s`, s.
    pub(crate) fn push(&mut self, piece: &Received, t_s: f64, unix_s: f64) -> Vec<Heard> {
        match self {
            Self::Mavlink {
                reader,
                writer,
                heartbeat,
                ..
            } => {
                let heard = reader.push(&piece.bytes, unix_s);
                for heard in &heard {
                    if let Heard::Heartbeat(beat) = heard {
                        *heartbeat = Some((*beat, t_s));
                    }
                }
                if let (None, Some(system)) = (&writer, reader.craft()) {
                    tracing::info!(system, "autopilot heard");
                    *writer = Some(MavlinkWriter::new(system));
                }
                heard
            }
            Self::Nmea { reader, .. } => {
                let mut heard = reader.push(&piece.bytes, unix_s);
                if piece.is_datagram {
                    heard.extend(reader.push(b"\r\n", unix_s));
                }
                measured(heard)
            }
            #[cfg(feature = "ros2")]
            Self::Ros2(_) => vec![],
        }
    }

    /// What came without a wire of the bridge's own, at `unix_s`.
    #[cfg(feature = "ros2")]
    pub(crate) fn poll(&mut self, unix_s: f64) -> Vec<Heard> {
        match self {
            Self::Ros2(wire) => measured(wire.poll(unix_s)),
            Self::Mavlink { .. } | Self::Nmea { .. } => vec![],
        }
    }

    /// Who has the craft, at `now` of the bridge's clock, s.
    pub(crate) fn control(&self, now: f64) -> Control {
        match self {
            Self::Mavlink { heartbeat, .. } => {
                Control::Reported(heartbeat.map(|(beat, at)| (beat, now - at)))
            }
            Self::Nmea { .. } => Control::Unreported,
            #[cfg(feature = "ros2")]
            Self::Ros2(_) => Control::Unreported,
        }
    }

    /// What was not understood.
    pub(crate) fn refused(&self) -> &Refused {
        match self {
            Self::Mavlink { reader, .. } => reader.refused(),
            Self::Nmea { reader, .. } => reader.refused(),
            #[cfg(feature = "ros2")]
            Self::Ros2(wire) => wire.refused(),
        }
    }

    /// Sends `reference`, of `plan`, at `now` of the bridge's clock, which is `ahead` s behind Unix time.
    #[cfg_attr(
        not(feature = "ros2"),
        expect(unused_variables, reason = "only a topic takes the plan and the time")
    )]
    pub(crate) fn send(&mut self, reference: &Reference, plan: &PlannedReference, now: f64, ahead: f64) {
        match self {
            Self::Mavlink {
                wire,
                writer: Some(writer),
                heartbeat: Some((beat, _)),
                ..
            } => {
                wire.send(&writer.reference(beat.autopilot, reference, boot_ms(now)));
            }
            Self::Mavlink { .. } => {}
            Self::Nmea { wire, .. } => wire.send(heading_and_speed_sentences(reference).as_bytes()),
            #[cfg(feature = "ros2")]
            Self::Ros2(wire) => wire.publish(reference, &plan.shifted(ahead), now + ahead),
        }
    }

    /// Orders the mode in which references are taken.
    pub(crate) fn order_guided(&mut self, autopilot: Autopilot) {
        if let Self::Mavlink {
            wire,
            writer: Some(writer),
            ..
        } = self
        {
            wire.send(&writer.set_guided(autopilot));
        }
    }

    /// Orders the motors on.
    pub(crate) fn order_arm(&mut self) {
        if let Self::Mavlink {
            wire,
            writer: Some(writer),
            ..
        } = self
        {
            wire.send(&writer.arm());
        }
    }

    /// Says that the bridge lives: before the autopilot is heard too, for some wires wait to be spoken to.
    pub(crate) fn live(&mut self) {
        if let Self::Mavlink { wire, writer, .. } = self {
            let frame = match writer {
                Some(writer) => writer.heartbeat(),
                None => MavlinkWriter::new(UNHEARD).heartbeat(),
            };
            wire.send(&frame);
        }
    }

    /// Asks for the messages that the bridge lives on, and for the parameters that have not come.
    pub(crate) fn ask(&mut self, known: &Parameters) {
        if let Self::Mavlink {
            wire,
            writer: Some(writer),
            heartbeat: Some((beat, _)),
            ..
        } = self
        {
            let mut frames = writer.streams();
            if beat.autopilot == Autopilot::ArduPilot {
                frames.extend(known.missing().flat_map(|name| writer.read_parameter(name)));
            }
            wire.send(&frames);
        }
    }
}

fn measured(measurements: Vec<Measurement>) -> Vec<Heard> {
    measurements.into_iter().map(Heard::Measured).collect()
}

/// Milliseconds since the start, as the message has it: it begins again after 49 days.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "it is meant to begin again"
)]
fn boot_ms(now: f64) -> u32 {
    (now * 1e3) as u64 as u32
}
