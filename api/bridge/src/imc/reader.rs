//! Reads packets as events of the craft's DUNE and its craft, fixes of AUVs, and other vessels.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use geodesy::Datum;
use nalgebra::Vector2;

use super::codec::{
    AisInfo, Announce, EstimatedState, Header, Message, NavigationUncertainty, Packet, PacketReader,
    PlanControl, PlanControlState, VehicleState,
};
use super::mode::{EXTERNAL, SERVICE, follows_references, mode};
use super::{ImcSettings, PLAN};
use crate::mavlink::{Autopilot, AutopilotEvent, Heartbeat};
use crate::nmea::{KNOT, vessel_status};
use crate::recent_positions::displaced;
use crate::{AuvFix, CraftMeasurement, Measurement, Origin, VesselFix, VesselMessage, on_earth};

/// Most systems that are known: a network has some ten.
const SYSTEMS_MAX: usize = 256;
/// Longest name of a system, bytes: names are logged.
const NAME_MAX: usize = 64;
/// Time after which a silent system is forgotten, s: DUNE announces itself every 10 s.
const FORGOTTEN_S: f64 = 30.0;
/// Standard deviation up to which a craft knows its position, m.
const KNOWN_SIGMA_M: f64 = 10.0;
/// Longest use of the craft's place, s, and of an AUV's stated accuracy, s.
const PLACE_KEPT_S: f64 = 2.0;
const SIGMA_KEPT_S: f64 = 10.0;
/// Farthest AUV of a modem, m: sound carries no farther.
const REACH_M: f32 = 20_000.0;
/// Time for which a modem's fixes are used and not the vectors from which DUNE made them, s.
const FIXES_FOR_S: f64 = 60.0;
/// Depth that is not known. Source: IMC, `EstimatedState`.
const NO_DEPTH: f32 = -1.0;
/// `ZUnits`: a depth.
pub(super) const Z_DEPTH: u8 = 1;
/// Any system, any entity. Source: IMC, `FollowReference`.
const ANY: (u16, u8) = (0xFFFF, 0xFF);
/// `PlanControl.type` of a failure, `PlanControlState.state` of a plan that cannot be started.
const FAILURE: u8 = 2;
const BLOCKED: u8 = 0;
/// `LogBookEntry.type` of a warning and of an error.
const WARNING_OR_ERROR: [u8; 2] = [1, 2];
/// A speed over ground from here on means "not known", knots (ITU-R M.1371).
const SPEED_UNKNOWN: f64 = 102.25;

/// Reads the packets of one wire.
pub(crate) struct ImcReader {
    pub(crate) packets: PacketReader,
    settings: ImcSettings,
    systems: BTreeMap<u16, System>,
    /// Time of the newest packets, s of the bridge's clock.
    now: f64,
    was_ambiguous: bool,
    /// Who may steer in the craft's FollowReference, if DUNE has said so: system and entity.
    controller: Option<(u16, u8)>,
    /// Time, s, and place of the craft's newest state.
    place: Option<(f64, Origin)>,
    /// Times of the newest `UsblFixExtended`, by AUV, s.
    fixed: BTreeMap<String, f64>,
    /// `true` in the mode SERVICE, in which DUNE takes plans.
    pub(crate) is_ready: bool,
    /// The answer of DUNE to a plan of FollowReference, with its reason if it refuses.
    pub(crate) takes_plan: Option<Result<(), String>>,
}

struct System {
    name: String,
    /// Time of its newest packet, s; infinite for one that the operator has numbered.
    heard_s: f64,
    /// The sender's own times of its newest messages, by their numbers.
    times: BTreeMap<u16, f64>,
    /// Standard deviation of its position, m, and its time, s.
    sigma: Option<(f64, f64)>,
}

impl ImcReader {
    pub(crate) fn new(settings: ImcSettings) -> Self {
        let named =
            settings.numbers.iter().map(|(number, name)| (*number, System::named(name, f64::INFINITY)));
        Self {
            systems: named.collect(),
            settings,
            packets: PacketReader::default(),
            now: 0.0,
            was_ambiguous: false,
            controller: None,
            place: None,
            fixed: BTreeMap::new(),
            is_ready: false,
            takes_plan: None,
        }
    }

    /// The events that `bytes` complete, received at `now` of the bridge's clock and `unix_s`, s.
    pub(crate) fn push(
        &mut self,
        bytes: &[u8],
        is_datagram: bool,
        now: f64,
        unix_s: f64,
    ) -> Vec<AutopilotEvent> {
        self.now = now;
        let mut heard = vec![];
        for Packet { header, message } in self.packets.push(bytes, is_datagram) {
            if let Some(message) = message.filter(|_| header.source != self.settings.number) {
                self.take(&header, &message, unix_s, &mut heard);
            }
        }
        heard
    }

