//! The client: what the variables of a MOOSDB mean, and how it is asked to steer.

use std::collections::BTreeMap;

use ::geodesy::Datum;
use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use planner::snapshot::VesselStatus;

use super::node_report::{NodeReport, Pairs};
use super::packet::{Message, NOTIFY, POISON, PacketReader, TIMING, WELCOME, connection, packet};
use crate::mavlink::{Autopilot, AutopilotEvent, Heartbeat, Mode};
use crate::reference::Reference;
use crate::{
    AuvFix, CraftMeasurement, Measurement, Origin, Parsed, Rejects, VesselFix, VesselMessage, on_earth,
    reject_if,
};

/// Name of the client. A database refuses a second one.
const NAME: &str = "pPilotfish";
/// The craft's numbers. Those of a pair are written together.
const LAT_LON: [&str; 2] = ["NAV_LAT", "NAV_LONG"];
const XY: [&str; 2] = ["NAV_X", "NAV_Y"];
const OVER_GROUND: [&str; 2] = ["NAV_SPEED_OVER_GROUND", "NAV_HEADING_OVER_GROUND"];
const HEADING_SPEED: [&str; 2] = ["NAV_HEADING", "NAV_SPEED"];
const NODES: [&str; 2] = ["NODE_REPORT", "NODE_REPORT_LOCAL"];
const RANGES: [&str; 3] = ["RANGE_REPORT", "CRS_RANGE_REPORT", "BRS_RANGE_REPORT"];
const HELM: &str = "IVPHELM_STATE";
/// The reason for which the helm stops the craft.
const ALL_STOP: &str = "IVPHELM_ALLSTOP";
/// Both spellings are in use.
const OVERRIDES: [&str; 2] = ["MOOS_MANUAL_OVERRIDE", "MOOS_MANUAL_OVERIDE"];
/// What the database writes once a second by itself: its time.
const DB_TIME: &str = "DB_TIME";

/// The modes of a craft with a MOOSDB. It follows in the first two.
const MODES: [&str; 6] =
    ["DRIVE", "DESIRED_*", "PARK", "manual override", "the helm drives too", "helm in another state"];

/// Greatest difference of the times of a pair, s, and of x and y from a position in degrees.
const PAIR_S: f64 = 0.02;
const ANCHOR_S: f64 = 0.5;
/// Greatest distance of x or y from the datum, m.
const XY_MAX: f64 = 1e6;
/// Silence of a better source after which another is used, s.
const HOLD_S: f64 = 2.0;
/// Greatest delay of a relayed report, s. Beyond that a clock is wrong, or runs faster than time.
const LATE_MAX_S: f64 = 60.0;
/// Lead of a time over its arrival from which on the clock is called wrong, s.
const EARLY_S: f64 = 0.5;
/// Silence after which a connection is given up, s: the database speaks every second.
const SILENT_S: f64 = 5.0;
/// Time between two signs of life of the bridge, s: the database drops a client after 5 s.
const ALIVE_S: f64 = 1.0;
/// Longest name of a vessel that the service takes, bytes.
const NAME_MAX: usize = 64;
/// Vessels without an MMSI are numbered by their names, beyond all MMSI.
const NAMED: u32 = 1_000_000_000;

/// A client of the craft's database. Times are s of Unix time, unless they are said to be of the
/// bridge's clock.
#[derive(Debug, Default)]
pub(crate) struct MoosClient {
    packets: PacketReader,
    /// Name of each AUV and time of its newest report by its own clock, by its name in capitals.
    auvs: BTreeMap<String, (String, f64)>,
    /// The datum of x and y, if it was given.
    pub(crate) datum: Option<Origin>,
    /// A place that is known in degrees and in x and y.
    anchor: Option<(Origin, [f64; 2])>,
    /// `true` if it writes the desired heading and speed beside the helm.
    is_raw: bool,
    /// The vehicle's name.
    community: String,
    /// Time and newest value of the craft's numbers.
    numbers: BTreeMap<&'static str, (f64, f64)>,
    /// The craft's newest position and its time.
    position: Option<(f64, Origin)>,
    /// What the newest of both spellings said, and its time.
    is_overridden: Option<bool>,
    overridden_s: f64,
    all_stop: String,
    /// Time at which the helm was last heard to drive.
    driven_s: Option<f64>,
    /// Unix time less the bridge's.
    unix_offset: f64,
    /// Time of the newest message, or of the connection, on the bridge's clock.
    heard_s: Option<f64>,
    /// Time of the last sign of life, on the bridge's clock.
    alive_s: f64,
}

