//! The wire to a craft that runs DUNE: references, plans and texts out, events in.

use ::mavlink::dialects::ardupilotmega::MavSeverity;
use clock::Clock;
use planner::angle::direction;

use super::codec::{
    ALL_ENTITIES, Announce, ByteOrder, DesiredHeading, DesiredSpeed, DesiredZ, FollowReference, Header,
    Heartbeat, LogBookEntry, Message, PlanControl, Reference as PlaceAndSpeed, packet,
};
use super::reader::{ImcReader, Z_DEPTH};
use super::{ImcSettings, PLAN};
use crate::Origin;
use crate::mavlink::AutopilotEvent;
use crate::recent_positions::displaced;
use crate::reference::Reference;
use crate::wire::{Endpoint, Output, Received};

/// All systems.
pub(super) const ALL: u16 = 0xFFFF;
/// `SystemType` of a station that commands.
const CCU: u8 = 0;
/// Time without references after which FollowReference ends, s. DUNE looks at it with each of its
/// states, which a receiver at 1 Hz gives once a second: the craft stops within 3 s.
const TIMEOUT_S: f32 = 2.0;
/// Least time between two references, s: DUNE begins a new path, and logs it, at each.
const INTERVAL_S: f64 = 0.45;
/// Time to the place ahead, s, and its least distance, m. DUNE stops within 15 m of a place.
const AHEAD_S: f64 = 20.0;
const AHEAD_MIN_M: f64 = 40.0;
/// A slower reference is a stop, m/s: its place is the craft's own, where DUNE ends its control.
const STOP: f64 = 0.05;
/// Largest difference of depths in which DUNE stops at a place, m: more than waves make.
const DEPTH_INTERVAL_M: f32 = 5.0;
/// Radius at which DUNE would circle a place, m: a surface craft stops instead.
const LOITER_RADIUS_M: f32 = 7.5;
/// `Reference.flags`: place, speed and depth count; the manoeuvre is done.
const PLACE_SPEED_DEPTH: u8 = 0x01 | 0x02 | 0x04;
pub(super) const DONE: u8 = 0x80;
/// `PlanControl`: a request; to start, to load.
pub(super) const REQUEST: u8 = 0;
pub(super) const START: u8 = 0;
pub(super) const LOAD: u8 = 2;
/// `LogBookEntry.type`.
const INFO: u8 = 0;
const WARNING: u8 = 1;
const ERROR: u8 = 2;

pub(crate) struct ImcLink {
    send: Output,
    pub(crate) reader: ImcReader,
    pub(crate) settings: ImcSettings,
    clock: Clock,
    sent_s: f64,
    requests: u16,
}

impl ImcLink {
    pub(crate) fn new(send: Output, settings: ImcSettings, clock: Clock) -> Self {
        let reader = ImcReader::new(settings.clone());
        Self { send, reader, settings, clock, sent_s: f64::NEG_INFINITY, requests: 0 }
    }

    pub(crate) fn push(&mut self, piece: &Received, t_s: f64, unix_s: f64) -> Vec<AutopilotEvent> {
        self.reader.push(&piece.bytes, piece.is_datagram, t_s, unix_s)
    }

    pub(crate) fn reference(&mut self, reference: &Reference, now: f64) {
        if self.settings.headings {
            self.command(DesiredHeading { value: reference.heading });
            self.command(speed_of(reference));
        } else if INTERVAL_S <= now - self.sent_s {
            self.sent_s = now;
            self.place(reference, PLACE_SPEED_DEPTH);
        }
    }

    /// Ends the steering: the craft stops.
    pub(crate) fn release(&mut self, heading: f64) {
        let stop = Reference { speed: 0.0, heading };
        if self.settings.headings {
            self.command(speed_of(&stop));
        } else {
            self.place(&stop, PLACE_SPEED_DEPTH | DONE);
        }
    }

