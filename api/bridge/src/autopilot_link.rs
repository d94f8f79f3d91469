//! The wire to the autopilot: references out, measurements and its state in.

use std::collections::BTreeMap;

use ::mavlink::dialects::ardupilotmega::MavSeverity;
use clock::Clock;
use planner::craft::HeadingReference;

use crate::imc::{ImcLink, ImcSettings};
use crate::mavlink::{
    Autopilot, AutopilotEvent, Control, HEARTBEAT_AGE_MAX_S, Heartbeat, MavlinkReader, MavlinkWriter,
    Parameters,
};
use crate::mission_link::LinkStatus;
use crate::moos::{MoosClient, NO_PLAN};
use crate::nmea::{NmeaReader, heading_and_speed_sentences};
use crate::reference::Reference;
use crate::wire::{Endpoint, Output, Received};
use crate::{Measurement, Origin, Rejects};

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
    /// A MOOSDB, with the IvP helm.
    Moos {
        /// Its wire.
        connect: Endpoint,
        /// Names of the AUVs.
        auvs: Vec<String>,
        /// The place of x = y = 0, if it is known.
        datum: Option<Origin>,
        /// `true` to write `DESIRED_HEADING` and `DESIRED_SPEED` in place of the helm.
        is_raw: bool,
    },
    /// An autopilot that speaks NMEA 0183.
    Nmea {
        /// Its wire, both ways.
        connect: Endpoint,
    },
    /// A craft that runs DUNE.
    Imc(ImcSettings),
}

pub(crate) struct AutopilotLink {
    heard: Heard,
    stack: Stack,
}

/// The protocol on the wire.
enum Stack {
    Mavlink {
        send: Output,
        reader: MavlinkReader,
        writer: MavlinkWriter,
    },
    Moos {
        send: Output,
        client: MoosClient,
        /// The state that was shown last; time, s, and number of the plans that were shown.
        shown: (String, f64, usize),
    },
    Nmea {
        send: Output,
        reader: NmeaReader,
    },
    Imc(Box<ImcLink>),
}

/// The heartbeats of an autopilot.
#[derive(Debug, Default)]
pub(crate) struct Heard {
    /// The newest one and the time of its arrival, s.
    newest: Option<(Heartbeat, f64)>,
    /// The newest one that withdrew the permission to steer, and the time of its arrival, s.
    refused: Option<(Heartbeat, f64)>,
}

impl Heard {
    fn take(&mut self, newest: Heartbeat, t_s: f64) {
        let was_ours = self.newest.is_some_and(|(before, _)| before.may_be_steered());
        if was_ours && !newest.may_be_steered() {
            self.refused = Some((newest, t_s));
        }
        self.newest = Some((newest, t_s));
    }

    /// If heartbeats contradict each other, as from two senders with one number, those that forbid
    /// references count.
    fn control(&self, now: f64) -> Control {
        let refused = self.refused.filter(|(_, at)| now - at <= HEARTBEAT_AGE_MAX_S);
        Control::Reported(self.newest.map(|(newest, at)| {
            let counts = refused.map_or(newest, |(refused, _)| refused);
            (counts, now - at)
        }))
    }
}

/// Time between two showings of one state, s.
const SHOW_INTERVAL_S: f64 = 1.0;
/// System number of most autopilots, used until the first heartbeat.
const SYSTEM: u8 = 1;

impl AutopilotLink {
    pub(crate) fn open(
        settings: AutopilotSettings,
        clock: &Clock,
        open: impl FnOnce(&Endpoint) -> Output,
    ) -> Self {
        let stack = match settings {
            AutopilotSettings::Mavlink { connect, system, auvs } => Stack::Mavlink {
                send: open(&connect),
                reader: MavlinkReader::new(system, auvs),
                writer: MavlinkWriter::new(system.unwrap_or(SYSTEM)),
            },
            AutopilotSettings::Moos { connect, auvs, datum, is_raw } => Stack::Moos {
                send: open(&connect),
                client: MoosClient::new(&auvs, datum, is_raw),
                shown: (String::new(), f64::NEG_INFINITY, 0),
            },
            AutopilotSettings::Imc(settings) => {
                let send = open(&settings.connect);
                Stack::Imc(Box::new(ImcLink::new(send, settings, clock.clone())))
            }
            AutopilotSettings::Nmea { connect } => {
                Stack::Nmea { send: open(&connect), reader: NmeaReader::default() }
            }
        };
        Self { heard: Heard::default(), stack }
    }

    /// The events in `piece`, which arrived at `t_s` of the bridge's clock and `unix_s`, s.
    pub(crate) fn push(&mut self, piece: &Received, t_s: f64, unix_s: f64) -> Vec<AutopilotEvent> {
        let events = match &mut self.stack {
            Stack::Mavlink { reader, .. } => reader.push(&piece.bytes, unix_s),
            Stack::Moos { send, client, .. } if piece.bytes.is_empty() => {
                send(&client.connect(t_s, unix_s));
                vec![]
            }
            Stack::Moos { send, client, .. } => {
                let events = client.push(&piece.bytes, t_s, unix_s);
                if let Some(sign) = client.sign_of_life(t_s) {
                    send(&sign);
                }
                events
            }
            Stack::Imc(link) => link.push(piece, t_s, unix_s),
            Stack::Nmea { reader, .. } => {
                let measurements = read_nmea(reader, piece, unix_s);
                measurements.into_iter().map(AutopilotEvent::Measured).collect()
            }
        };
        for event in &events {
            let AutopilotEvent::Heartbeat(newest) = event else { continue };
            if let (Stack::Mavlink { reader, writer, .. }, None) = (&mut self.stack, self.heard.newest)
                && let Some(system) = reader.craft
            {
                tracing::info!(system, "autopilot found");
                *writer = MavlinkWriter::new(system);
            }
            self.heard.take(*newest, t_s);
        }
        events
    }