impl MoosClient {
    /// A client that was never connected, of a craft among these `auvs`.
    pub(crate) fn new(auvs: &[String], datum: Option<Origin>, is_raw: bool) -> Self {
        let auv = |name: &String| (name.to_ascii_uppercase(), (name.clone(), f64::NEG_INFINITY));
        let (auvs, anchor) = (auvs.iter().map(auv).collect(), datum.map(|datum| (datum, [0.0; 2])));
        Self { auvs, datum, anchor, is_raw, ..Self::default() }
    }

    pub(crate) fn rejects(&self) -> &Rejects {
        &self.packets.rejects
    }

    /// Begins a new connection at `t_s` of the bridge's clock: what is sent first.
    pub(crate) fn connect(&mut self, t_s: f64, unix_s: f64) -> Vec<u8> {
        self.packets.restart();
        (self.heard_s, self.alive_s, self.unix_offset) = (Some(t_s), t_s, unix_s - t_s);
        // Another database may have been started: it says what holds now.
        (self.is_overridden, self.overridden_s, self.driven_s) = (None, f64::NEG_INFINITY, None);
        self.all_stop.clear();
        let numbers = [LAT_LON, XY, OVER_GROUND, HEADING_SPEED].concat();
        let variables = [&numbers[..], &NODES, &RANGES, &OVERRIDES, &[HELM, ALL_STOP, DB_TIME]].concat();
        connection(NAME, &variables, unix_s)
    }

    /// The sign of life that is due after a message of `t_s` on the bridge's clock.
    pub(crate) fn sign_of_life(&mut self, t_s: f64) -> Option<Vec<u8>> {
        let is_due = self.heard_s == Some(t_s) && ALIVE_S <= t_s - self.alive_s;
        is_due.then(|| {
            self.alive_s = t_s;
            packet(&[self.message(TIMING, "", t_s)])
        })
    }

    /// `true`, once, if the connection is of no use at `now` of the bridge's clock.
    pub(crate) fn gives_up(&mut self, now: f64) -> bool {
        let is_lost = |at: &mut f64| self.packets.is_lost || SILENT_S < now - *at;
        self.heard_s.take_if(is_lost).is_some()
    }

    /// `reference` at `now` of the bridge's clock.
    pub(crate) fn reference(&self, reference: &Reference, now: f64) -> Vec<u8> {
        let (heading, speed) = (reference.heading.to_degrees().rem_euclid(360.0), reference.speed.max(0.0));
        if self.is_raw {
            let number = |key, number| Message { number, ..self.message(NOTIFY, key, now) };
            return packet(&[number("DESIRED_HEADING", heading), number("DESIRED_SPEED", speed)]);
        }
        let (heading, speed) = (format!("heading={heading:.4}"), format!("speed={speed:.5}"));
        let active = ("PILOTFISH_ACTIVE", "true".to_owned());
        self.texts(now, &[("PILOTFISH_HEADING", heading), ("PILOTFISH_SPEED", speed), active])
    }

    /// Stops the craft where no watchdog does: beside the helm.
    pub(crate) fn stop(&self, now: f64) -> Option<Vec<u8>> {
        self.is_raw.then(|| packet(&[self.message(NOTIFY, "DESIRED_SPEED", now)]))
    }