    /// The number of the craft; `None` before it is heard, and while two systems have its name.
    pub(crate) fn craft(&self) -> Option<u16> {
        self.only(&self.settings.vehicle)
    }

    /// The craft's place by its own navigation, if that is recent.
    pub(crate) fn here(&self) -> Option<Origin> {
        self.place.filter(|(at, _)| self.now - at <= PLACE_KEPT_S).map(|(_, place)| place)
    }

    fn only(&self, name: &str) -> Option<u16> {
        let is_heard = |system: &System| system.name == name && self.now - system.heard_s <= FORGOTTEN_S;
        let mut heard = self.systems.iter().filter(|(_, system)| is_heard(system));
        let (number, _) = heard.next()?;
        heard.next().is_none().then_some(*number)
    }

    fn take(&mut self, header: &Header, message: &Message, unix_s: f64, heard: &mut Vec<AutopilotEvent>) {
        if let Message::Announce(announce) = message {
            return heard.extend(self.announce(header.source, announce));
        }
        let Some(system) = self.systems.get_mut(&header.source) else { return };
        system.heard_s = system.heard_s.max(self.now);
        // A network with two ways delivers twice. 0 means no clock.
        let before = system.times.insert(message.number(), header.time_s);
        if header.time_s != 0.0 && before == Some(header.time_s) {
            return self.packets.rejects.count("repeated message");
        }
        if self.craft() == Some(header.source) {
            self.craft_message(header, message, unix_s, heard);
        }
        let fix = match message {
            Message::AisInfo(vessel) => {
                return match vessel_message(vessel) {
                    Some(vessel) => heard.push(AutopilotEvent::Measured(Measurement::Vessel(vessel))),
                    None => self.packets.rejects.count("AIS without an MMSI"),
                };
            }
            Message::NavigationUncertainty(stated) => {
                let now = self.now;
                if let Some(system) = self.systems.get_mut(&header.source) {
                    system.sigma = sigma(stated).map(|sigma| (now, sigma));
                }
                return;
            }
            _ => self.auv_message(header.source, message, unix_s),
        };
        match fix {
            Some(Ok(fix)) => heard.push(AutopilotEvent::Measured(Measurement::Auv(fix))),
            Some(Err(reason)) => self.packets.rejects.count(reason),
            None => {}
        }
    }

    /// Notes a system; tells of two with the craft's name.
    fn announce(&mut self, number: u16, announce: &Announce) -> Option<AutopilotEvent> {
        let is_text = announce.sys_name.len() <= NAME_MAX && !announce.sys_name.contains(char::is_control);
        if !is_text {
            self.packets.rejects.count("name that is no text");
            return None;
        }
        let now = self.now;
        let is_old = |system: &System| FORGOTTEN_S < now - system.heard_s;
        if !self.systems.contains_key(&number) {
            if self.systems.len() >= SYSTEMS_MAX {
                self.systems.retain(|_, system| !is_old(system));
            }
            if self.systems.len() >= SYSTEMS_MAX {
                self.packets.rejects.count("more systems than are remembered");
                return None;
            }
            tracing::info!("{} is on the network, system {number:#06x}", announce.sys_name);
        }
        let system = self.systems.entry(number).or_insert_with(|| System::named(&announce.sys_name, now));
        if system.name != announce.sys_name {
            if !is_old(system) {
                self.packets.rejects.count("two names of one system");
                return None;
            }
            *system = System::named(&announce.sys_name, now);
        }
        system.heard_s = system.heard_s.max(now);
        let craft = &self.settings.vehicle;
        let is_ambiguous = announce.sys_name == *craft && self.craft().is_none();
        let is_new = is_ambiguous && !self.was_ambiguous;
        if announce.sys_name == *craft {
            self.was_ambiguous = is_ambiguous;
        }
        is_new.then(|| {
            AutopilotEvent::Text(format!(
                "two systems are named {craft}: none of them is steered until one ends"
            ))
        })
    }