    /// A place in the direction of `reference` from the craft's own, with its speed.
    fn place(&mut self, reference: &Reference, flags: u8) {
        let Some(here) = self.reader.here() else { return };
        let is_stop = reference.speed < STOP;
        let ahead = if is_stop { 0.0 } else { (AHEAD_S * reference.speed).max(AHEAD_MIN_M) };
        // At a speed of exactly 0 DUNE ends its control of the path, which otherwise complains.
        let reference = Reference { speed: if is_stop { 0.0 } else { reference.speed }, ..*reference };
        let place = displaced(&here, &(direction(reference.heading) * ahead));
        self.command(PlaceAndSpeed {
            flags,
            speed: Some(speed_of(&reference)),
            z: Some(DesiredZ { value: 0.0, z_units: Z_DEPTH }),
            lat: place.lat_deg.to_radians(),
            lon: place.lon_deg.to_radians(),
            radius: 0.0,
        });
    }

    /// Announces the bridge, and says that it lives.
    pub(crate) fn heartbeat(&mut self) {
        let services = match &self.settings.connect {
            Endpoint::Imc(address) => format!("imc+udp://{address}/"),
            _ => String::new(),
        };
        let here = self.reader.here().unwrap_or(Origin { lat_deg: 0.0, lon_deg: 0.0 });
        self.to(
            ALL,
            Announce {
                sys_name: format!("{PLAN}-{}", self.settings.vehicle),
                sys_type: CCU,
                owner: ALL,
                lat: here.lat_deg.to_radians(),
                lon: here.lon_deg.to_radians(),
                height: 0.0,
                services,
            },
        );
        self.to(ALL, Heartbeat {});
    }

    /// Starts FollowReference under the bridge's control. Nobody but a person sets EXTERNAL.
    pub(crate) fn start(&mut self) {
        if !self.settings.headings {
            self.plan(START);
        }
    }

    /// Asks once whether DUNE takes a plan of FollowReference, by loading it where nothing is under
    /// way.
    pub(crate) fn ask(&mut self) {
        let is_due = self.settings.asks && !self.settings.headings && self.reader.takes_plan.is_none();
        if is_due && self.reader.is_ready {
            self.plan(LOAD);
        }
    }

    fn plan(&mut self, op: u8) {
        self.requests = self.requests.wrapping_add(1);
        self.command(PlanControl {
            kind: REQUEST,
            op,
            request_id: self.requests,
            plan_id: PLAN.to_owned(),
            flags: 0,
            arg: Some(FollowReference {
                control_src: self.settings.number,
                control_ent: ALL_ENTITIES,
                timeout: TIMEOUT_S,
                loiter_radius: LOITER_RADIUS_M,
                altitude_interval: DEPTH_INTERVAL_M,
            }),
            info: String::new(),
        });
    }

    /// Writes `text` into the log books of all systems.
    pub(crate) fn log(&mut self, severity: MavSeverity, text: &str) {
        let kind = match severity {
            MavSeverity::MAV_SEVERITY_CRITICAL => ERROR,
            MavSeverity::MAV_SEVERITY_WARNING => WARNING,
            _ => INFO,
        };
        let htime = self.clock.unix_s();
        let (context, text) = (PLAN.to_owned(), text.to_owned());
        self.to(ALL, LogBookEntry { kind, htime, context, text });
    }

    fn command(&mut self, message: impl Into<Message>) {
        if let Some(craft) = self.reader.craft() {
            self.to(craft, message);
        }
    }

    fn to(&mut self, destination: u16, message: impl Into<Message>) {
        let header = Header::new(self.clock.unix_s(), self.settings.number, destination);
        (self.send)(&packet(&header, &message.into(), ByteOrder::Little));
    }
}

fn speed_of(reference: &Reference) -> DesiredSpeed {
    // The unit is m/s.
    DesiredSpeed { value: reference.speed, speed_units: 0 }
}