    /// Variables with texts, at `now` of the bridge's clock.
    pub(crate) fn texts(&self, now: f64, texts: &[(&str, String)]) -> Vec<u8> {
        let message = |(key, text): &(&str, String)| Message {
            text: Some(text.clone()),
            ..self.message(NOTIFY, key, now)
        };
        packet(&texts.iter().map(message).collect::<Vec<_>>())
    }

    fn message(&self, kind: u8, key: &str, now: f64) -> Message {
        let (source, key, t_s) = (NAME.to_owned(), key.to_owned(), now + self.unix_offset);
        Message { kind, source, key, t_s, ..Message::default() }
    }

    /// The events in `bytes`, which arrived at `t_s` of the bridge's clock and `unix_s`.
    pub(crate) fn push(&mut self, bytes: &[u8], t_s: f64, unix_s: f64) -> Vec<AutopilotEvent> {
        self.unix_offset = unix_s - t_s;
        let mut events = vec![];
        for message in self.packets.push(bytes) {
            self.heard_s = Some(t_s);
            match (message.kind, &message.text) {
                (WELCOME, _) => {
                    self.community = message.community;
                    // Its clock less that of the greeting.
                    events.push(AutopilotEvent::Time(unix_s + message.number));
                }
                (POISON, Some(why)) => {
                    events.push(AutopilotEvent::Text(format!("the MOOSDB refuses the bridge: {why}")));
                }
                (NOTIFY, Some(text)) => {
                    self.take_text(&message.key, text, [message.t_s, unix_s], &mut events);
                }
                (NOTIFY, None) => self.take_number(&message, unix_s, &mut events),
                _ => {}
            }
        }
        events
    }

    /// The time of a message that says `t_s` and arrived at `unix_s`: a time ahead of its arrival
    /// would seem new for too long, so the arrival counts.
    fn dated(&mut self, t_s: f64, unix_s: f64) -> f64 {
        let age_s = unix_s - t_s;
        if !(-EARLY_S..=LATE_MAX_S).contains(&age_s) {
            self.packets.rejects.count("clock");
        }
        if (0.0..=LATE_MAX_S).contains(&age_s) { t_s } else { unix_s }
    }

    fn take_number(&mut self, message: &Message, unix_s: f64, events: &mut Vec<AutopilotEvent>) {
        if message.key == DB_TIME && self.is_raw {
            let drives = self.driven_s.is_some_and(|at| unix_s - at <= HOLD_S);
            events.push(beat(match self.is_overridden {
                _ if drives => "the helm drives too",
                Some(false) => "DESIRED_*",
                // Controllers begin overridden.
                None | Some(true) => "manual override",
            }));
        }
        let names = [LAT_LON, XY, OVER_GROUND, HEADING_SPEED].concat();
        if let Some(name) = names.into_iter().find(|name| *name == message.key) {
            let t_s = self.dated(message.t_s, unix_s);
            self.numbers.insert(name, (t_s, message.number));
            events.extend(
                self.measured(name, message.number, t_s)
                    .map(|measured| AutopilotEvent::of_craft(t_s, measured)),
            );
        }
    }

    /// The measurement that `name`, now this `number`, completes at `t_s`.
    fn measured(&mut self, name: &'static str, number: f64, t_s: f64) -> Option<CraftMeasurement> {
        let is_heard = |of: [&str; 2]| self.numbers.get(of[0]).is_some_and(|(at, _)| t_s - at <= HOLD_S);
        if name == HEADING_SPEED[0] {
            return Some(CraftMeasurement::Heading(wrap(number.to_radians())));
        }
        if name == HEADING_SPEED[1] {
            let is_used = 0.0 <= number && !is_heard(OVER_GROUND);
            return is_used.then_some(CraftMeasurement::GroundSpeed(number));
        }
        if OVER_GROUND.contains(&name) {
            let (_, [speed, course]) = self.pair(OVER_GROUND)?;
            return Some(CraftMeasurement::GroundVelocity(speed * direction(course.to_radians())));
        }
        let position = if LAT_LON.contains(&name) {
            let (_, [lat_deg, lon_deg]) = self.pair(LAT_LON)?;
            let position = on_earth(lat_deg, lon_deg)?;
            let xy = self.pair(XY).filter(|(at, _)| t_s - at <= ANCHOR_S);
            self.anchor = xy.map(|(_, xy)| (position, xy)).or(self.anchor);
            position
        } else {
            let (_, xy) = self.pair(XY).filter(|_| !is_heard(LAT_LON))?;
            let Some(datum) = self.datum else {
                self.packets.rejects.count("x and y without a datum");
                return None;
            };
            earth(&(datum, [0.0; 2]), xy)?
        };
        self.position = Some((t_s, position));
        Some(CraftMeasurement::Position(position))
    }