    /// The control of the craft at `now` of the bridge's clock, s.
    pub(crate) fn control(&self, now: f64) -> Control {
        match self.stack {
            Stack::Nmea { .. } => Control::Unreported,
            _ => self.heard.control(now),
        }
    }

    /// The place of the wire's own metres, if it has such.
    pub(crate) fn datum(&self) -> Option<Origin> {
        if let Stack::Moos { client, .. } = &self.stack { client.datum } else { None }
    }

    /// The direction that the autopilot's heading loop holds, if the wire tells.
    pub(crate) fn heading_held(&self) -> Option<HeadingReference> {
        match &self.stack {
            Stack::Mavlink { .. } => Some(HeadingReference::Heading),
            Stack::Moos { .. } | Stack::Nmea { .. } => None,
            // By default DUNE's path control steers the course towards a place.
            Stack::Imc(link) if link.settings.headings => Some(HeadingReference::Heading),
            Stack::Imc(_) => Some(HeadingReference::Course),
        }
    }

    /// The link to a craft that runs DUNE.
    pub(crate) fn dune(&self) -> Option<&ImcLink> {
        match &self.stack {
            Stack::Imc(link) => Some(link),
            _ => None,
        }
    }

    pub(crate) fn rejects(&self) -> &Rejects {
        match &self.stack {
            Stack::Mavlink { reader, .. } => &reader.rejects,
            Stack::Moos { client, .. } => client.rejects(),
            Stack::Nmea { reader, .. } => reader.rejects(),
            Stack::Imc(link) => &link.reader.packets.rejects,
        }
    }

    pub(crate) fn send(&mut self, reference: &Reference, now: f64) {
        match &mut self.stack {
            Stack::Nmea { send, .. } => send(heading_and_speed_sentences(reference).as_bytes()),
            Stack::Moos { send, client, .. } => send(&client.reference(reference, now)),
            Stack::Imc(link) => link.reference(reference, now),
            Stack::Mavlink { .. } => self.send_frames(|writer, heartbeat| {
                writer.reference(heartbeat.autopilot, reference, boot_ms(now))
            }),
        }
    }

    /// Sends the bridge's heartbeat, even before the autopilot's: some wires wait for it. Opens a
    /// wire again that was lost unnoticed.
    pub(crate) fn send_heartbeat(&mut self, now: f64) {
        match &mut self.stack {
            Stack::Mavlink { send, writer, .. } => send(&writer.heartbeat()),
            Stack::Moos { send, client, .. } => {
                if client.gives_up(now) {
                    send(&[]);
                }
            }
            Stack::Imc(link) => link.heartbeat(),
            Stack::Nmea { .. } => {}
        }
    }

    /// Orders the mode in which the autopilot follows references.
    pub(crate) fn order_guided(&mut self, autopilot: Autopilot) {
        match &mut self.stack {
            Stack::Imc(link) => link.start(),
            _ => self.send_frames(|writer, _| writer.set_guided(autopilot)),
        }
    }

    /// Ends the steering at once, where the wire has a word for it, for a craft with this
    /// `heading`, rad.
    pub(crate) fn release(&mut self, heading: f64) {
        if let Stack::Imc(link) = &mut self.stack {
            link.release(heading);
        }
    }

    /// Stops the craft when the bridge falls silent, if it may still be steered by what was heard
    /// last and has no watchdog.
    pub(crate) fn fall_silent(&mut self, now: f64) {
        let Control::Reported(Some((newest, _))) = self.control(now) else { return };
        if !newest.may_be_steered() {
            return;
        }
        match &mut self.stack {
            Stack::Imc(link) if link.settings.headings => link.release(0.0),
            Stack::Moos { send, client, .. } => {
                if let Some(stop) = client.stop(now) {
                    send(&stop);
                }
            }
            _ => {}
        }
    }

    /// Tells ground stations `text`.
    pub(crate) fn text(&mut self, severity: MavSeverity, text: &str) {
        match &mut self.stack {
            Stack::Imc(link) => link.log(severity, text),
            _ => self.send_frames(|writer, _| writer.text(severity, text)),
        }
    }

    /// Writes a line of the state into the log book of the network, if it has one.
    pub(crate) fn log(&mut self, line: &str) {
        if let Stack::Imc(link) = &mut self.stack {
            link.log(MavSeverity::MAV_SEVERITY_INFO, line);
        }
    }

    /// Shows the state of the steering and the plan at `now`, s, where the wire has a display.
    pub(crate) fn show(&mut self, now: f64, state: &str, link: &LinkStatus) {
        let Stack::Moos { send, client, shown } = &mut self.stack else { return };
        let (told, shown_s, count) = shown;
        let is_due = SHOW_INTERVAL_S <= now - *shown_s;
        if !is_due && told == state {
            return;
        }
        let mut texts = vec![("PILOTFISH_STATE", state.to_owned())];
        if is_due {
            texts.extend(client.views(*count, link));
            (*shown_s, *count) = (now, *count + 1);
        }
        if link.plan.is_none() {
            texts.push(("VIEW_SEGLIST", NO_PLAN.to_owned()));
        }
        state.clone_into(told);
        send(&client.texts(now, &texts));
    }

    /// Requests the messages that the bridge needs, and the parameters that are missing.
    pub(crate) fn request(&mut self, known: &Parameters) {
        if let Stack::Imc(link) = &mut self.stack {
            link.ask();
        }
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
        if let (Stack::Mavlink { send, writer, .. }, Some((heartbeat, _))) =
            (&mut self.stack, self.heard.newest)
        {
            send(&frames(writer, heartbeat));
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