    fn craft_message(
        &mut self,
        header: &Header,
        message: &Message,
        unix_s: f64,
        heard: &mut Vec<AutopilotEvent>,
    ) {
        match message {
            Message::VehicleState(state) => {
                if 0.0 < header.time_s && header.time_s.is_finite() {
                    heard.push(AutopilotEvent::Time(header.time_s));
                }
                heard.push(AutopilotEvent::Heartbeat(self.heartbeat(state)));
            }
            Message::EstimatedState(state) => self.craft_state(state, unix_s, heard),
            Message::NavigationUncertainty(stated) => {
                let is_known = sigma(stated).is_some_and(|sigma| sigma <= KNOWN_SIGMA_M);
                heard.push(AutopilotEvent::PositionKnown(is_known));
            }
            // DUNE answers a new manoeuvre with one of these.
            Message::FollowReference(by) => self.controller = Some((by.control_src, by.control_ent)),
            Message::FollowRefState(by) => self.controller = Some((by.control_src, by.control_ent)),
            Message::PlanControl(PlanControl { kind: FAILURE, plan_id, info, .. }) if plan_id == PLAN => {
                self.takes_plan = Some(Err(info.clone()));
                heard.push(AutopilotEvent::Text(format!("FollowReference: {info}")));
            }
            Message::PlanControlState(PlanControlState { state, plan_id, .. }) if plan_id == PLAN => {
                let is_taken = self.takes_plan.is_none() && *state != BLOCKED;
                self.takes_plan = self.takes_plan.take().or(is_taken.then_some(Ok(())));
            }
            Message::LogBookEntry(entry) if WARNING_OR_ERROR.contains(&entry.kind) => {
                heard.push(AutopilotEvent::Text(entry.text.clone()));
            }
            _ => {}
        }
    }

    fn heartbeat(&mut self, state: &VehicleState) -> Heartbeat {
        if !follows_references(state) {
            self.controller = None;
        }
        let ours = |(system, entity)| [ANY.0, self.settings.number].contains(&system) && entity == ANY.1;
        let is_guided = if self.settings.headings {
            state.op_mode == EXTERNAL
        } else {
            follows_references(state) && self.controller.is_none_or(ours)
        };
        self.is_ready = state.op_mode == SERVICE;
        Heartbeat { autopilot: Autopilot::Dune, mode: mode(state, is_guided), is_armed: true }
    }

    fn craft_state(&mut self, state: &EstimatedState, unix_s: f64, heard: &mut Vec<AutopilotEvent>) {
        let Some(place) = place(state) else {
            return self.packets.rejects.count("craft without a position");
        };
        self.place = Some((self.now, place));
        let numbers = [state.psi, state.r, state.vx, state.vy, state.phi, state.theta].map(f64::from);
        if !numbers.iter().all(|number| number.is_finite()) {
            return self.packets.rejects.count("state that is no number");
        }
        let [psi, r, vx, vy, roll, pitch] = numbers;
        let measured = [
            CraftMeasurement::Position(place),
            CraftMeasurement::GroundVelocity(Vector2::new(vx, vy)),
            CraftMeasurement::Heading(psi),
            CraftMeasurement::YawRate(r),
        ];
        heard.extend(measured.map(|measured| AutopilotEvent::of_craft(unix_s, measured)));
        heard.push(AutopilotEvent::Attitude { roll, pitch });
    }