    /// Two numbers that were written together, and their time.
    fn pair(&self, names: [&str; 2]) -> Option<(f64, [f64; 2])> {
        let [first, second] = names.map(|name| self.numbers.get(name));
        let ((first_s, first), (second_s, second)) = first.zip(second)?;
        ((first_s - second_s).abs() <= PAIR_S).then_some((*second_s, [*first, *second]))
    }

    fn take_text(
        &mut self,
        key: &str,
        text: &str,
        [written_s, unix_s]: [f64; 2],
        events: &mut Vec<AutopilotEvent>,
    ) {
        if key == HELM {
            // A helm in reserve that took over adds a sign.
            let state = text.trim_end_matches('+');
            self.driven_s = (state == "DRIVE").then_some(unix_s);
            if !self.is_raw {
                events.push(beat(if self.is_overridden == Some(true) { "manual override" } else { state }));
            }
        } else if OVERRIDES.contains(&key) {
            if let Ok(now) = text.to_ascii_lowercase().parse()
                && self.overridden_s <= written_s
            {
                // A clock that is ahead must not silence others.
                (self.is_overridden, self.overridden_s) = (Some(now), written_s.min(unix_s));
            }
            events.extend((self.is_overridden == Some(true)).then(|| beat("manual override")));
        } else if key == ALL_STOP && text != self.all_stop {
            text.clone_into(&mut self.all_stop);
            events.push(AutopilotEvent::Text(format!("{key} {text}")));
        } else if RANGES.contains(&key) {
            match self.range(&Pairs::of(text), unix_s) {
                Some(fix) => events.push(AutopilotEvent::Measured(Measurement::Auv(fix))),
                None => self.packets.rejects.count("range report"),
            }
        } else if NODES.contains(&key)
            && let Err(reason) = self.take_report(text, key == NODES[1], unix_s, events)
        {
            self.packets.rejects.count(reason);
        }
    }

    fn take_report(
        &mut self,
        text: &str,
        is_own: bool,
        unix_s: f64,
        events: &mut Vec<AutopilotEvent>,
    ) -> Parsed<()> {
        let report = NodeReport::read(text).ok_or("node report")?;
        let relative = self.anchor.zip(report.xy).and_then(|(anchor, xy)| earth(&anchor, xy));
        let position = report.position.or(relative).ok_or("node report without a position")?;
        let t_s = report.t_s.map_or(unix_s, |t_s| self.dated(t_s, unix_s));
        if is_own {
            let heard = [LAT_LON[0], XY[0]].into_iter().filter_map(|name| self.numbers.get(name));
            if heard.into_iter().all(|(at, _)| HOLD_S < unix_s - at) {
                self.anchor = report.position.zip(report.xy).or(self.anchor);
                self.position = Some((t_s, position));
                let heading = report.heading.map(|heading| CraftMeasurement::Heading(wrap(heading)));
                let speed = report.speed.map(CraftMeasurement::GroundSpeed);
                let measured = [heading, Some(CraftMeasurement::Position(position)), speed];
                events.extend(
                    measured.into_iter().flatten().map(|measured| AutopilotEvent::of_craft(t_s, measured)),
                );
            }
        } else if let Some((auv, newest_s)) = self.auvs.get_mut(&report.name.to_ascii_uppercase()) {
            // A relay repeats reports. A clock that was set back makes none.
            let written_s = report.t_s.unwrap_or(unix_s);
            reject_if((0.0..=LATE_MAX_S).contains(&(*newest_s - written_s)), "repeated report")?;
            *newest_s = written_s;
            let velocity = report.speed.zip(report.course);
            events.push(AutopilotEvent::Measured(Measurement::Auv(AuvFix {
                depth_m: report.depth_m,
                ground_velocity: velocity.map(|(speed, course)| speed * direction(course)),
                ..AuvFix::at(auv, t_s, position)
            })));
        } else if !report.name.eq_ignore_ascii_case(&self.community) {
            let vessel = vessel(&report, position, unix_s - t_s);
            events.push(AutopilotEvent::Measured(Measurement::Vessel(vessel)));
        }
        Ok(())
    }

    /// A range to an AUV, measured by this craft.
    fn range(&mut self, pairs: &Pairs, unix_s: f64) -> Option<AuvFix> {
        let observer = pairs.text(&["VNAME", "NAME"]).unwrap_or(&self.community);
        let (_, position) = self.position.filter(|(at, _)| unix_s - at <= HOLD_S)?;
        let (auv, _) = self.auvs.get(&pairs.text(&["TARGET", "ID"])?.to_ascii_uppercase())?;
        let range_m = pairs.number(&["RANGE"]).filter(|range| 0.0 <= *range)?;
        let fix = AuvFix { range_m: Some(range_m), ..AuvFix::at(auv, unix_s, position) };
        let is_own = observer.eq_ignore_ascii_case(&self.community);
        let t_s = self.dated(pairs.number(&["TIME"]).unwrap_or(unix_s), unix_s);
        is_own.then_some(AuvFix { t_s, ..fix })
    }

    /// East and north, m, of a place in the database's x and y, once they are known.
    pub(super) fn xy(&self, place: &Origin) -> Option<[f64; 2]> {
        let (anchor, [x, y]) = self.anchor?;
        let local = Datum::new(&anchor.into()).ok()?.to_local(&(*place).into()).ok()?;
        Some([x + local.y, y + local.x])
    }
}

/// The place at `xy`, if this is near the `anchor`.
fn earth((anchor, [x, y]): &(Origin, [f64; 2]), xy: [f64; 2]) -> Option<Origin> {
    let is_near = xy.iter().all(|metres| metres.abs() <= XY_MAX);
    let datum = Datum::new(&(*anchor).into()).ok().filter(|_| is_near)?;
    Some(datum.from_local(&Vector2::new(xy[1] - y, xy[0] - x)).into())
}

fn beat(mode: &str) -> AutopilotEvent {
    let known = MODES.iter().position(|known| *known == mode).unwrap_or(MODES.len() - 1);
    let mode = Mode { name: MODES[known], number: None, is_guided: known < 2 };
    AutopilotEvent::Heartbeat(Heartbeat { autopilot: Autopilot::Helm, mode, is_armed: true })
}

/// Another vehicle as a vessel.
fn vessel(report: &NodeReport, position: Origin, age_s: f64) -> VesselMessage {
    // FNV-1a, so that a name has one number in every run.
    let number = report.name.bytes().fold(0x811C_9DC5_u32, |hash, byte| {
        (hash ^ u32::from(byte.to_ascii_uppercase())).wrapping_mul(0x0100_0193)
    });
    let (course, speed, heading) = (report.course.map(wrap), report.speed, report.heading.map(wrap));
    let (age_s, status) = (age_s.max(0.0), VesselStatus::UnderWay);
    VesselMessage {
        mmsi: NAMED + number % (u32::MAX - NAMED),
        is_own: false,
        fix: Some(VesselFix { age_s, position, course, speed, heading, status }),
        name: Some(report.name.clone())
            .filter(|name| name.len() <= NAME_MAX && !name.contains(char::is_control)),
        // The position is that of the middle.
        dimensions: report.length_m.map(|length| [0.5 * length, 0.5 * length, 0.0, 0.0]),
    }
}