    /// The fix in a message about an AUV, dated by its arrival; `None` if it is about none.
    fn auv_message(
        &mut self,
        source: u16,
        message: &Message,
        unix_s: f64,
    ) -> Option<Result<AuvFix, &'static str>> {
        let is_auv = |name: &str| self.settings.auvs.iter().any(|auv| auv == name);
        let is_craft = self.craft() == Some(source);
        let system = &self.systems[&source];
        let (now, here) = (self.now, self.here());
        let fix = |auv: &str, position: Option<Origin>, sigma: Option<f64>, depth: Option<f64>| {
            let number = |number: f64| Some(number).filter(|number| number.is_finite() && 0.0 <= *number);
            Some(position.ok_or("AUV without a position").map(|position| AuvFix {
                sigma_m: sigma.and_then(number).filter(|sigma| 0.0 < *sigma),
                depth_m: depth.and_then(number),
                ..AuvFix::at(auv, unix_s, position)
            }))
        };
        let ranged = |auv: &str, range: f32| {
            let fix = fix(auv, here.filter(|_| 0.0 < range && range <= REACH_M), None, None)?;
            Some(fix.map(|fix| AuvFix { range_m: Some(range.into()), ..fix }))
        };
        match message {
            Message::EstimatedState(state) if is_auv(&system.name) => {
                if self.only(&system.name).is_none() {
                    return Some(Err("two AUVs of one name"));
                }
                let sigma = system.sigma.filter(|(at, _)| now - at <= SIGMA_KEPT_S).map(|(_, sigma)| sigma);
                let depth = (state.depth != NO_DEPTH).then_some(f64::from(state.depth).max(0.0));
                let velocity = Vector2::new(f64::from(state.vx), f64::from(state.vy));
                let velocity = Some(velocity).filter(|velocity| velocity.norm().is_finite());
                let fix = fix(&system.name, place(state), sigma, depth)?;
                Some(fix.map(|fix| AuvFix { ground_velocity: velocity, ..fix }))
            }
            Message::UsblFixExtended(at) if is_auv(&at.target) => {
                self.fixed.insert(at.target.clone(), now);
                let depth = (at.z_units == Z_DEPTH).then_some(at.z.into());
                fix(&at.target, degrees(at.lat, at.lon), Some(at.accuracy.into()), depth)
            }
            Message::UsblPositionExtended(at) if is_craft && is_auv(&at.target) => {
                let has_fixes = self.fixed.get(&at.target).is_some_and(|newest| now - newest <= FIXES_FOR_S);
                if has_fixes {
                    return None;
                }
                let away = Vector2::new(at.n, at.e);
                let there = here.filter(|_| away.norm() <= REACH_M);
                let there = there.map(|here| displaced(&here, &away.map(f64::from)));
                fix(&at.target, there, Some(at.accuracy.into()), Some(at.d.into()))
            }
            Message::UamRxRange(range) if is_craft && is_auv(&range.sys) => ranged(&range.sys, range.value),
            Message::LblRange(range) if is_craft => {
                ranged(self.settings.beacons.get(&range.id)?, range.range)
            }
            Message::RemoteSensorInfo(at) if is_auv(&at.id) => {
                let depth = (at.alt < 0.0).then_some(-f64::from(at.alt));
                fix(&at.id, degrees(at.lat, at.lon), None, depth)
            }
            _ => None,
        }
    }
}

impl System {
    fn named(name: &str, heard_s: f64) -> Self {
        Self { name: name.to_owned(), heard_s, times: BTreeMap::new(), sigma: None }
    }
}

/// The place at this latitude and longitude, rad.
fn degrees(lat: f64, lon: f64) -> Option<Origin> {
    on_earth(lat.to_degrees(), lon.to_degrees())
}

/// The place of a state: its offset (north, east), m, from its latitude and longitude.
fn place(state: &EstimatedState) -> Option<Origin> {
    let reference = degrees(state.lat, state.lon)?;
    let offset = Vector2::new(f64::from(state.x), f64::from(state.y));
    let datum = Datum::new(&reference.into()).ok().filter(|_| offset.norm().is_finite())?;
    let place = Origin::from(datum.from_local(&offset));
    // Degrees to radians and back may round beyond the antimeridian.
    on_earth(place.lat_deg, place.lon_deg.clamp(-180.0, 180.0))
}

/// The larger standard deviation of a position, m, of its variances, m²; none if one of them says
/// nothing.
fn sigma(stated: &NavigationUncertainty) -> Option<f64> {
    let [x, y] = [stated.x, stated.y].map(|variance| f64::from(variance).sqrt());
    Some(x.max(y)).filter(|_| x.is_finite() && y.is_finite())
}

/// What DUNE's receiver heard of a vessel: directions in rad and speeds in knots, as its driver
/// sends them.
fn vessel_message(at: &AisInfo) -> Option<VesselMessage> {
    let mmsi = at.mmsi.trim().parse().ok().filter(|mmsi| (1..=999_999_999).contains(mmsi))?;
    let (course, speed) = (f64::from(at.course), f64::from(at.speed));
    // A static message has neither.
    let fix = degrees(at.lat, at.lon).map(|position| VesselFix {
        age_s: 0.0,
        position,
        course: Some(course).filter(|course| (0.0..TAU - 1e-4).contains(course)),
        speed: Some(speed).filter(|speed| (0.0..SPEED_UNKNOWN).contains(speed)).map(|speed| speed * KNOT),
        heading: None,
        status: vessel_status(at.nav_status),
    });
    let dimensions = [at.a, at.b, at.c, at.d].map(f64::from);
    let has_length =
        dimensions.iter().all(|side| (0.0..1000.0).contains(side)) && 0.0 < dimensions[0] + dimensions[1];
    let name = at.name.split('@').next().unwrap_or_default().trim();
    Some(VesselMessage {
        mmsi,
        is_own: false,
        fix,
        name: (!name.is_empty()).then(|| name.to_owned()),
        dimensions: has_length.then_some(dimensions),
    })
}
